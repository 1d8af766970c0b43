"""The bound of a rod from few judge runs, and the bars."""

from dataclasses import replace

import numpy as np
import pytest

from calibration.from_design.judge_stage import RodErrors, bars, bound_of, summary
from calibration.from_design.near_law import near_laws
from fem_reference import Design
from rodmodel import Layout, shipped_calibrations
from tests.similar_designs import scaled

LENGTH = Design().geometry.body_length
OWN = next(c for c in shipped_calibrations() if c.layout == Layout("double-helix", 0.0, 3e-3))
NEAR = near_laws(Design())
PRESSURE = np.array([[10e3, 0.0, 0.0], [40e3, 0.0, 0.0], [0.0, 40e3, 40e3], [30e3, 0.0, 0.0]])


def errors(angle_off=(0.001, 0.01, 0.02, 0.5), tip_off=(1e-4, 3e-4, 1e-3, 0.05), **changed) -> RodErrors:
    """Three judge states and one of a fit run."""
    angle_off, tip_off = np.array(angle_off), np.array(tip_off)
    return replace(
        RodErrors(
            case=np.array(["judge-chamber1"] * 3 + ["fit-chamber1"]),
            role=np.array(["judge"] * 3 + ["fit"]),
            pressure=PRESSURE,
            judged=np.ones(4, dtype=bool),
            angle=np.array([0.1, 1.0, 2.0, 0.8]),
            rod_angle=np.array([0.1, 1.0, 2.0, 0.8]),
            angle_error=0.5 * angle_off,
            tip_error=0.5 * tip_off,
            angle_off=angle_off,
            tip_off=tip_off,
            base_moment=np.zeros(4),
        ),
        **changed,
    )


@pytest.mark.parametrize("share", [0.1, 1.0, 8.0])
def test_the_bound_holds_at_every_judge_state(share):
    """However large the errors are; those of fit runs, which the ends are fitted to, have no say."""
    found = errors(angle_off=share * np.array([0.001, 0.01, 0.02, 0.5]))
    bound, note = bound_of(found, OWN, NEAR)
    angle, tip = bound.at(PRESSURE[:3].sum(axis=1), bending_angle=found.rod_angle[:3])
    slack = 1.0 + 1e-12
    assert (found.angle_off[:3] <= slack * angle).all()
    assert (found.tip_off[:3] <= slack * tip).all()
    assert bound.largest_angle < 0.5
    assert note["judge_states"] == 3


def test_the_bound_is_never_below_the_shipped_one():
    """At errors of zero it is that, for the paper's own design at all its pressures."""
    bound, note = bound_of(errors(angle_off=np.zeros(4), tip_off=np.zeros(4)), OWN, NEAR)
    assert note["raised_by"] == {"angle": 1.0, "tip": 1.0}
    for total, bent in ((5e3, 0.1), (50e3, 1.0), (110e3, 3.0)):
        both = (one.at(total, 1e-3, bending_angle=bent) for one in (bound, OWN.bound))
        for own, shipped in zip(*both, strict=True):
            assert own >= shipped


def test_the_bound_of_a_similar_design_is_the_same_at_scaled_pressures():
    """Angles as they are, at a quarter of the pressures; tips twice as far."""
    other = near_laws(scaled(Design(), 2.0, 0.25))
    nothing = {"angle_off": np.zeros(4), "tip_off": np.zeros(4)}
    bound, _ = bound_of(errors(**nothing), OWN, NEAR)
    scaled_bound, _ = bound_of(errors(**nothing), other[0].calibration, other)
    angle, tip = bound.at(80e3, 2e-3, bending_angle=1.2)
    there = scaled_bound.at(20e3, 2e-3 * 0.25 * 8.0, bending_angle=1.2)
    assert there == pytest.approx((angle, 2.0 * tip))


def test_without_a_shipped_bound_there_is_none():
    bound, note = bound_of(errors(), OWN, ())
    assert bound is None
    assert "none" in note["method"]


def test_states_outside_of_the_domain_do_not_count():
    judged = np.array([True, True, False, True])
    found = summary(errors(judged=judged), LENGTH)
    assert (found["states"], found["judged"]) == (3, 2)
    assert found["angle_deg"]["worst"] == pytest.approx(np.rad2deg(0.005))
    assert found["tip_percent"]["median"] == pytest.approx(100.0 * 1e-4 / LENGTH)


def with_error(free):
    return replace(OWN, error={"free_bending_angle_rad": free})


def test_a_bar_is_met_or_not():
    """Held out, 1 % of the range or one degree, whichever is more; of tips 1.5 and 3 % of the length."""
    free = {"p95": np.deg2rad(1.2), "range": np.deg2rad(130.0)}
    judged = {"tip_percent": {"median": 1.4, "worst": 3.1}}
    rows = bars(with_error(free), judged)
    assert [row["met"] for row in rows] == [True, True, False]
    assert rows[0]["bar"] == pytest.approx(1.3)
    short = bars(with_error(free | {"range": np.deg2rad(90.0)}), {})
    assert [row["met"] for row in short] == [False]
