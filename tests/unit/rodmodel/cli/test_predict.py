"""`rodmodel predict`: what it prints, where, and with which status."""

import json
import math
import re
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
import pytest

import rodmodel
from rodmodel.cli import main
from rodmodel.cli._predict import stopped
from rodmodel.core import Result
from tests.unit.rodmodel import calibrations

GOOD, BAD_INPUT, NO_CONVERGENCE = 0, 2, 3


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
        "snapped_by_chamber",
        "snapped_side",
        "other_branch_possible",
        "pressure_factor_to_end_of_branch",
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


def test_both_bounds_are_stated_where_the_file_has_them(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    bounded = replace(calibrations.calibration(), bound=calibrations.BOUND)
    rodmodel.save_calibration(bounded, tmp_path / "bounded.json")
    call = ["--calibration", str(tmp_path / "bounded.json"), "--json"]
    assert main(["predict", *call, "--pressure-kpa", "30", "5", "0"]) == GOOD
    answer = json.loads(capsys.readouterr().out)
    bent = math.radians(answer["bending_angle_deg"])
    angle, tip = calibrations.BOUND.at(35e3, bending_angle=bent)
    stated = answer["error_estimate"]
    assert stated == pytest.approx({"bending_angle_deg": math.degrees(angle), "tip_mm": 1e3 * tip})
    assert main(["inverse", *call, "--bending-angle-deg", "20", "--bending-plane-deg", "0"]) == GOOD
    found = json.loads(capsys.readouterr().out)
    bent = math.radians(found["bending_angle_deg"])
    angle, tip = calibrations.BOUND.at(1e3 * sum(found["pressure_kpa"]), bending_angle=bent)
    expected = {"bending_angle_deg": math.degrees(angle), "tip_mm": 1e3 * tip}
    assert found["error_estimate"] == pytest.approx(expected)
    assert main(["predict", *call[:-1], "--pressure-kpa", "30", "5", "0"]) == GOOD
    assert "cap's outer face, within 0.86 mm" in capsys.readouterr().out


def test_a_moment_beyond_the_calibration_is_said(predict: Any) -> None:
    status, out, _ = predict("--pressure-kpa", "30", "0", "0", "--tip-force-n", "0", "0.2", "0", "--json")
    record = json.loads(out)
    assert (status, record["converged"], record["in_domain"]) == (GOOD, True, False)
    assert record["error_estimate"] == {"bending_angle_deg": None, "tip_mm": None}
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
    reached = "the above is the equilibrium at 50 % of the loads and beyond the calibration"
    assert stopped(record) == f"{reached}: {why}; {remedy}"
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


def test_a_picture_is_written_beside_the_json(predict: Any, tmp_path: Path) -> None:
    picture = tmp_path / "bent.png"
    status, out, err = predict("--pressure-kpa", "30", "0", "0", "--json", "--plot", str(picture))
    assert (status, err) == (GOOD, "")
    assert json.loads(out)["converged"]
    assert picture.read_bytes().startswith(b"\x89PNG")


def test_loads_and_the_base_are_in_the_picture(
    predict: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(matplotlib.rcParams, "svg.fonttype", "none")
    picture = tmp_path / "bent.svg"
    loads = ["--tip-force-n", "0", "0.003", "0.004", "--gravity", "0", "0", "-9.81"]
    base = ["--base-position-mm", "0", "0", "100", "--base-rotation-deg", "180", "0", "0"]
    status, _, err = predict("--pressure-kpa", "30", "0", "0", *loads, *base, "--plot", str(picture))
    assert (status, err) == (GOOD, "")
    text = picture.read_text()
    for wanted in (">0.005 N<", ">gravity 9.81 m/s²<", "along the axis of the base [mm]", "30 / 0 / 0 kPa"):
        assert wanted in text


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


def test_the_limit_beside_is_told_where_it_is_passed(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    made = calibrations.calibration()
    limited = replace(made.domain, beside_share=0.5, beside_max=65e3)
    rodmodel.save_calibration(replace(made, domain=limited), tmp_path / "limited.json")
    arguments = [
        "predict",
        "--calibration",
        str(tmp_path / "limited.json"),
        "--pressure-kpa",
        "50",
        "29",
        "0",
    ]
    assert main(arguments) == GOOD
    arguments[-2] = "31"
    capsys.readouterr()
    assert main(arguments) == BAD_INPUT
    assert "100 kPa in sum, and 65 kPa in each with 0.5 of the two others" in capsys.readouterr().err
