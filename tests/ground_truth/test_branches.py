"""Branches against the full actuator: where it jumps, and what it is after a jump."""

import math

import numpy as np
import pytest
import xarray as xr

from calibration.truth import SHIPPED, compare_snapped
from rodmodel import load_branches

# The issue's own bars.
ANGLE, PLANE, TIP = math.radians(5.0), math.radians(8.0), 0.06
# A jump is predicted within this of the runs' own, which are some kilopascals apart [Pa].
JUMP = 3e3


@pytest.fixture(scope="module")
def truth() -> xr.Dataset:
    return xr.load_dataset(SHIPPED, engine="h5netcdf")


def test_snapped_rods_of_the_papers_winding_bend_as_far_as_the_actuator(truth: xr.Dataset) -> None:
    """At 65 kPa a little below the law's least pressure, 66 kPa."""
    states = [state for state in compare_snapped(truth) if state.layout.psi == 0.0]
    assert [state.case for state in states] == ["chamber2", "chamber3"]
    for state in states:
        assert abs(state.angle_error) <= ANGLE, state
        assert state.tip <= TIP, state


@pytest.mark.xfail(
    strict=True,
    reason="γ is 15 to 46° off, near half a turn; at ψ = 30 and 90° θ up to 8° and one tip 9.6 %",
)
def test_snapped_rods_bend_as_far_and_as_far_aside_as_the_actuator(truth: xr.Dataset) -> None:
    states = compare_snapped(truth)
    assert len(states) >= 2
    for state in states:
        assert state.in_domain, state
        assert abs(state.angle_error) <= ANGLE, state
        assert abs(state.plane_error) <= PLANE, state
        assert state.tip <= TIP, state


def test_the_loading_branch_ends_where_the_actuator_jumps(truth: xr.Dataset) -> None:
    """Of runs under one chamber at ψ = 0."""
    names = truth["case"].values
    domain = load_branches("double-helix").loading.domain
    for case in ("chamber2", "chamber3"):
        rows = np.flatnonzero(names == case)
        pressure, jumped = truth["pressure"].values[rows], truth["jumped"].values[rows] != 0
        first = int(np.argmax(jumped))
        chamber = int(np.argmax(pressure[first]))
        end = max(domain.pressure_max[chamber], domain.single_max[chamber])
        assert pressure[first - 1, chamber] - JUMP <= end <= pressure[first, chamber] + JUMP, case


def test_chamber_1_alone_bends_as_the_actuator_does_to_70_kpa(truth: xr.Dataset) -> None:
    """In its plane, on the law's own mesh: θ within the issue's own 2.5°."""
    rod = load_branches("double-helix").loading
    rows = (truth["case"].values == "chamber1") & (truth["pressure"].values[:, 0] >= 60e3)
    assert rows.sum() == 3
    for pressure, angle in zip(
        truth["pressure"].values[rows], truth["bending_angle"].values[rows], strict=True
    ):
        solution = rod.solve(pressure)
        assert solution.in_domain
        assert solution.stable
        assert abs(float(solution.bending_angle) - angle) <= math.radians(2.5)


def test_no_jump_is_predicted_where_the_actuator_stands() -> None:
    """Chamber 1 at ψ = 0 goes to 70 kPa in its plane."""
    branches = load_branches("double-helix")
    assert branches.solve([70e3, 0.0, 0.0]).branch.name == "loading"
    assert branches.solve([70e3, 0.0, 0.0]).solution.in_domain
