"""The command line: from a dataset to a calibration file and its report; one line for bad input."""

import json
import re
from pathlib import Path

import equinox as eqx
import jax
import pytest
import xarray as xr

import rodmodel
from calibration.cli import main
from calibration.fit import prepare
from calibration.fit.pipeline import PRIOR_NEAR, PRIOR_NEAR_SEVERAL
from calibration.provenance import sha256
from calibration.sweep import load_dataset, save_dataset

RUN = ["run", "--out", "unused"]


@pytest.fixture
def bad(capsys):
    """Exit status and stderr of arguments that must be refused, with nothing on stdout."""

    def call(*arguments):
        try:
            status = main(list(arguments))
        except SystemExit as ended:
            status = ended.code
        printed = capsys.readouterr()
        assert printed.out == ""
        assert printed.err.count("\n") == 1, printed.err
        return status, printed.err

    return call


@pytest.mark.parametrize(
    ("arguments", "named", "came", "expected"),
    [
        ([*RUN, "--psi-deg", "abc"], "--psi-deg", "abc", "finite number"),
        ([*RUN, "--psi-deg", "30", "0"], "--psi-deg", "30.0, 0.0", "the least and the largest of many"),
        ([*RUN, "--layout", "ring", "--psi-deg", "0", "30"], "--psi-deg", "ring", "one orientation"),
        ([*RUN, "--layout", "ring", "--psi-deg", "30"], "--psi-deg", "30", "for helices only"),
        ([*RUN, "--pitch-mm", "0"], "--pitch-mm", "0", "positive"),
        ([*RUN, "--pitch-mm", "nan"], "--pitch-mm", "nan", "positive"),
        ([*RUN, "--layout", "knot"], "--layout", "knot", "double-helix"),
        ([*RUN, "--layout", "ring", "--pitch-mm", "0.3"], "spacing", "0.15 mm", "more than 0.1778 mm"),
        ([*RUN, "--paths", "0"], "--paths", "0", "at least 1"),
        ([*RUN, "--workers", "two"], "--workers", "two", "whole number"),
        ([*RUN, "--pressure-max-kpa", "70", "50"], "--pressure-max-kpa", "", "3"),
        ([*RUN, "--pressure-max-kpa", "70", "50", "-1"], "--pressure-max-kpa", "-1", "positive"),
        ([*RUN, "--moment-max-nmm", "inf"], "--moment-max-nmm", "inf", "positive"),
        (["run"], "--out", "", "required"),
        (["fit", "missing.nc", "--out", "law.json"], "missing.nc", "", "expected a file of `run`"),
        (["fit", "missing.nc", "--out", "law.json", "--ridges", "0"], "--ridges", "0", "at least 1"),
        (["sweep"], "run | fit | report", "sweep", "fit"),
    ],
)
def test_bad_input_exits_2_with_one_line(bad, arguments, named, came, expected):
    status, line = bad(*arguments)
    assert status == 2
    for part in (named, came, expected):
        assert part in line


def test_an_output_that_cannot_be_written_is_found_before_the_work(bad, run_directory, tmp_path):
    status, line = bad("fit", str(run_directory / "dataset.nc"), "--out", str(tmp_path / "no" / "law.json"))
    assert status == 2
    assert "--out" in line
    assert "expected a path that can be written" in line


def test_a_run_directory_of_another_run_is_refused(bad, run_directory):
    status, line = bad("run", "--out", str(run_directory), "--seed", "5", "--workers", "1")
    assert status == 2
    assert re.search(r"--out: .* holds a run with ", line)


@pytest.mark.parametrize("content", [b"[1,2]", b"null", b"\xff\xfe"])
def test_a_damaged_run_directory_is_told_in_one_line(bad, tmp_path, content):
    (tmp_path / "run.json").write_bytes(content)
    status, line = bad("run", "--out", str(tmp_path))
    assert status == 2
    assert re.search(r"--out: .*run\.json: got ", line)


def test_a_damaged_path_is_told_in_one_line(bad, tmp_path, monkeypatch):
    monkeypatch.setattr("calibration.sweep.sweep.trace_in_processes", lambda *arguments: iter([]))
    path = tmp_path / "paths" / "000-train-named.jsonl"
    path.parent.mkdir()
    path.write_text("[]\n")
    status, line = bad("run", "--out", str(tmp_path), "--paths", "1")
    assert status == 2
    assert re.search(r"--out: .*000-train-named\.jsonl, line 1: got \[\], expected a JSON object", line)


