"""The report of all laws and rods: datasets are known by their checksum, windings by their titles."""

import json
import math
from dataclasses import replace
from pathlib import Path

import pytest
import xarray as xr

import rodmodel
from calibration.cli import main
from calibration.report import report_map
from calibration.report.all_layouts import datasets_by_checksum, title
from calibration.truth import SHIPPED, layout_of
from fem_reference import layout
from rodmodel import Layout
from tests.unit.rodmodel import synthetic

DATASETS = Path(__file__).parents[4] / "calibration" / "datasets"


@pytest.mark.parametrize(
    ("winding", "expected"),
    [
        (layout("double-helix", math.radians(30.0), 4e-3), "double-helix, pitch 4 mm, ψ = 30°"),
        (layout("ring"), "ring, pitch 3 mm"),
        (layout("six-helix"), "six-helix, pitch 3 mm"),
    ],
)
def test_a_winding_and_its_calibration_have_one_title(winding, expected):
    assert title(layout_of(winding)) == expected


def test_a_law_of_all_orientations_says_so():
    assert title(Layout("double-helix", None, 3e-3)) == "double-helix, pitch 3 mm, any ψ"


@pytest.fixture(scope="module")
def ring():
    """The smallest law that ships with its dataset."""
    return next(law for law in rodmodel.shipped_calibrations() if law.layout.name == "ring")


def test_a_law_is_judged_by_the_dataset_that_it_was_fitted_to(ring, tmp_path):
    found = report_map(ring, datasets_by_checksum(DATASETS), tmp_path)
    assert found.recomputed
    for quantity, stated in ring.error.items():
        if quantity in found.error and isinstance(stated, dict):
            for figure in ("median", "p95", "worst"):
                # The search for the equilibrium ends at 1e-8.
                assert found.error[quantity][figure] == pytest.approx(stated[figure], rel=1e-5), quantity
    assert (tmp_path / "ring_pitch3" / "parity.png").exists()


def test_without_its_dataset_a_law_has_the_figures_of_its_file(tmp_path):
    calibration = synthetic.calibration()
    found = report_map(calibration, {}, tmp_path)
    assert not found.recomputed
    assert found.error == calibration.error
    assert not list(tmp_path.iterdir())


@pytest.fixture
def one_run(tmp_path):
    """A file with the truth of chamber 1 alone."""
    truth = xr.load_dataset(SHIPPED, engine="h5netcdf")
    file = tmp_path / "truth.nc"
    truth.isel(state=(truth["case"].values == "chamber1").nonzero()[0]).to_netcdf(file, engine="h5netcdf")
    return file


def test_the_report_of_all_has_a_row_for_each_law_and_winding(ring, one_run, tmp_path, monkeypatch, capsys):
    made = synthetic.calibration()
    limited = replace(made.domain, beside_share=0.5, beside_max=79e3)
    laws = [ring, replace(made, domain=limited)]
    monkeypatch.setattr(rodmodel, "shipped_calibrations", lambda: laws)
    arguments = ["report", "--datasets", str(DATASETS), "--truth", str(one_run)]
    assert main([*arguments, "--figures", str(tmp_path / "png")]) == 0
    rows = [line for line in capsys.readouterr().out.splitlines() if line.startswith(("| ring", "| double"))]
    # Both maps, the rod, and its states in the bounds' coverage.
    assert [row.count("as its file states") for row in rows] == [0, 1, 0, 0]
    assert rows[3].count("%") == 2
    assert "in sum |" in rows[0]
    assert "100 in sum; 79 in each with 0.5 of the others |" in rows[1]
    assert "0.23 / 0.92 / 2.86" in rows[1]  # 0.004, 0.016 and 0.05 rad
    assert (tmp_path / "png" / "rod-against-actuator.png").read_bytes()[:4] == b"\x89PNG"

    assert main([*arguments, "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert [law["recomputed"] for law in told["maps"]] == [True, False]
    alone, everything = told["rods"]["double-helix, pitch 3 mm, ψ = 0°"], told["rods"]["all"]
    assert alone == everything
    assert alone["cases"] == ["chamber1"]
    assert told["coverage"]["layouts"] == {"double-helix, pitch 3 mm, ψ = 0°": told["coverage"]["all"]}
    assert told["coverage"]["all"]["states"] == alone["judged"]
    assert 0 < alone["judged"] <= alone["states"]


def test_a_law_without_equilibrium_somewhere_is_told_and_ends_with_3(ring, one_run, monkeypatch, capsys):
    nowhere = {name: dict(row) if isinstance(row, dict) else row for name, row in ring.error.items()}
    nowhere["moment_nm"]["worst"] = math.inf
    monkeypatch.setattr(rodmodel, "shipped_calibrations", lambda: [ring])
    monkeypatch.setattr("calibration.report.all_layouts.judge", lambda *_: nowhere)
    status = main(["report", "--datasets", str(DATASETS), "--truth", str(one_run), "--json"])
    printed = capsys.readouterr()
    assert status == 3
    assert (
        json.loads(printed.out, parse_constant=pytest.fail)["maps"][0]["error"]["moment_nm"]["worst"] is None
    )
    assert printed.err == (
        "rodmodel-calibrate report: ring, pitch 3 mm: the law has no equilibrium at some held-out states\n"
    )


def test_where_no_state_can_be_judged_the_judge_ends_with_3(one_run, capsys):
    assert main(["judge", str(one_run), "--json"]) == 0
    capsys.readouterr()
    status = main(["judge", str(one_run), "--role", "fit", "--json"])
    printed = capsys.readouterr()
    assert status == 3
    assert json.loads(printed.out)["judged"] == 0
    assert "none of 0 states of fit runs can be judged" in printed.err


@pytest.mark.parametrize(
    ("arguments", "named", "expected"),
    [
        (["--compare"], "--compare", "expected one, and a calibration file"),
        (["--datasets", "no-such-directory"], "--datasets", "expected a directory with netCDF files"),
        (["--truth", "no-such-file.nc"], "no-such-file.nc", "expected"),
        (["only-a-dataset.nc"], "file: got none", "expected a calibration file"),
    ],
)
def test_what_the_report_cannot_use_is_refused_in_one_line(arguments, named, expected, one_run, capsys):
    given = ["report", *arguments]
    if "--truth" not in arguments:
        given += ["--truth", str(one_run)]
    assert main(given) == 2
    told = capsys.readouterr()
    assert told.out == ""
    assert named in told.err
    assert expected in told.err
    assert told.err.count("\n") == 1
