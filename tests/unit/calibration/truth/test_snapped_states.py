"""Which states after a jump are compared, and with which branch."""

import math

import numpy as np
import pytest
import xarray as xr

import rodmodel
from calibration.truth import compare_snapped, largest_errors
from calibration.truth import snapped_states as module
from rodmodel import Branch
from rodmodel.io import branches_of, find
from tests.unit.rodmodel import calibrations


@pytest.fixture
def branches(tmp_path, monkeypatch: pytest.MonkeyPatch) -> rodmodel.Branches:
    file = tmp_path / "c.json"
    rodmodel.save_calibration(calibrations.with_snapped((2, 1), (2, -1)), file)
    calibrated = find("double-helix", 0.0, 3e-3, file)
    monkeypatch.setattr(module, "serving", lambda case, _: None if case == "ring-chamber1" else calibrated)
    return branches_of(calibrated)


def truth_of(branches: rodmodel.Branches, aside: list[float], jumped: list[int], case: str) -> xr.Dataset:
    """States of chamber 2 at 60 kPa that the rod itself predicts, with bending planes of one's own [deg]."""
    pressure = np.array([0.0, 60e3, 0.0])
    solution = branches.solve(pressure, branch="snapped").solution
    count = len(aside)
    return xr.Dataset(
        {
            "case": ("state", np.array([case] * count)),
            "pressure": (("state", "chamber"), np.tile(pressure, (count, 1))),
            "tip_force": (("state", "axis"), np.zeros((count, 3))),
            "gravity": (("state", "axis"), np.zeros((count, 3))),
            "bending_angle": ("state", np.full(count, solution.bending_angle - 0.02)),
            "bending_plane": ("state", np.radians(120.0 + np.array(aside))),
            "tip_position": (("state", "axis"), np.tile(solution.tip_position, (count, 1))),
            "jumped": ("state", np.array(jumped)),
        }
    )


def test_states_from_the_first_jump_on_are_compared_on_their_own_side(branches: rodmodel.Branches) -> None:
    truth = truth_of(branches, [0.0, 12.0, -9.0], [0, 1, 0], "chamber2")
    first, second = compare_snapped(truth)
    assert (first.branch, second.branch) == (Branch(2, 1), Branch(2, -1))
    assert first.case == "chamber2"
    assert first.angle_error == pytest.approx(0.02, abs=1e-12)
    assert first.tip == pytest.approx(0.0, abs=1e-12)
    own = branches.rod(Branch(2, 1)).solve(first.pressure).bending_plane
    assert first.plane_error == pytest.approx(
        math.remainder(own - math.radians(132.0), 2.0 * math.pi), abs=1e-12
    )
    assert second.tip > 0.01
    told = largest_errors([first, second], first.layout, (2, 1), 0.06)
    assert told == {
        "angle_rad": abs(first.angle_error),
        "plane_rad": abs(first.plane_error),
        "tip_m": pytest.approx(0.0, abs=1e-12),
        "states": 1,
    }
    assert largest_errors([first, second], first.layout, (1, 1), 0.06) is None


def test_a_second_snap_and_a_winding_without_branches_are_left_out(branches: rodmodel.Branches) -> None:
    assert compare_snapped(truth_of(branches, [78.0], [1], "chamber2")) == ()
    assert compare_snapped(truth_of(branches, [12.0], [0], "chamber2")) == ()
    assert compare_snapped(truth_of(branches, [12.0], [1], "ring-chamber1")) == ()
