"""The command: what it prints, where, and with which status."""

import json
import math
import re
import subprocess
import sys
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import rodmodel
from rodmodel.cli import main
from rodmodel.cli._inverse import not_reached
from rodmodel.cli._predict import stopped
from rodmodel.core import Result
from tests.unit.rodmodel import calibrations

GOOD, BAD_INPUT, NO_CONVERGENCE = 0, 2, 3


@pytest.fixture(scope="module")
def file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("calibration") / "calibration.json"
    rodmodel.save_calibration(calibrations.calibration(), path)
    return path


@pytest.fixture(scope="module")
def rod(file: Path) -> rodmodel.CoreRod:
    return rodmodel.load_core("double-helix", path=file)


@pytest.fixture
def predict(file: Path, capsys: pytest.CaptureFixture[str]) -> Any:
    """Run `rodmodel predict` on the synthetic calibration: status, standard output, standard error."""

    def run(*arguments: str) -> tuple[int, str, str]:
        status = main(["predict", "--calibration", str(file), *arguments])
        captured = capsys.readouterr()
        return status, captured.out, captured.err

    return run


def test_json_is_one_object_of_the_agreed_keys_and_nothing_else(predict: Any, rod: rodmodel.CoreRod) -> None:
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
        "result",
        "load_fraction",
    ]
    solution = rod.solve([30e3, 5e3, 0.0])
    assert math.isclose(record["bending_angle_deg"], math.degrees(solution.bending_angle), rel_tol=1e-12)
    assert math.isclose(record["bending_plane_deg"], math.degrees(solution.bending_plane), rel_tol=1e-12)
    np.testing.assert_allclose(record["tip_position_mm"], 1e3 * solution.tip_position, rtol=1e-12)
    np.testing.assert_allclose(record["chamber_volume_mm3"], 1e9 * solution.chamber_volume, rtol=1e-12)
    assert (record["converged"], record["in_domain"]) == (True, True)
    assert (record["branch"], record["stable"]) == ("loading", True)
    assert (record["result"], record["load_fraction"]) == ("successful", 1.0)
    assert math.isclose(record["error_estimate"]["bending_angle_deg"], math.degrees(0.016), rel_tol=1e-12)


def test_loads_and_base_reach_the_rod_in_their_units(predict: Any, rod: rodmodel.CoreRod) -> None:
    status, out, _ = predict(
        *("--pressure-kpa", "30", "5", "0", "--json"),
        *("--tip-force-n", "0", "-1e-3", ".002", "--tip-moment-nmm", "0.1", "0", "-0.2"),
        *("--gravity", "0", "0", "-9.81", "--distributed-force-n-per-m", "0.02", "+0.01", "0"),
        *("--follower-force-n", "0.001", "0", "-0.002", "--follower-moment-nmm", "0", "0.05", "0.1"),
        *("--base-position-mm", "1", "2", "3", "--base-rotation-deg", "0", "90", "0"),
    )
    assert status == GOOD
    solution = rod.solve(
        [30e3, 5e3, 0.0],
        tip_force=[0, -1e-3, 2e-3],
        tip_moment=[1e-4, 0, -2e-4],
        gravity=[0, 0, -9.81],
        distributed_force=[0.02, 0.01, 0.0],
        follower_force=[1e-3, 0.0, -2e-3],
        follower_moment=[0.0, 5e-5, 1e-4],
        base_position=[1e-3, 2e-3, 3e-3],
        # A quarter turn about y: z becomes x.
        base_rotation=[[0.0, 0.0, 1.0], [0.0, 1.0, 0.0], [-1.0, 0.0, 0.0]],
    )
    np.testing.assert_allclose(json.loads(out)["tip_position_mm"], 1e3 * solution.tip_position, rtol=1e-9)


def test_a_base_is_turned_about_the_axis_of_its_vector(predict: Any) -> None:
    """A third of a turn about (1, 1, 1) takes z to x, x to y and y to z."""
    third = ["--base-rotation-deg", *3 * [f"{120.0 / math.sqrt(3.0)}"]]
    _, straight, _ = predict("--pressure-kpa", "30", "5", "0", "--json")
    _, turned, _ = predict("--pressure-kpa", "30", "5", "0", "--json", *third)
    x, y, z = json.loads(straight)["tip_position_mm"]
    np.testing.assert_allclose(json.loads(turned)["tip_position_mm"], [z, x, y], atol=1e-9)


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
        assert list(record)[:4] == ["pressure_kpa", "reached", distance, "nearest"]
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
    assert ("out of reach: the above comes nearest" in err) == record["nearest"]
    assert "14 mm away" in err


