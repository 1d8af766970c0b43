"""The command: what it prints, where, and with which status."""

import json
import math
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import rodmodel
from rodmodel import _load
from rodmodel.cli import main
from tests.unit.rodmodel import synthetic

GOOD, BAD_INPUT, NO_CONVERGENCE = 0, 2, 3


@pytest.fixture(scope="module")
def file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("calibration") / "calibration.json"
    rodmodel.save_calibration(synthetic.calibration(), path)
    return path


@pytest.fixture
def predict(file: Path, capsys: pytest.CaptureFixture[str]) -> Any:
    """Run `rodmodel predict` on the synthetic calibration: status, standard output, standard error."""

    def run(*arguments: str) -> tuple[int, str, str]:
        status = main(["predict", "--calibration", str(file), *arguments])
        captured = capsys.readouterr()
        return status, captured.out, captured.err

    return run


def test_json_is_one_object_of_the_agreed_keys_and_nothing_else(predict: Any) -> None:
    status, out, err = predict("--pressure-kpa", "30", "5", "0", "--json")
    assert (status, err) == (GOOD, "")
    assert out.count("\n") == 1
    record = json.loads(out)
    assert list(record) == [
        "bending_angle_deg",
        "bending_plane_deg",
        "tip_position_mm",
        "chamber_volume_mm3",
        "converged",
        "in_domain",
        "error_estimate",
        "branch",
        "stable",
    ]
    solution = synthetic.rod(synthetic.bending_law()).solve([30e3, 5e3, 0.0])
    assert math.isclose(record["bending_angle_deg"], math.degrees(solution.bending_angle), rel_tol=1e-12)
    assert math.isclose(record["bending_plane_deg"], math.degrees(solution.bending_plane), rel_tol=1e-12)
    np.testing.assert_allclose(record["tip_position_mm"], 1e3 * solution.tip_position, rtol=1e-12)
    np.testing.assert_allclose(record["chamber_volume_mm3"], 1e9 * solution.chamber_volume, rtol=1e-12)
    assert (record["converged"], record["in_domain"]) == (True, True)
    assert (record["branch"], record["stable"]) == ("loading", True)
    assert math.isclose(record["error_estimate"]["bending_angle_deg"], math.degrees(0.016), rel_tol=1e-12)


def test_loads_reach_the_rod_in_their_units(predict: Any) -> None:
    status, out, _ = predict(
        *("--pressure-kpa", "30", "5", "0", "--json"),
        *("--tip-force-n", "0", "-1e-3", ".002", "--tip-moment-nmm", "0.1", "0", "-0.2"),
        *("--gravity", "0", "0", "-9.81"),
    )
    assert status == GOOD
    solution = synthetic.rod(synthetic.bending_law()).solve(
        [30e3, 5e3, 0.0], tip_force=[0, -1e-3, 2e-3], tip_moment=[1e-4, 0, -2e-4], gravity=[0, 0, -9.81]
    )
    # The command's fixed steps are within 2e-7 of the length of 66 mm of the reference solver.
    np.testing.assert_allclose(json.loads(out)["tip_position_mm"], 1e3 * solution.tip_position, atol=1.3e-5)


@pytest.fixture
def command(file: Path, capsys: pytest.CaptureFixture[str]) -> Any:
    """Run any command on the synthetic calibration: status, standard output, standard error."""

    def run(name: str, *arguments: str) -> tuple[int, str, str]:
        status = main([name, "--calibration", str(file), *arguments])
        captured = capsys.readouterr()
        return status, captured.out, captured.err

    return run


def test_inverse_and_predict_undo_each_other(command: Any) -> None:
    _, out, _ = command("predict", "--pressure-kpa", "30", "12", "0", "--json")
    pose = json.loads(out)
    bend = ["--bending-angle-deg", f"{pose['bending_angle_deg']}"]
    bend += ["--bending-plane-deg", f"{pose['bending_plane_deg']}"]
    tip = ["--tip-position-mm", *(f"{x:.9f}" for x in pose["tip_position_mm"])]
    for target, distance in ((bend, "distance_deg"), (tip, "distance_mm")):
        status, out, err = command("inverse", *target, "--json")
        assert (status, err, out.count("\n")) == (GOOD, "", 1)
        record = json.loads(out)
        assert list(record)[:3] == ["pressure_kpa", "reached", distance]
        assert set(pose) < set(record)
        assert record["reached"]
        assert record["converged"]
        assert abs(record[distance]) < 0.06
        np.testing.assert_allclose(record["pressure_kpa"], [30.0, 12.0, 0.0], atol=0.1)
        np.testing.assert_allclose(record["tip_position_mm"], pose["tip_position_mm"], atol=0.1)
    status, out, _ = command("inverse", *bend)
    assert status == GOOD
    assert out.startswith("pressures")
    assert "kPa" in out


