"""Parts of the body that do not bend: a rod that begins later and has a longer cap."""

from dataclasses import replace

import jax.numpy as jnp
import numpy as np
import pytest

from rodmodel import FixedStep, Rod
from tests.unit.rodmodel import synthetic

BASE, TIP = 1e-3, 2e-3
PRESSURE = jnp.array([30e3, 10e3, 0.0])
FORCE = jnp.array([0.01, 0.02, -0.01])


def rods() -> tuple[Rod, Rod]:
    """With stiff ends, and the same put together by hand."""
    calibration = synthetic.calibration()
    actuator = calibration.actuator
    shorter = replace(
        actuator,
        body_length=actuator.body_length - BASE - TIP,
        cap_length=actuator.cap_length + TIP,
    )
    stiff = replace(actuator, stiff_base=BASE, stiff_tip=TIP)
    both = (Rod(calibration.section_law, a, calibration.domain, 0.01) for a in (stiff, shorter))
    return next(both), next(both)


@pytest.mark.parametrize("loads", [{}, {"tip_force": FORCE}])
def test_it_is_a_shorter_rod_further_up_with_a_longer_cap(loads) -> None:
    """Without weight, of which the stiff tip has a part; the same equations, to rounding."""
    ours, by_hand = rods()
    at = jnp.array([0.0, 0.0, BASE])
    stiff = ours.solve(PRESSURE, **loads)
    other = by_hand.solve(PRESSURE, base_position=at, **loads)
    for name in ("tip_position", "tip_rotation", "bending_angle", "bending_plane"):
        np.testing.assert_allclose(getattr(stiff, name), getattr(other, name), atol=1e-12)
    s = jnp.linspace(BASE, 0.066, 7)
    np.testing.assert_allclose(stiff.centreline(s), other.centreline(s - BASE), atol=1e-12)
    np.testing.assert_allclose(stiff.frames(s), other.frames(s - BASE), atol=1e-12)
    # Chambers go on through the stiff ends.
    share = ours.actuator.body_length / by_hand.actuator.body_length
    np.testing.assert_allclose(stiff.chamber_volume, share * other.chamber_volume, rtol=1e-12)


def test_the_ends_are_straight_and_the_rod_is_whole() -> None:
    ours, _ = rods()
    solution = ours.solve(PRESSURE, tip_force=FORCE)
    np.testing.assert_allclose(solution.centreline(jnp.array(0.5 * BASE)), [0.0, 0.0, 0.5 * BASE], atol=1e-15)
    inside = solution.curvature(jnp.array([0.5 * BASE, 2 * BASE, 0.06 - 0.5 * TIP]))
    assert np.all(inside[0] == 0.0)
    assert np.all(inside[2] == 0.0)
    assert np.abs(inside[1]).max() > 1.0
    end = ours.actuator.body_length + ours.actuator.cap_length
    np.testing.assert_allclose(solution.centreline(jnp.array(end)), solution.tip_position, atol=1e-15)


def test_the_weight_of_the_whole_body_is_carried() -> None:
    """The moment at the base is that of all masses about it, to the step's error of 1e-8 of the range."""
    ours, _ = rods()
    actuator, gravity = ours.actuator, jnp.array([9.81, 0.0, 0.0])
    rod = ours.solve(0.0 * PRESSURE, gravity=gravity)
    carried = actuator.bending_length + actuator.stiff_tip
    s = (np.arange(4000) + 0.5) / 4000 * carried + actuator.stiff_base
    lever = np.asarray(rod.centreline(jnp.asarray(s)))[:, 2] - actuator.stiff_base
    body = actuator.mass_per_length * carried * lever.mean()
    cap = actuator.body_length + 0.5 * actuator.cap_length
    moment = 9.81 * (body + actuator.cap_mass * (float(rod.centreline(jnp.asarray(cap))[2]) - BASE))
    found = ours.section.moment(rod.curvature(jnp.asarray(actuator.stiff_base)), 0.0 * PRESSURE)
    np.testing.assert_allclose(found[1], moment, rtol=1e-6)


def test_the_predictor_has_them_too() -> None:
    ours, _ = rods()
    predict = ours.predictor(loads=("tip_force",), solver=FixedStep(16))
    expected = ours.solve(PRESSURE, tip_force=FORCE, solver=FixedStep(16))
    found = predict(PRESSURE, tip_force=FORCE)
    np.testing.assert_allclose(found.tip_position, expected.tip_position, atol=1e-9)
    np.testing.assert_allclose(found.tip_rotation, expected.tip_rotation, atol=1e-7)