@pytest.mark.parametrize(
    ("found", "said"),
    [
        ({"nearest": True}, "out of reach: the above comes nearest and stays 3 deg away"),
        ({"nearest": False}, "not reached: the above stays 3 deg away"),
        ({"nearest": False, "converged": False}, "no convergence: the search ended 3 deg away"),
        ({"result": "unstable"}, "no convergence: under the loads the rod has no equilibrium"),
    ],
)
def test_nearest_is_said_only_where_it_is_known(found: dict[str, Any], said: str) -> None:
    record = {"result": "successful", "converged": True, "distance_deg": 3.0, **found}
    told = not_reached(record)
    assert told.startswith(said)
    assert ": take " in told
    assert ("nearest" in told) == (found.get("nearest") is True)


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


@pytest.mark.parametrize("samples", ["ten", "5", "-400", "1e3", "1_000", "٤٠٠", "9" * 5000, "1000001"])
def test_a_count_of_samples_that_is_none_is_refused(command: Any, samples: str) -> None:
    status, out, err = command("workspace", "--samples", samples)
    assert (status, out, err.count("\n")) == (BAD_INPUT, "", 1)
    assert f"--samples: got '{samples}', expected a whole number from 100 to 1000000" in err


def test_orientation_renumbers_the_chambers(predict: Any) -> None:
    """At ψ = 120° chamber 2 is to the winding what chamber 1 is at ψ = 0."""
    _, straight, _ = predict("--pressure-kpa", "30", "5", "0", "--json")
    status, turned, _ = predict("--psi-deg", "120", "--pressure-kpa", "0", "30", "5", "--json")
    assert status == GOOD
    one, other = json.loads(straight), json.loads(turned)
    assert math.isclose(one["bending_angle_deg"], other["bending_angle_deg"], rel_tol=1e-12)
    turn = math.remainder(other["bending_plane_deg"] - one["bending_plane_deg"], 360.0)
    assert math.isclose(turn, 120.0, rel_tol=1e-12)
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


def test_no_convergence_has_its_status_and_what_stopped_it(predict: Any) -> None:
    """A force on the tip, straight down, buckles the rod that stands."""
    status, out, err = predict("--pressure-kpa", "0", "0", "0", "--tip-force-n", "0", "0", "-1", "--json")
    assert status == NO_CONVERGENCE
    record = json.loads(out)
    assert (record["converged"], record["result"]) == (False, "unstable")
    assert all(math.isfinite(x) for x in record["tip_position_mm"])
    assert err.count("\n") == 1
    assert "no convergence: the above is the equilibrium at" in err
    assert f"% of the loads: {Result.unstable.message}" in err


@pytest.mark.parametrize("result", [result.name for result in Result if result.name != "successful"])
def test_every_end_of_a_solve_has_its_reason_and_remedy(result: str) -> None:
    record = {"result": result, "load_fraction": 0.5, "in_domain": False}
    why, remedy = Result[result].message.rsplit("; ", 1)
    told = stopped(record)
    assert (
        told
        == f"the above is the equilibrium at 50 % of the loads and beyond the calibration: {why}; {remedy}"
    )
    assert "at no part of the loads" in stopped({**record, "load_fraction": None})
    assert "beyond the calibration" not in stopped({**record, "in_domain": True})


def test_a_straight_rod_has_no_plane(predict: Any) -> None:
    status, out, _ = predict("--pressure-kpa", "0", "0", "0", "--json")
    record = json.loads(out)
    assert (status, record["bending_plane_deg"]) == (GOOD, None)
    assert record["bending_angle_deg"] == pytest.approx(0.0, abs=1e-9)
    _, out, _ = predict("--pressure-kpa", "0", "0", "0")
    assert re.search(r"^bending plane +– deg$", out, re.MULTILINE)