def test_a_target_out_of_reach_has_its_status_and_the_nearest(command: Any) -> None:
    status, out, err = command("inverse", "--tip-position-mm", "0", "0", "80", "--json")
    assert status == NO_CONVERGENCE
    record = json.loads(out)
    assert (record["reached"], record["converged"]) == (False, True)
    assert 13.9 < record["distance_mm"] < 14.1
    assert err.count("\n") == 1
    assert "out of reach" in err
    assert "14 mm away" in err


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        ("", "got none of them, expected the first two, or the last"),
        ("--bending-angle-deg 30", "got --bending-angle-deg, expected the first two"),
        ("--bending-angle-deg 30 --tip-position-mm 0 0 60", "got --bending-angle-deg and --tip-position-mm"),
        ("--bending-angle-deg -3 --bending-plane-deg 0", "--bending-angle-deg: got '-3', expected one angle"),
        ("--bending-angle-deg 3 --bending-plane-deg x", "--bending-plane-deg: got 'x', expected one finite"),
        ("--tip-position-mm 0 0", "--tip-position-mm: got '0 0', expected three finite components"),
        ("--tip-position-mm 0 0 60 --plot a.png", "--plot a.png"),
    ],
)
def test_bad_targets_are_told_in_one_line(command: Any, arguments: str, said: str) -> None:
    status, out, err = command("inverse", *arguments.split())
    assert (status, out, err.count("\n")) == (BAD_INPUT, "", 1)
    assert said in err


def test_workspace_tells_how_far_the_rod_gets(command: Any, tmp_path: Path) -> None:
    picture = tmp_path / "space.png"
    status, out, err = command("workspace", "--samples", "400", "--json", "--plot", str(picture))
    assert (status, err, out.count("\n")) == (GOOD, "", 1)
    record = json.loads(out)
    count = record["samples"]
    assert count == pytest.approx(400, rel=0.15)
    assert record["in_domain"] == count
    for name in ("pressure_kpa", "tip_position_mm", "bending_angle_deg", "bending_plane_deg"):
        assert len(record[name]) == count
    np.testing.assert_allclose(record["tip_max_mm"], np.max(record["tip_position_mm"], axis=0))
    farthest = max(record["farthest_bends"], key=lambda bend: bend["bending_angle_deg"])
    assert farthest["bending_angle_deg"] == max(record["bending_angle_deg"])
    assert picture.read_bytes().startswith(b"\x89PNG")
    status, out, _ = command("workspace", "--samples", "400")
    assert status == GOOD
    for wanted in ("samples", "tip, most", "mm", "plane [deg]", "kPa"):
        assert wanted in out


@pytest.mark.parametrize("samples", ["ten", "5", "-400", "1e3"])
def test_a_count_of_samples_that_is_none_is_refused(command: Any, samples: str) -> None:
    status, out, err = command("workspace", "--samples", samples)
    assert (status, out, err.count("\n")) == (BAD_INPUT, "", 1)
    assert f"--samples: got '{samples}', expected a whole number" in err


def test_orientation_renumbers_the_chambers(predict: Any) -> None:
    """At ψ = 120° chamber 2 is to the winding what chamber 1 is at ψ = 0."""
    _, straight, _ = predict("--pressure-kpa", "30", "5", "0", "--json")
    status, turned, _ = predict("--psi-deg", "120", "--pressure-kpa", "0", "30", "5", "--json")
    assert status == GOOD
    one, other = json.loads(straight), json.loads(turned)
    assert math.isclose(one["bending_angle_deg"], other["bending_angle_deg"], rel_tol=1e-12)
    assert math.isclose(one["bending_plane_deg"] + 120.0, other["bending_plane_deg"], rel_tol=1e-12)
    np.testing.assert_allclose(other["chamber_volume_mm3"], np.roll(one["chamber_volume_mm3"], 1), rtol=1e-12)


