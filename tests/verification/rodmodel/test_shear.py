"""Sections that shear: closed forms, orders, derivatives, and what shear does along the rod."""

import math

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from jaxtyping import Array

from rodmodel import Actuator, Adaptive, Domain, FixedStep, LinearLaw, Rod, Solution
from tests.unit.rodmodel import synthetic

# JAX compiles each of these rods; `test_core_against_reference.py` holds the C core to be the same.
pytestmark = pytest.mark.slow

EI, LENGTH, COMPLIANCE = 2e-4, 0.06, 0.3
PRESSURE = jnp.array([35e3, 20e3, 5e3])
FORCE = jnp.array([0.02, -0.03, -0.01])
GRAVITY = jnp.array([3.0, -5.0, -7.0])


def column(compliance: float) -> Rod:
    """Straight rod of linear law, without a cap and weight."""
    law = LinearLaw(jnp.diag(jnp.array([EI, EI, EI / 1.5])), jnp.zeros((3, 3)))
    actuator = Actuator(LENGTH, 0.0, 0.012, 0.0, 0.0, shear_compliance=compliance)
    return Rod(law, actuator, Domain((1e5, 1e5, 1e5), 3e5, 1.0), 0.0)


@pytest.fixture(scope="module")
def rod() -> Rod:
    plain = synthetic.rod(synthetic.ridge_law(symmetry="none"))
    return eqx.tree_at(lambda r: r.actuator.shear_compliance, plain, COMPLIANCE)


@pytest.fixture(scope="module")
def loaded(rod: Rod) -> Solution:
    return rod.solve(PRESSURE, tip_force=FORCE, gravity=GRAVITY)


def test_a_small_end_force_bends_and_shears_a_cantilever() -> None:
    """δ = F L³/3EI + c F L (Timoshenko)."""
    force = 1e-5
    tip = column(COMPLIANCE).solve([0.0, 0.0, 0.0], tip_force=[force, 0.0, 0.0]).tip_position
    expected = force * (LENGTH**3 / (3.0 * EI) + COMPLIANCE * LENGTH)
    # The next term is of the square of the slope, F L²/2EI = 9e-5.
    np.testing.assert_allclose(tip[0], expected, rtol=1e-7)


@pytest.mark.slow  # of the compiled core it is not, in `test_core_closed_forms.py`
@pytest.mark.parametrize("factor", [1.0 - 1e-3, 1.0 + 1e-3])
def test_a_column_that_shears_buckles_at_haringx_load(factor: float) -> None:
    """P (1 + c P) = π² EI/4L²; Timoshenko and Gere (1961), Theory of Elastic Stability, eq. 2-63."""
    compliance = 3.0  # it takes a third of the load off
    euler = math.pi**2 * EI / (4.0 * LENGTH**2)
    critical = (math.sqrt(1.0 + 4.0 * compliance * euler) - 1.0) / (2.0 * compliance)
    assert critical < 0.8 * euler
    rod, push = column(compliance), jnp.array([0.0, 0.0, -factor * critical])
    straight = rod.solve([0.0, 0.0, 0.0], tip_force=jnp.array([0.0, 0.0, -0.1 * critical]))
    found = rod.solve([0.0, 0.0, 0.0], tip_force=push, start=straight, throw=False)
    assert bool(found.converged)
    assert bool(found.stable) == (factor < 1.0)


def test_the_fixed_steps_are_of_order_4_and_come_to_the_adaptive_ones(rod: Rod, loaded: Solution) -> None:
    loads = {"tip_force": FORCE, "gravity": GRAVITY}
    errors = [
        float(
            jnp.linalg.norm(
                rod.solve(PRESSURE, solver=FixedStep(n, 1e-13), **loads).tip_position - loaded.tip_position
            )
        )
        for n in (8, 16, 32)
    ]
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    assert ((orders > 3.7) & (orders < 4.6)).all(), orders
    assert errors[-1] < 1e-7 * LENGTH


