"""Branches against the full actuator: where it jumps, and what it is after a jump."""

import math

import numpy as np
import pytest
import xarray as xr

from calibration.truth import SHIPPED, SnappedState, case_of, compare_snapped, layout_of
from rodmodel import load_branches

# The issue's own bars.
ANGLE, PLANE, TIP = math.radians(5.0), math.radians(8.0), 0.06
# A jump is predicted within this of the runs' own, which are some kilopascals apart [Pa].
JUMP = 3e3


@pytest.fixture(scope="module")
def truth() -> xr.Dataset:
    return xr.load_dataset(SHIPPED, engine="h5netcdf")


@pytest.fixture(scope="module")
def states(truth: xr.Dataset) -> tuple[SnappedState, ...]:
    return compare_snapped(truth)


def test_snapped_rods_bend_as_far_and_as_far_aside_as_the_actuator(states: tuple[SnappedState, ...]) -> None:
    assert len(states) >= 2
    for state in states:
        assert state.in_domain, state
        assert abs(state.angle_error) <= ANGLE, state
        assert abs(state.plane_error) <= PLANE, state
        assert state.tip <= TIP, state


def test_the_loading_branch_ends_where_the_actuator_jumps(truth: xr.Dataset) -> None:
    """Of runs under one chamber, at windings whose calibration knows what comes after."""
    names = truth["case"].values
    checked = 0
    for case in dict.fromkeys(map(str, names)):
        rows = np.flatnonzero(names == case)
        pressure, jumped = truth["pressure"].values[rows], truth["jumped"].values[rows] != 0
        layout = layout_of(case_of(case).winding)
        if layout.name != "double-helix" or layout.psi != 0.0 or layout.pitch != 3e-3 or not jumped.any():
            continue
        branches = load_branches(layout.name, layout.psi, layout.pitch)
        first = int(np.argmax(jumped))
        chamber = int(np.argmax(pressure[first]))
        end = branches.loading.domain.pressure_max[chamber]
        assert pressure[first - 1, chamber] - JUMP <= end <= pressure[first, chamber] + JUMP, case
        checked += 1
    assert checked == 2


def test_no_jump_is_predicted_where_the_actuator_stands() -> None:
    """Chamber 1 at ψ = 0 goes to 70 kPa in its plane."""
    branches = load_branches("double-helix")
    assert branches.solve([70e3, 0.0, 0.0]).branch.name == "loading"
    assert branches.solve([70e3, 0.0, 0.0]).solution.in_domain