def test_people_get_units_and_the_error(predict: Any) -> None:
    status, out, err = predict("--pressure-kpa", "30", "0", "0")
    assert (status, err) == (GOOD, "")
    for wanted in (
        "bending angle",
        "deg",
        "tip position",
        "mm",
        "chamber volumes",
        "mm3",
        "within 0.92 deg",
        "loading",
    ):
        assert wanted in out


def test_a_moment_beyond_the_calibration_is_said(predict: Any) -> None:
    status, out, _ = predict("--pressure-kpa", "30", "0", "0", "--tip-force-n", "0", "0.2", "0", "--json")
    record = json.loads(out)
    assert (status, record["converged"], record["in_domain"]) == (GOOD, True, False)
    assert record["error_estimate"] == {"bending_angle_deg": None}
    assert record["branch"] is None
    _, out, _ = predict("--pressure-kpa", "30", "0", "0", "--tip-force-n", "0", "0.2", "0")
    assert "beyond the calibration" in out


def test_no_convergence_has_its_status_and_what_was_reached(predict: Any) -> None:
    status, out, err = predict("--pressure-kpa", "30", "0", "0", "--tip-force-n", "300", "0", "0", "--json")
    assert status == NO_CONVERGENCE
    record = json.loads(out)
    assert record["converged"] is False
    assert all(math.isfinite(x) for x in record["tip_position_mm"])
    assert err.count("\n") == 1
    assert "no convergence" in err
    assert "% of the loads" in err


@pytest.fixture(scope="module")
def bad_files(file: Path) -> dict[str, Path]:
    folder = file.parent
    files = {
        "truncated": folder / "truncated.json",
        "other": folder / "other.json",
        "png": folder / "folder.png",
    }
    files["truncated"].write_text(file.read_text()[:500])
    files["other"].write_text(file.read_text().replace("rodmodel-calibration", "something-else"))
    files["png"].mkdir()
    return files


THREE_PRESSURES = "expected three gauge pressures, one for each chamber, each 0 or more [kPa]"
COMPONENTS = "expected three finite components in the world frame"
PLOT_FILE = "expected a .pdf, .png or .svg file in a directory that can be written to"

# Arguments, and what the line must hold: the argument, what came, what is expected.
BAD_INPUTS = [
    ("", "--pressure-kpa: got ''", THREE_PRESSURES),
    ("--pressure-kpa -1 0 0", "--pressure-kpa: got '-1 0 0'", THREE_PRESSURES),
    ("--pressure-kpa -1e-3 0 0", "--pressure-kpa: got '-1e-3 0 0'", THREE_PRESSURES),
    ("--pressure-kpa nan 0 0", "--pressure-kpa: got 'nan 0 0'", THREE_PRESSURES),
    ("--pressure-kpa -inf 0 0", "--pressure-kpa: got '-inf 0 0'", THREE_PRESSURES),
    ("--pressure-kpa 1 2", "--pressure-kpa: got '1 2'", THREE_PRESSURES),
    ("--pressure-kpa 1 2 3 4", "--pressure-kpa: got '1 2 3 4'", THREE_PRESSURES),
    ("--pressure-kpa 500 0 0", "--pressure-kpa: got '500 0 0'", "at most 70, 60, 60 kPa in chambers 1, 2, 3"),
    ("--pressure-kpa 60 50 0", "--pressure-kpa: got '60 50 0'", "100 kPa in sum"),
    ("{p} --tip-force-n 1 x 0", "--tip-force-n: got '1 x 0'", COMPONENTS),
    ("{p} --tip-moment-nmm 1", "--tip-moment-nmm: got '1'", COMPONENTS),
    ("{p} --gravity 0 0 inf", "--gravity: got '0 0 inf'", COMPONENTS),
    ("{p} --psi-deg abc", "--psi-deg: got 'abc'", "expected one finite angle [deg]"),
    (
        "{p} --psi-deg 12",
        "--psi-deg: got '12'",
        "expected double-helix, pitch 3 mm, psi 0 deg and every",
    ),
    ("{p} --pitch-mm 0", "--pitch-mm: got '0'", "expected one positive length [mm]"),
    ("{p} --pitch-mm 4", "--pitch-mm: got '4'", "expected double-helix, pitch 3 mm"),
    ("{p} --layout braid", "--layout: got 'braid'", "expected double-helix"),
    (
        "{p} --calibration {truncated}",
        "{truncated}: got text that is not JSON",
        "expected a whole",
    ),
    ("{p} --calibration {other}", "{other}: schema: got 'something-else'", 'expected "rodmodel-calibration"'),
    ("{p} --calibration /no/such", "--calibration: /no/such: got", "expected a readable calibration file"),
    ("{p} --plot /no/such/a.png", "--plot: got '/no/such/a.png'", PLOT_FILE),
    ("{p} --plot a.xyz", "--plot: got 'a.xyz'", PLOT_FILE),
    ("{p} --plot {png}", "--plot: got '{png}'", PLOT_FILE),
    ("{p} --plot", "argument --plot", "expected one argument"),
    ("{p} --colour red", "--colour red", "see rodmodel --help"),
    ("--press 1 2 3", "--press 1 2 3", "see rodmodel --help"),
]


