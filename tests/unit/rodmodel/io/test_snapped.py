"""Laws of snapped branches in calibration files."""

import dataclasses
import json
import math
from pathlib import Path

import numpy as np
import pytest

import rodmodel
from rodmodel import CalibrationFileError
from rodmodel.io import SnappedLaw
from rodmodel.io.snapped import snapped_bound
from tests.unit.rodmodel import calibrations


@pytest.fixture
def file(tmp_path: Path) -> Path:
    path = tmp_path / "snapped.json"
    rodmodel.save_calibration(calibrations.with_snapped((2, 1), (1, -1)), path)
    return path


def test_a_file_gives_back_what_was_saved(file: Path) -> None:
    written, read = calibrations.with_snapped((2, 1), (1, -1)), rodmodel.read_calibration(file)
    for one, other in zip(written.snapped, read.snapped, strict=True):
        assert (one.chamber, one.side, one.domain) == (other.chamber, other.side, other.domain)
        assert (dict(one.error), dict(one.provenance)) == (other.error, other.provenance)
        np.testing.assert_array_equal(one.law.directions, other.law.directions)


def test_the_ends_of_upright_sections_are_not_those_of_a_snapped_branch(file: Path, tmp_path: Path) -> None:
    written = rodmodel.read_calibration(file)
    ends = {"base_turn": 2e-6, "base_lag": 3e-3, "base_stiffness": 2e-4, "base_growth": 0.3, "tip_draw": 7e-7}
    grown = dataclasses.replace(written, actuator=dataclasses.replace(written.actuator, **ends))
    rodmodel.save_calibration(grown, tmp_path / "grown.json")
    layout = written.layout
    branches = rodmodel.load_branches(layout.name, layout.psi, layout.pitch, tmp_path / "grown.json")
    assert branches.loading.actuator == grown.actuator
    for rod in branches.snapped.values():
        assert rod.actuator == dataclasses.replace(grown.actuator, base_growth=0.0, tip_draw=0.0)


def test_a_file_without_them_has_no_such_key(tmp_path: Path) -> None:
    path = tmp_path / "c.json"
    rodmodel.save_calibration(calibrations.calibration(), path)
    assert "snapped" not in json.loads(path.read_text())
    assert "pressure_min_pa" not in json.loads(path.read_text())["domain"]
    assert rodmodel.read_calibration(path).snapped == ()


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"chamber": 4}, r"chamber: got 4, expected 1, 2 or 3, in snapped\[0\]"),
        ({"chamber": True}, r"chamber: got True, expected 1, 2 or 3"),
        ({"side": 0}, r"side: got 0, expected 1 or -1"),
        ({"chamber": 1, "side": -1}, "snapped: got one chamber and side twice"),
        ({"domain": []}, r"domain: got \[\], expected a JSON object"),
        (
            {"error": {"actuator": {}}},
            r"error.actuator.angle_rad: got nothing, expected a number from 0 to 10",
        ),
        ({"error": {"actuator": "x"}}, r"error.actuator: got 'x', expected a JSON object, in snapped\[0\]"),
        ({"error": {"actuator": {"angle_rad": 0.1, "tip_m": -1}}}, "error.actuator.tip_m: got -1, expected"),
        ({"error": {"free_bending_angle_rad": {"worst": None}}}, "worst: got None, expected a number"),
    ],
)
def test_a_damaged_branch_is_refused_in_one_line(file: Path, change: dict, message: str) -> None:
    content = json.loads(file.read_text())
    content["snapped"][0] |= change
    file.write_text(json.dumps(content))
    with pytest.raises(CalibrationFileError, match=message):
        rodmodel.read_calibration(file)


def test_least_pressures_beyond_the_largest_are_refused(file: Path) -> None:
    content = json.loads(file.read_text())
    most = content["snapped"][0]["domain"]["pressure_max_pa"]
    content["snapped"][0]["domain"]["pressure_min_pa"] = [0.0, 2.0 * most[1], 0.0]
    file.write_text(json.dumps(content))
    with pytest.raises(CalibrationFileError, match=r"pressure_min_pa: got .*, expected at most the largest"):
        rodmodel.read_calibration(file)


def test_the_bound_is_the_largest_error_that_is_known_of_any_branch() -> None:
    """One run tells little of its own branch: its sheet's cells, or another branch's run, may say more."""
    base = calibrations.snapped_law()

    def law(angle: float, tip: float, worst: float) -> SnappedLaw:
        run = {"angle_rad": angle, "tip_m": tip, "states": 1}
        return dataclasses.replace(base, error={"actuator": run, "free_bending_angle_rad": {"worst": worst}})

    by_run = snapped_bound([law(1e-4, 1e-3, 6e-3), law(0.08, 3e-3, 1e-2)])
    assert (by_run.angle, by_run.tip) == ((0.08,), (3e-3,))
    by_cells = snapped_bound([law(1e-4, 1e-3, 6e-3)])
    assert (by_cells.angle, by_cells.tip) == ((6e-3,), (1e-3,))
    unknown = snapped_bound([dataclasses.replace(base, error={})])
    assert unknown.angle == (math.pi,)
    assert unknown.tip == ()


@pytest.mark.parametrize("value", [[], {}, 3])
def test_anything_but_a_list_of_branches_is_refused(file: Path, value: object) -> None:
    file.write_text(json.dumps({**json.loads(file.read_text()), "snapped": value}))
    with pytest.raises(CalibrationFileError, match=r"snapped: got .*, expected a list of 1 to 6 objects"):
        rodmodel.read_calibration(file)


def test_a_law_of_all_orientations_has_none(tmp_path: Path) -> None:
    both = dataclasses.replace(calibrations.oriented_calibration(), snapped=(calibrations.snapped_law(),))
    with pytest.raises(CalibrationFileError, match="snapped: got laws beside one of all orientations"):
        rodmodel.save_calibration(both, tmp_path / "c.json")
