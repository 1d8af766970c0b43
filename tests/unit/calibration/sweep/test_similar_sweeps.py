"""A sweep of a similar body is the same sweep, scaled: its paths and their steps, its records and ends."""

import numpy as np
import pytest
from manufactured_cell import ManufacturedTracer

from calibration.sweep import CellTracer, LoadingPath, RunPlan, usual_end_compliance
from calibration.sweep.tracing import records_of, trace_path
from fem_reference import Design, Load
from fem_reference.geometry import Units
from rodmodel import Domain
from tests.fem_fixtures import TINY
from tests.similar_designs import scaled

LENGTH, MODULUS = 3.0, 0.25
MOMENT, AREA = MODULUS * LENGTH**3, LENGTH**2
# Rounding, and what the cell's solver leaves.
ALIKE = 1e-6


def plan_of(design: Design, pressure: float, moment: float) -> RunPlan:
    """A small plan, on a domain in these units of pressure and moment."""
    domain = Domain((60e3 * pressure,) * 3, 110e3 * pressure, 6.6e-3 * moment, 3.3e-3 * moment)
    return RunPlan(design, TINY, domain, 6, seed=0, end_compliance=usual_end_compliance(design))


@pytest.fixture(scope="module")
def plans() -> tuple[RunPlan, RunPlan]:
    return plan_of(Design(), 1.0, 1.0), plan_of(scaled(Design(), LENGTH, MODULUS), MODULUS, MOMENT)


def test_the_usual_ends_give_by_the_same_share_of_the_length(plans):
    own, other = plans
    assert own.end_compliance == 0.23e-3
    assert other.end_compliance * MODULUS * LENGTH == pytest.approx(own.end_compliance, rel=1e-14)


def test_paths_have_the_same_loads_in_their_units(plans):
    own, other = plans
    assert own.pressure_step == 8e3
    for mine, theirs in zip(own.design(), other.design(), strict=True):
        assert (mine.name, len(mine.loads)) == (theirs.name, len(theirs.loads))
        for one, two in zip(mine.loads, theirs.loads, strict=True):
            np.testing.assert_allclose(two.pressure, MODULUS * np.array(one.pressure), rtol=1e-12)
            np.testing.assert_allclose(two.moment, MOMENT * np.array(one.moment), rtol=1e-12, atol=1e-18)


def test_records_are_the_same_in_their_units(plans):
    own, other = plans
    steps = np.repeat([LENGTH, 1.0 / MODULUS], 3)
    factors = {
        "curvature": 1.0 / LENGTH,
        "energy": MODULUS * AREA,
        "volume": AREA,
        "hessian": MODULUS * AREA * np.outer(steps, steps),
    }
    found = []
    for plan, pressure, moment in ((own, 1.0, 1.0), (other, MODULUS, MOMENT)):
        loads = [Load((k * 4e3 * pressure, 0.0, 0.0), (k * 1e-4 * moment, 0.0, 0.0)) for k in (1, 2)]
        tracer = CellTracer(plan.actuator, plan.level, plan.end_compliance)
        found.append(list(records_of(tracer, LoadingPath("a", "train", tuple(loads)))))
    for mine, theirs in zip(*(records[:-1] for records in found), strict=True):
        for name, factor in factors.items():
            expected = np.array(mine[name])
            atol = ALIKE * np.abs(expected).max()
            np.testing.assert_allclose(np.array(theirs[name]) / factor, expected, rtol=0.0, atol=atol)
    assert found[0][-1] == found[1][-1] == {"end": {"attempts": 1}}


@pytest.mark.parametrize(("metre", "ends"), [(1e3, True), (3e3, False)])
def test_a_snap_is_told_by_a_change_of_curvature_in_the_bodys_own_millimetres(metre, ends):
    """A change by 5 degrees over 60 mm is one by 1.7 degrees over five diameters of 4 mm, and no snap."""
    loads = tuple(Load((p, 0.0, 0.0), (0.0,) * 3) for p in (20e3, 40e3))
    trace = ManufacturedTracer(silent_snap_beyond=30e3)()
    *_, end = trace_path(trace, LoadingPath("a", "train", loads), Units(metre=metre))
    assert ("unstable" in end["end"]) is ends
