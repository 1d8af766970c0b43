"""The rod's equations, each against the balance of forces and moments that it is."""

from dataclasses import replace

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from rodmodel.section import CurvatureLaw
from rodmodel.statics import Loads
from rodmodel.statics._equilibrium import Equilibrium, State
from rodmodel.statics._loads import resultants
from tests.unit.rodmodel import synthetic

# Lengths and compliances that none of the equations may mistake for one another, nor for one.
ACTUATOR = replace(synthetic.ACTUATOR, stiff_tip=0.007, shear_compliance=0.8)
OFFSET = np.array([1e-3, -2e-3, 0.0])
LOADS = {
    "tip_force": np.array([0.01, 0.02, -0.03]),
    "tip_moment": np.array([3e-4, -2e-4, 5e-4]),
    "gravity": np.array([3.0, -4.0, -8.0]),
    "distributed_force": np.array([0.2, 0.1, -0.3]),
    "follower_moment": np.array([-1e-4, 4e-4, 2e-4]),
}
FOLLOWER = np.array([0.02, 0.01, -0.04])
PULL = np.array([0.05, -0.02, 0.03])
TURN = np.array([0.7, -1.1, 0.4])
FORCE = np.array([0.03, -0.05, 0.02])


@pytest.fixture(scope="module")
def law() -> CurvatureLaw:
    law = synthetic.ridge_law()
    return jax.jit(lambda pressure: law.at(pressure))(jnp.array([30e3, 10e3, 2e3]))


@pytest.fixture(params=[3, 6], ids=["dead loads", "with a follower force"])
def rod(request: pytest.FixtureRequest, law: CurvatureLaw) -> Equilibrium:
    given = LOADS | ({} if request.param == 3 else {"follower_force": FOLLOWER})
    loads = Loads(**{name: jnp.array(load) for name, load in given.items()})
    rod = Equilibrium(law, resultants(loads, ACTUATOR, jnp.dtype("float64")), ACTUATOR, jnp.array(OFFSET))
    assert rod.unknowns == request.param
    return rod


def unknown_of(rod: Equilibrium) -> np.ndarray:
    """Turn at the base, and the follower force as it stands in the base frame."""
    return np.array([0.3, -0.5, 0.1, *PULL])[: rod.unknowns]


def pull_of(rod: Equilibrium) -> np.ndarray:
    """That force; zero without a follower force."""
    return PULL if rod.unknowns == 6 else np.zeros(3)


def test_the_base_is_clamped_and_its_turn_unknown(rod: Equilibrium) -> None:
    base = rod.base(jnp.array(unknown_of(rod)))
    np.testing.assert_array_equal(base.position, np.zeros(3))
    np.testing.assert_array_equal(base.rotation, np.eye(3))
    np.testing.assert_array_equal(base.turn, unknown_of(rod)[:3])


def test_a_section_carries_all_that_hangs_on_it(rod: Equilibrium) -> None:
    """Loads on the cap, and weight and distributed force from the section to the cap."""
    per_length = ACTUATOR.mass_per_length * LOADS["gravity"] + LOADS["distributed_force"]
    at_cap = LOADS["tip_force"] + ACTUATOR.cap_mass * LOADS["gravity"] + pull_of(rod)
    for fraction in (0.0, 0.3, 1.0):
        left = ACTUATOR.body_length - fraction * ACTUATOR.bending_length
        found = rod.force(jnp.array(fraction), jnp.array(unknown_of(rod)))
        np.testing.assert_allclose(found, at_cap + left * per_length, rtol=1e-14)


def test_a_fraction_of_the_loads_is_that_fraction_of_each(rod: Equilibrium) -> None:
    less = rod.scaled(jnp.array(0.25))
    for whole, part in zip(jax.tree.leaves(rod.loads), jax.tree.leaves(less.loads), strict=True):
        np.testing.assert_allclose(part, 0.25 * whole, rtol=1e-15)
    assert less.law is rod.law
    np.testing.assert_array_equal(less.offset, OFFSET)


def test_the_axis_leans_with_the_force_across_it(rod: Equilibrium) -> None:
    expected = [0.8 * FORCE[0], 0.8 * FORCE[1], 1.0]
    np.testing.assert_allclose(rod.direction(jnp.array(FORCE)), expected, rtol=1e-15)


def test_moments_balance_along_the_rod(rod: Equilibrium) -> None:
    """(R m)' + r' × n = 0, in the frame of the section: u × m + K u' + (Rᵀ r') × f = 0."""
    length = ACTUATOR.bending_length
    u = TURN / length
    moment, stiffness = jax.jit(lambda u: (rod.law.moment(u), rod.law.stiffness(u)))(jnp.array(u))
    rate = jax.jit(lambda f, t: rod.turn_rate(f, t))(jnp.array(FORCE), jnp.array(TURN)) / length**2
    terms = np.cross(u, moment), stiffness @ rate, np.cross(rod.direction(jnp.array(FORCE)), FORCE)
    # Each of them matters, and their sum is of their rounding.
    sizes = [np.abs(term).max() for term in terms]
    assert min(sizes) > 1e-2 * max(sizes)
    np.testing.assert_allclose(sum(terms), 0.0, atol=1e-14 * max(sizes))


def test_slopes_of_the_turn_are_its_derivatives(rod: Equilibrium) -> None:
    force, turn = jnp.array(FORCE), jnp.array(TURN)
    expected = jax.jit(jax.jacfwd(lambda f, t: rod.turn_rate(f, t), (0, 1)))(force, turn)
    written = jax.jit(lambda f, t: rod.turn_rate_slopes(f, t))(force, turn)
    for found, slope in zip(written, expected, strict=True):
        np.testing.assert_allclose(found, slope, atol=1e-13 * np.abs(slope).max())


def test_the_end_lacks_the_moment_of_each_load_about_it(rod: Equilibrium) -> None:
    """Σ (x − x_end) × F of all beyond the end of the bending part, with the cap beside the body."""
    frame = np.linalg.qr(np.random.default_rng(3).normal(size=(3, 3)))[0]
    frame *= np.linalg.det(frame)
    stiff, cap, gravity = ACTUATOR.stiff_tip, ACTUATOR.cap_length, LOADS["gravity"]
    per_length = ACTUATOR.mass_per_length * gravity + LOADS["distributed_force"]
    ahead, aside = frame[:, 2], frame @ OFFSET
    moment = LOADS["tip_moment"] + frame @ LOADS["follower_moment"]
    moment = moment + np.cross((stiff + cap) * ahead + aside, LOADS["tip_force"] + pull_of(rod))
    moment = moment + np.cross((stiff + 0.5 * cap) * ahead + aside, ACTUATOR.cap_mass * gravity)
    moment = moment + np.cross(0.5 * stiff * ahead, stiff * per_length)
    own = np.asarray(rod.law.moment(jnp.array(TURN) / ACTUATOR.bending_length))
    end = State(jnp.zeros(3), jnp.array(frame), jnp.array(TURN))
    found = np.asarray(jax.jit(lambda end, x: rod.imbalance(end, x))(end, jnp.array(unknown_of(rod))))
    np.testing.assert_allclose(found[:3], own - frame.T @ moment, atol=1e-13 * np.abs(own).max())
    if rod.unknowns == 6:
        np.testing.assert_allclose(found[3:], frame.T @ pull_of(rod) - FOLLOWER, atol=1e-16)