def test_ctrl_c_ends_a_sweep_in_one_line(bad, tmp_path, monkeypatch):
    def interrupted(*arguments):
        raise KeyboardInterrupt
        yield

    monkeypatch.setattr("calibration.sweep.sweep.trace_in_processes", interrupted)
    status, line = bad("run", "--out", str(tmp_path), "--paths", "1")
    assert status == 130
    assert line.strip() == "rodmodel-calibrate: interrupted; states in a run's directory are kept"


@pytest.fixture(scope="module")
def calibrated(run_directory, tmp_path_factory):
    """A calibration file of a few iterations, from the command line."""
    file = tmp_path_factory.mktemp("fit") / "law.json"
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("calibration.fit.pipeline.STARTS", 1)
        patch.setattr("calibration.fit.pipeline.TRIAL_ITERATIONS", 5)
        arguments = ["fit", str(run_directory / "dataset.nc"), "--out", str(file)]
        assert main([*arguments, "--ridges", "6", "--features", "5", "--iterations", "20", "--json"]) == 0
    return file


def test_fit_writes_a_calibration_that_a_rod_can_use(calibrated, run_directory):
    calibration = rodmodel.read_calibration(calibrated)
    assert calibration.layout == rodmodel.Layout("double-helix", 0.0, 3e-3)
    assert calibration.domain == rodmodel.Domain((70e3, 50e3, 50e3), 100e3, 2e-3)
    assert calibration.error_bound.angle == (calibration.error["free_bending_angle_rad"]["p90"],)
    assert 0.05 < calibration.actuator.mass_per_length < 0.1  # 63 mm² of silicone and the rod
    provenance = calibration.provenance
    assert provenance["run_command"] == "rodmodel-calibrate run"
    assert provenance["fit_command"].startswith("rodmodel-calibrate fit ")
    assert re.fullmatch("[0-9a-f]{64}", provenance["dataset_sha256"])
    used = prepare(load_dataset(run_directory / "dataset.nc"), calibration.domain, 0.06)
    assert provenance["states"] == len(used.train) + len(used.held_out)
    assert len(used.train) > len(used.held_out) > 0
    # The jitted law of the file is the one that was judged.
    free = eqx.filter_jit(calibration.section_law.free_curvature)(jax.numpy.array([3e4, 0.0, 0.0]))
    assert free[1] < 0
    assert run_directory.exists()


def test_fit_begins_near_the_law_of_another_winding(calibrated, run_directory, tmp_path, bad):
    fitted = ["fit", str(run_directory / "dataset.nc"), "--out", str(tmp_path / "law.json")]
    status, line = bad(*fitted, "--near", str(calibrated), "--ridges", "6")
    assert status == 2
    assert "--near" in line
    assert "expected the size to be that law's" in line
    status, line = bad(*fitted, "--near", str(tmp_path / "none.json"))
    assert status == 2
    assert "none.json" in line
    shipped = Path(rodmodel.__file__).parent / "calibrations" / "double-helix_psi90_pitch3.json"
    status, line = bad(*fitted, "--near", str(shipped))
    assert status == 2
    for part in ("--near", "psi90", "a law with material.", "--near-another allows it"):
        assert part in line
    assert not (tmp_path / "law.json").exists()
    status, line = bad(*fitted, "--near-weight", "3")
    assert status == 2
    assert "--near-weight: got it without --near" in line
    near = ["--near", str(calibrated), "--iterations", "2"]
    assert main([*fitted, *near, "--near-weight", "3"]) == 0
    provenance = rodmodel.read_calibration(tmp_path / "law.json").provenance
    assert provenance["training"]["prior"] == 3.0
    assert main([*fitted, *near]) == 0
    provenance = rodmodel.read_calibration(tmp_path / "law.json").provenance
    assert provenance["training"]["prior"] == PRIOR_NEAR
    assert provenance["training"]["ridges"] == 6
    assert provenance["near_sha256"] == [sha256(calibrated)]
    several = str(tmp_path / "law.json"), str(calibrated)
    out = tmp_path / "mean.json"
    assert main([*fitted[:2], "--out", str(out), "--near", *several, "--iterations", "2"]) == 0
    provenance = rodmodel.read_calibration(out).provenance
    assert provenance["near_sha256"] == [sha256(Path(file)) for file in several]
    assert provenance["training"]["prior"] == PRIOR_NEAR_SEVERAL


