"""A part of the body before the cap that does not bend: a shorter rod with a longer cap."""

from dataclasses import replace

import jax.numpy as jnp
import numpy as np
import pytest

from rodmodel import FixedStep, Rod
from tests.unit.rodmodel import synthetic

# JAX compiles each of these rods; `test_core_against_reference.py` holds the C core to be the same.
pytestmark = pytest.mark.slow

TIP = 2e-3
PRESSURE = jnp.array([30e3, 10e3, 0.0])
FORCE = jnp.array([0.01, 0.02, -0.01])


def rods() -> tuple[Rod, Rod]:
    """With a stiff end, and the same put together of a shorter body and a longer cap."""
    actuator = synthetic.ACTUATOR
    shorter = replace(
        actuator,
        body_length=actuator.body_length - TIP,
        cap_length=actuator.cap_length + TIP,
    )
    stiff = replace(actuator, stiff_tip=TIP)
    both = (Rod(synthetic.bending_law(), a, synthetic.DOMAIN, 0.01) for a in (stiff, shorter))
    return next(both), next(both)


@pytest.mark.parametrize("loads", [{}, {"tip_force": FORCE}])
def test_it_is_a_shorter_rod_with_a_longer_cap(loads) -> None:
    """Without weight, of which the stiff tip has a part; the same equations, to rounding."""
    ours, put_together = rods()
    stiff = ours.solve(PRESSURE, **loads)
    other = put_together.solve(PRESSURE, **loads)
    for name in ("tip_position", "tip_rotation", "bending_angle", "bending_plane"):
        np.testing.assert_allclose(getattr(stiff, name), getattr(other, name), atol=1e-12)
    s = jnp.linspace(0.0, 0.066, 7)
    np.testing.assert_allclose(stiff.centreline(s), other.centreline(s), atol=1e-12)
    np.testing.assert_allclose(stiff.frames(s), other.frames(s), atol=1e-12)
    # Chambers go on through the stiff end, where they are as wide as without loads, which do no work on it.
    free = put_together.solve(PRESSURE).chamber_volume / put_together.actuator.body_length
    np.testing.assert_allclose(stiff.chamber_volume, other.chamber_volume + TIP * free, rtol=1e-12)


def test_the_end_is_straight_and_the_rod_is_whole() -> None:
    ours, _ = rods()
    solution = ours.solve(PRESSURE, tip_force=FORCE, solver=FixedStep(16))
    inside = solution.curvature(jnp.array([0.0, 0.06 - 1.5 * TIP, 0.06 - 0.5 * TIP]))
    assert np.all(np.abs(inside[:2]).max(axis=1) > 1.0)
    assert np.all(inside[2] == 0.0)
    end = ours.actuator.body_length + ours.actuator.cap_length
    np.testing.assert_allclose(solution.centreline(jnp.array(end)), solution.tip_position, atol=1e-15)


def test_the_weight_of_the_whole_body_is_carried() -> None:
    """The moment at the base is that of all masses about it, to the step's error of 1e-8 of the range."""
    ours, _ = rods()
    actuator, gravity = ours.actuator, jnp.array([9.81, 0.0, 0.0])
    none = jnp.zeros(3)
    rod = ours.solve(none, none, none, gravity)
    s = (np.arange(4000) + 0.5) / 4000 * actuator.body_length
    lever = np.asarray(rod.centreline(jnp.asarray(s)))[:, 2]
    body = actuator.mass_per_length * actuator.body_length * lever.mean()
    cap = actuator.body_length + 0.5 * actuator.cap_length
    moment = 9.81 * (body + actuator.cap_mass * float(rod.centreline(jnp.asarray(cap))[2]))
    found = ours.section.moment(rod.curvature(jnp.asarray(0.0)), 0.0 * PRESSURE)
    np.testing.assert_allclose(found[1], moment, rtol=1e-6)


def test_the_predictor_has_it_too() -> None:
    ours, _ = rods()
    predict = ours.predictor(loads=("tip_force",), solver=FixedStep(16))
    expected = ours.solve(PRESSURE, tip_force=FORCE, solver=FixedStep(16))
    found = predict(PRESSURE, tip_force=FORCE)
    np.testing.assert_allclose(found.tip_position, expected.tip_position, atol=1e-9)
    np.testing.assert_allclose(found.tip_rotation, expected.tip_rotation, atol=1e-7)