def test_a_calibration_file_decides_what_was_not_asked_for(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "own.json"
    layout = rodmodel.Layout("six-helix", math.radians(12), 4e-3)
    law = calibrations.ridge_arrays(symmetry="none")
    rodmodel.save_calibration(calibrations.calibration(law, layout), path)
    rod = rodmodel.load_core("six-helix", math.radians(12), 4e-3, path)
    expected = rod.solve([30e3, 5e3, 0.0]).tip_position
    given = ["predict", "--calibration", str(path), "--pressure-kpa", "30", "5", "0", "--json"]
    full = ["--layout", "six-helix", "--psi-deg", "12", "--pitch-mm", "4"]
    for flags in ([], full[:2], full[2:4], full[4:], full):
        assert main([*given, *flags]) == GOOD
        tip = json.loads(capsys.readouterr().out)["tip_position_mm"]
        np.testing.assert_allclose(tip, 1e3 * expected, rtol=1e-12)
    assert main([*given, "--psi-deg", "0"]) == BAD_INPUT
    assert "--psi-deg: got '0', expected six-helix, pitch 4 mm, psi 12" in capsys.readouterr().err


def test_a_file_of_all_orientations_is_taken_at_zero(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "all.json"
    rodmodel.save_calibration(calibrations.oriented_calibration(), path)
    given = ["predict", "--calibration", str(path), "--pressure-kpa", "30", "5", "0", "--json"]
    assert main(given) == GOOD
    default = capsys.readouterr().out
    assert main([*given, "--psi-deg", "0"]) == GOOD
    assert capsys.readouterr().out == default
    assert main([*given, "--psi-deg", "20"]) == GOOD
    assert capsys.readouterr().out != default


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
IN_CAP = "expected three finite components in the frame of the cap"
PLOT_FILE = "expected a .pdf, .png or .svg file in a directory that can be written to"

# Arguments, and what the line must hold: the argument, what came, what is expected.
BAD_INPUTS = [
    ("", "--pressure-kpa: got ''", THREE_PRESSURES),
    ("--pressure-kpa -1 0 0", "--pressure-kpa: got '-1 0 0'", THREE_PRESSURES),
    ("--pressure-kpa -1e-3 0 0", "--pressure-kpa: got '-1e-3 0 0'", THREE_PRESSURES),
    ("--pressure-kpa 1_0 0 0", "--pressure-kpa: got '1_0 0 0'", THREE_PRESSURES),
    ("--pressure-kpa ١٠ 0 0", "--pressure-kpa: got '١٠ 0 0'", THREE_PRESSURES),
    ("--pressure-kpa 1e999 0 0", "--pressure-kpa: got '1e999 0 0'", THREE_PRESSURES),
    ("--pressure-kpa 0x10 0 0", "--pressure-kpa: got '0x10 0 0'", THREE_PRESSURES),
    ("--pressure-kpa nan 0 0", "--pressure-kpa: got 'nan 0 0'", THREE_PRESSURES),
    ("--pressure-kpa -inf 0 0", "--pressure-kpa: got '-inf 0 0'", THREE_PRESSURES),
    ("--pressure-kpa 1 2", "--pressure-kpa: got '1 2'", THREE_PRESSURES),
    ("--pressure-kpa 1 2 3 4", "--pressure-kpa: got '1 2 3 4'", THREE_PRESSURES),
    ("--pressure-kpa 500 0 0", "--pressure-kpa: got '500 0 0'", "at most 70, 60, 60 kPa in chambers 1, 2, 3"),
    ("--pressure-kpa 60 50 0", "--pressure-kpa: got '60 50 0'", "100 kPa in sum"),
    ("{p} --tip-force-n 1 x 0", "--tip-force-n: got '1 x 0'", COMPONENTS),
    ("{p} --tip-moment-nmm 1", "--tip-moment-nmm: got '1'", COMPONENTS),
    ("{p} --gravity 0 0 inf", "--gravity: got '0 0 inf'", COMPONENTS),
    ("{p} --distributed-force-n-per-m 1 2", "--distributed-force-n-per-m: got '1 2'", COMPONENTS),
    ("{p} --follower-force-n 1 2 y", "--follower-force-n: got '1 2 y'", IN_CAP),
    ("{p} --follower-moment-nmm 1 2 nan", "--follower-moment-nmm: got '1 2 nan'", IN_CAP),
    ("{p} --base-position-mm 1", "--base-position-mm: got '1'", COMPONENTS),
    ("{p} --base-rotation-deg 1 2", "--base-rotation-deg: got '1 2'", COMPONENTS),
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
    monkeypatch.setattr(import_module("rodmodel.io.load"), "_SHIPPED", file.parent)
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


def test_the_command_itself_predicts_without_jax_or_matplotlib(file: Path, rod: rodmodel.CoreRod) -> None:
    script = f"""
import sys
from rodmodel.cli import main
status = main(["predict", "--calibration", {str(file)!r}, "--pressure-kpa", "30", "0", "0", "--json"])
assert not {{"jax", "equinox", "matplotlib", "rich", "scipy"}} & set(sys.modules)
sys.exit(status)
"""
    run = subprocess.run(
        [sys.executable, "-W", "error", "-c", script], capture_output=True, text=True, check=False
    )
    assert (run.returncode, run.stderr) == (GOOD, "")
    angle = json.loads(run.stdout)["bending_angle_deg"]
    assert math.isclose(angle, math.degrees(rod.solve([30e3, 0.0, 0.0]).bending_angle), rel_tol=1e-12)


def test_output_that_is_not_read_to_its_end_is_no_failure_to_tell_of():
    code = "import sys; from rodmodel.cli import main; sys.exit(main(['layouts']))"
    with subprocess.Popen(
        [sys.executable, "-c", code], stdout=subprocess.PIPE, stderr=subprocess.PIPE
    ) as run:
        run.stdout.close()
        assert run.stderr.read() == b""
    assert run.returncode == 141