def test_fit_takes_the_training_states_of_another_sweep_too(
    calibrated, run_directory, tmp_path, bad, monkeypatch
):
    # All residuals make the normal matrix, not random combinations of them: steps are the same then.
    monkeypatch.setattr("calibration.fit.levenberg_marquardt._COMBINATIONS_NEAR", 1000.0)
    dataset = run_directory / "dataset.nc"
    other = xr.load_dataset(dataset, engine="h5netcdf")
    fitted = ["fit", str(dataset), "--near", str(calibrated), "--iterations", "2", "--out"]
    save_dataset(other.assign_attrs(mesh="medium"), tmp_path / "medium.nc")
    status, line = bad(*fitted, str(tmp_path / "none.json"), "--also", str(tmp_path / "medium.nc"))
    assert status == 2
    for part in ("--also", "medium.nc", "a sweep with mesh medium", "expected coarse"):
        assert part in line
    save_dataset(other.assign_attrs(seed=1), tmp_path / "other.nc")
    assert main([*fitted, str(tmp_path / "one.json")]) == 0
    assert main([*fitted, str(tmp_path / "two.json"), "--also", str(tmp_path / "other.nc")]) == 0
    one, two = (rodmodel.read_calibration(tmp_path / f"{name}.json") for name in ("one", "two"))
    trained = one.provenance["training"]["states"]
    assert two.provenance["training"]["states"] == 2 * trained
    assert two.provenance["training"]["paths"] == 2 * one.provenance["training"]["paths"]
    assert two.provenance["also_sha256"] == [sha256(tmp_path / "other.nc")]
    # Judged on the first sweep's held-out states alone. Every training state twice leaves the mean square as
    # it is, but for the rounding of the slopes to single precision, of which the steps are made.
    assert two.provenance["states"] - 2 * trained == one.provenance["states"] - trained
    losses = [law.provenance["training"]["mean_square_residual"] for law in (one, two)]
    assert losses[1] == pytest.approx(losses[0], rel=1e-4)


def test_report_repeats_the_figures_of_the_file_and_draws(calibrated, run_directory, tmp_path, capsys):
    arguments = [
        "report",
        str(run_directory / "dataset.nc"),
        str(calibrated),
        "--figures",
        str(tmp_path / "png"),
    ]
    assert main([*arguments, "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert told["error"] == dict(rodmodel.read_calibration(calibrated).error)
    drawn = sorted(file.name for file in (tmp_path / "png").iterdir())
    assert drawn == [
        "angle-against-pressure.png",
        "error-over-states.png",
        "moment-curvature.png",
        "parity.png",
    ]
    assert all(file.read_bytes()[:4] == b"\x89PNG" for file in (tmp_path / "png").iterdir())

    assert main(arguments[:3]) == 0
    table = capsys.readouterr().out
    row = next(line for line in table.splitlines() if line.startswith("| free-bending angle [deg]"))
    p95 = 57.29578 * told["error"]["free_bending_angle_rad"]["p95"]
    assert f"{p95:.3g}" in row


@pytest.mark.slow
def test_report_compares_with_other_laws_on_the_same_states(calibrated, run_directory, monkeypatch, capsys):
    monkeypatch.setattr("calibration.studies.compare_laws.DEGREES", (3,))
    monkeypatch.setattr("calibration.studies.compare_laws.REPEATS", 40)
    arguments = [
        "report",
        str(run_directory / "dataset.nc"),
        str(calibrated),
        "--compare",
        "--iterations",
        "3",
    ]
    assert main(arguments) == 0
    rows = [line for line in capsys.readouterr().out.splitlines() if line.startswith("| ")]
    names = [row.split("|")[1].strip() for row in rows]
    assert names[-3:] == [
        "polynomial of degree 3 in (u, p)",
        "tanh network 6–24–24–1 in (u, p)",
        "network of ridges",
    ]


@pytest.mark.slow
def test_a_domain_narrowed_on_the_command_line_judges_fewer_states(
    run_directory, tmp_path, monkeypatch, capsys
):
    monkeypatch.setattr("calibration.fit.pipeline.STARTS", 1)
    monkeypatch.setattr("calibration.fit.pipeline.TRIAL_ITERATIONS", 2)
    arguments = ["fit", str(run_directory / "dataset.nc"), "--out", str(tmp_path / "law.json"), "--json"]
    short = ["--ridges", "8", "--iterations", "10", "--pressure-max-kpa", "40", "30", "30"]
    assert main([*arguments, *short, "--pressure-sum-max-kpa", "60"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert rodmodel.read_calibration(tmp_path / "law.json").domain.pressure_max == (40e3, 30e3, 30e3)
    worst = told["error"]["volume_m2"]["worst_at"]["pressure_pa"]
    assert worst[0] <= 40e3
    assert sum(worst) <= 60e3


def test_a_file_that_is_no_calibration_is_refused(bad, run_directory, tmp_path):
    (tmp_path / "law.json").write_text('{"schema": "rodmodel-cal')
    status, line = bad("report", str(run_directory / "dataset.nc"), str(tmp_path / "law.json"))
    assert status == 2
    assert "law.json" in line