def test_along_the_rod_sections_lean_with_the_force_across_them(rod: Rod, loaded: Solution) -> None:
    """r' = R (e₃ + c f⊥), against differences of the centreline; m' + r' × n = 0 by the balance."""
    actuator = rod.actuator
    s = np.array([0.004, 0.021, 0.037, 0.055])
    h = 1e-5
    slope = (loaded.centreline(s + h) - loaded.centreline(s - h)) / (2.0 * h)
    frames = np.asarray(loaded.frames(s))
    weight = np.asarray(GRAVITY)
    mass = actuator.cap_mass + actuator.mass_per_length * (actuator.body_length - s)
    force = np.asarray(FORCE) + mass[:, None] * weight
    body = np.einsum("nji,nj->ni", frames, force)
    expected = np.einsum("nij,nj->ni", frames, COMPLIANCE * body * [1.0, 1.0, 0.0] + [0.0, 0.0, 1.0])
    # Differences of order 2 over 1e-5 of curves of 100 1/m: 2e-7.
    np.testing.assert_allclose(slope, expected, atol=1e-6)

    def moment(s: np.ndarray) -> np.ndarray:
        bodies = jax.vmap(rod.section.moment, (0, None))(loaded.curvature(s), PRESSURE)
        return np.einsum("nij,nj->ni", loaded.frames(s), bodies)

    change = (moment(s + h) - moment(s - h)) / (2.0 * h)
    np.testing.assert_allclose(change, -np.cross(expected, force), atol=1e-5 * np.abs(change).max())


def test_the_compliance_of_the_tip_is_symmetric_as_shear_keeps_the_energy(rod: Rod) -> None:
    _, jacobian = rod.jacobian(PRESSURE, FORCE, None, GRAVITY)
    by_force = np.asarray(jacobian.tip_force.tip_position)
    np.testing.assert_allclose(by_force, by_force.T, atol=1e-6 * np.abs(by_force).max())


def test_derivatives_are_those_of_differences(rod: Rod) -> None:
    solver = Adaptive(1e-12)

    @jax.jit
    def tip(parts: Array) -> Array:
        moved = eqx.tree_at(lambda r: r.actuator.shear_compliance, rod, COMPLIANCE * parts[0])
        pressure, force = PRESSURE * parts[1], FORCE * parts[2:5]
        found = moved.solve(
            pressure, force, follower_force=FORCE * parts[5], gravity=GRAVITY, throw=False, solver=solver
        )
        return found.tip_position

    here, h = jnp.ones(6), 1e-3
    far = [[tip(here.at[k].add(f * h)) - tip(here.at[k].add(-f * h)) for k in range(6)] for f in (1.0, 2.0)]
    differences = (8.0 * jnp.stack(far[0], axis=1) - jnp.stack(far[1], axis=1)) / (12.0 * h)
    derivative = jax.jacfwd(tip)(here)
    # Of order 4 over a step of 1e-3, of a solve to 1e-12.
    np.testing.assert_allclose(derivative, differences, atol=1e-6 * np.abs(derivative).max())


def test_the_predictor_and_its_jacobian_know_shear(rod: Rod) -> None:
    # The Jacobian is the rod's, the differences are those of its steps: the two meet with order 4.
    steps = FixedStep(32, 1e-12)
    predictor = rod.predictor(("tip_force", "gravity"), solver=steps)
    loads = {"tip_force": np.asarray(FORCE), "gravity": np.asarray(GRAVITY)}
    prediction, jacobian = predictor.jacobian(PRESSURE, **loads)
    fixed = rod.solve(PRESSURE, solver=steps, **loads)
    np.testing.assert_allclose(prediction.tip_position, fixed.tip_position, atol=1e-11)
    h = 1e-5
    columns = [
        predictor(PRESSURE, **{**loads, "tip_force": loads["tip_force"] + sign * h * axis}).tip_position
        for axis in np.eye(3)
        for sign in (1.0, -1.0)
    ]
    differences = np.stack([(columns[2 * k] - columns[2 * k + 1]) / (2.0 * h) for k in range(3)], axis=1)
    scale = np.abs(differences).max()
    np.testing.assert_allclose(jacobian.position_by_force, differences, atol=1e-6 * scale)
