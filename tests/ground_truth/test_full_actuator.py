"""Rods against the full actuator's runs that ship."""

import numpy as np
import pytest
import xarray as xr

import rodmodel
from calibration.fit import on_loading_branch
from calibration.report import report_rods
from calibration.truth import SHIPPED, Verdict, case_of, compare_with_truth, layout_of

# The windings that have ends of their own runs; the first one's serve the others.
PAPER, WIDEST = "double-helix, pitch 3 mm, ψ = 0°", "double-helix, pitch 6 mm, ψ = 0°"
SIX = "six-helix, pitch 3 mm"


@pytest.fixture(scope="module")
def truth() -> xr.Dataset:
    return xr.load_dataset(SHIPPED, engine="h5netcdf")


@pytest.fixture(scope="module")
def verdict(truth: xr.Dataset) -> Verdict:
    return compare_with_truth(truth)


def test_compiled_rods_are_within_the_worst_that_is_asked(truth: xr.Dataset) -> None:
    """Of all windings that ship, against runs that nothing was fitted to: 2 % of the length and 3°."""
    judged = on_loading_branch(truth, truth["case"].values) & (truth["role"].values == "judge")
    count = 0
    for name in dict.fromkeys(truth["case"].values[judged]):
        layout = layout_of(case_of(name).winding)
        rod = rodmodel.load_core(layout.name, layout.psi or 0.0, layout.pitch)
        states = truth.isel(state=judged & (truth["case"].values == name))
        loads = {given: states[given].values for given in ("pressure", "tip_force", "gravity")}
        found = rod.solve_many(**loads)
        inside = (found["in_domain"] != 0) & (found["result"] == 0)
        tip = np.linalg.norm(found["tip_position"] - states["tip_position"].values, axis=1)
        angle = np.abs(found["bending_angle"] - states["bending_angle"].values)
        assert np.all(tip[inside] <= 0.02 * rod.actuator.body_length), name
        assert np.all(angle[inside] <= np.deg2rad(3.0)), name
        count += np.count_nonzero(inside)
    assert count >= 100


# Those that follow solve the differentiable rods, compiled winding by winding.
@pytest.mark.slow
def test_the_rod_is_as_near_as_the_documentation_says(verdict: Verdict) -> None:
    """Bounds of the issue's own: the rod of ψ = 0 against runs that nothing was fitted to."""
    fit, judge = report_rods(verdict, "fit"), report_rods(verdict)[PAPER]
    assert judge["judged"] >= 60
    assert set(fit) == {PAPER, WIDEST, SIX, "all"}
    assert fit["all"]["judged"] == fit["all"]["states"]
    assert judge["tip_percent"]["median"] <= 0.7
    assert judge["loaded_tip_percent"]["median"] <= 2.0
    assert judge["loaded_tip_percent"]["worst"] <= 3.5
    # If the length that the base lags by did not bend under a tip force either, a cantilever's way would be
    # 14 % less. Half of that tells the two apart.
    actuator = rodmodel.load("double-helix").actuator
    whole = actuator.body_length + actuator.cap_length
    stiffer = 1.0 - (1.0 - actuator.base_lag / whole) ** 3
    assert judge["response_percent"]["worst"] <= 50.0 * stiffer
    # What docs/notes/calibration.md tells, 1.26 and 0.34, and the rounding of it: no worse than that.
    assert judge["tip_percent"]["worst"] <= 1.31
    assert fit[PAPER]["tip_percent"]["median"] <= 0.39


@pytest.mark.slow
def test_rods_of_all_windings_are_within_the_worst_that_is_asked(verdict: Verdict) -> None:
    for name, figures in report_rods(verdict).items():
        assert figures["tip_percent"]["worst"] <= 2.0, name
        assert figures["angle_deg"]["worst"] <= 3.0, name
        assert figures["plane_deg"]["worst"] <= 2.0, name


@pytest.mark.slow
def test_the_stated_bound_covers_nine_states_in_ten(verdict: Verdict) -> None:
    """It was made of held-out cell states and of fit runs alone."""
    chosen = verdict.judged & (verdict.role == "judge")
    inside = verdict.angle_error[chosen] <= verdict.stated[chosen]
    assert 0.83 <= inside.mean() <= 0.97