@pytest.mark.parametrize(("arguments", "came", "expected"), BAD_INPUTS)
def test_bad_input_is_told_in_one_line(
    predict: Any, bad_files: dict[str, Path], arguments: str, came: str, expected: str
) -> None:
    filled = arguments.format(p="--pressure-kpa 30 0 0", **bad_files)
    status, out, err = predict(*filled.split())
    assert (status, out) == (BAD_INPUT, "")
    assert err.startswith("rodmodel: ")
    assert err.count("\n") == 1
    assert came.format(**bad_files) in err
    assert expected in err


@pytest.mark.parametrize("arguments", [[], ["bend"]])
def test_a_command_is_needed(arguments: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    assert main(arguments) == BAD_INPUT
    err = capsys.readouterr().err
    assert err.count("\n") == 1
    assert "predict" in err


def test_a_picture_is_written_beside_the_json(predict: Any, tmp_path: Path) -> None:
    picture = tmp_path / "bent.png"
    status, out, err = predict("--pressure-kpa", "30", "0", "0", "--json", "--plot", str(picture))
    assert (status, err) == (GOOD, "")
    assert json.loads(out)["converged"]
    assert picture.read_bytes().startswith(b"\x89PNG")


@pytest.mark.parametrize("picture", ["/proc/a.png", "/tmp/" + 300 * "a" + ".png"])
def test_a_picture_that_cannot_be_written_is_told(predict: Any, picture: str) -> None:
    """A directory that looks as if it took files and does not; a name that is too long."""
    status, out, err = predict("--pressure-kpa", "30", "0", "0", "--plot", picture)
    assert (status, out) == (BAD_INPUT, "")
    assert err.count("\n") == 1
    assert PLOT_FILE in err


def test_layouts_lists_what_ships(
    file: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(_load, "_SHIPPED", file.parent)
    for bad in file.parent.glob("*.json"):
        if bad != file:
            bad.unlink()
    assert main(["layouts"]) == GOOD
    out = capsys.readouterr().out
    for wanted in ("double-helix", "3 mm", "every 60 deg", "70, 60, 60 kPa", "1.2 N mm", "0.92"):
        assert wanted in out
    assert main(["layouts", "--json"]) == GOOD
    (record,) = json.loads(capsys.readouterr().out)["calibrations"]
    assert record["layout"] == "double-helix"
    np.testing.assert_allclose(record["pressure_max_kpa"], [70, 60, 60])
    assert math.isclose(record["error"]["bending_angle_deg"]["p95"], math.degrees(0.016))


def test_the_command_itself_runs_in_double_precision_without_diffrax_or_matplotlib(file: Path) -> None:
    script = f"""
import sys
from rodmodel.cli import main
status = main(["predict", "--calibration", {str(file)!r}, "--pressure-kpa", "30", "0", "0", "--json"])
assert not {{"diffrax", "optimistix", "matplotlib", "scipy"}} & set(sys.modules)
sys.exit(status)
"""
    run = subprocess.run(
        [sys.executable, "-W", "error", "-c", script], capture_output=True, text=True, check=False
    )
    assert (run.returncode, run.stderr) == (GOOD, "")
    angle = json.loads(run.stdout)["bending_angle_deg"]
    expected = synthetic.rod(synthetic.bending_law()).solve([30e3, 0.0, 0.0]).bending_angle
    assert math.isclose(angle, math.degrees(expected), rel_tol=1e-12)


def test_output_that_is_not_read_to_its_end_is_no_failure_to_tell_of():
    code = "import sys; from rodmodel.cli import main; sys.exit(main(['layouts']))"
    with subprocess.Popen(
        [sys.executable, "-c", code], stdout=subprocess.PIPE, stderr=subprocess.PIPE
    ) as run:
        run.stdout.close()
        assert run.stderr.read() == b""
    assert run.returncode == 141
