"""Derivatives of the solve against central differences."""

from collections.abc import Callable

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from jaxtyping import Array

from tests.unit.rodmodel import synthetic

# JAX compiles each of these rods; `test_core_against_reference.py` holds the C core to be the same.
pytestmark = pytest.mark.slow

PRESSURE = jnp.array([35e3, 20e3, 5e3])
FORCE = jnp.array([0.02, -0.03, -0.01])
MOMENT = jnp.array([3e-4, -2e-4, 5e-4])
GRAVITY = jnp.array([3.0, -5.0, -7.0])
ROD = synthetic.rod(synthetic.bending_law())


def answer(pressure: Array, *loads: Array) -> Array:
    """Tip position and directors, angle, plane and chamber volumes, in one vector of numbers near one."""
    solution = ROD.solve(pressure, *loads, throw=False)
    return jnp.concatenate(
        [
            solution.tip_position / 0.066,
            solution.tip_rotation.ravel(),
            solution.bending_angle[None],
            solution.bending_plane[None],
            solution.chamber_volume / 0.93e-6,
        ]
    )


POSITION, VOLUME = slice(0, 3), slice(14, 17)


def differences(function: Callable[[Array], Array], x: Array, step: float) -> np.ndarray:
    """Fourth-order central differences."""
    columns = []
    for e in step * np.eye(3):
        near, far = function(x + e) - function(x - e), function(x + 2 * e) - function(x - 2 * e)
        columns.append((8 * near - far) / (12 * step))
    return np.stack(columns, axis=-1)


ARGUMENTS = (PRESSURE, FORCE, MOMENT, GRAVITY)


EACH = (0, 1, 2, 3)
FORWARD = jax.jit(jax.jacfwd(answer, argnums=EACH))


@pytest.fixture(scope="module")
def forward() -> tuple[Array, ...]:
    """By pressure and each load."""
    return FORWARD(*ARGUMENTS)


# Steps of 1e-3 of each range: the differences err by 1e-12 of the derivative for the step. States err by
# 1e-9, of which all cancels but what jumps with the number of steps: 1e-6 of the derivative at the worst.
@pytest.mark.parametrize(("which", "step"), [(0, 70.0), (1, 1e-4), (2, 5e-6), (3, 1e-2)])
def test_derivatives_by_pressures_and_loads(forward: tuple[Array, ...], which: int, step: float) -> None:
    solve = jax.jit(answer)

    def moved(x: Array) -> Array:
        return solve(*ARGUMENTS[:which], x, *ARGUMENTS[which + 1 :])

    expected = differences(moved, ARGUMENTS[which], step)
    np.testing.assert_allclose(forward[which], expected, atol=1e-6 * np.abs(expected).max())


def test_forward_and_reverse_mode_agree(forward: tuple[Array, ...]) -> None:
    """The reverse one in a batch; without loads `test_derivatives_of_free_bending` has both modes."""
    batch = [jnp.stack([argument, 0.3 * argument]) for argument in ARGUMENTS]
    reverse = jax.jit(jax.vmap(jax.jacrev(answer, argnums=EACH)))(*batch)
    for one, other in zip(forward, reverse, strict=True):
        np.testing.assert_allclose(one, other[0], atol=1e-9 * np.abs(one).max())


def test_work_is_conserved() -> None:
    """∂r/∂F is symmetric, and ∂V/∂F = (∂r/∂p)ᵀ, r the tip: they are second derivatives of one energy.

    Here without a moment at the tip, which has none. Both sides err by what the states do, 1e-8.
    """
    by_pressure, by_force, *_ = FORWARD(PRESSURE, FORCE, jnp.zeros(3), jnp.zeros(3))
    tip_by_force = 0.066 * by_force[POSITION]
    np.testing.assert_allclose(tip_by_force, tip_by_force.T, atol=1e-7 * np.abs(tip_by_force).max())
    tip_by_pressure, volume_by_force = 0.066 * by_pressure[POSITION], 0.93e-6 * by_force[VOLUME]
    np.testing.assert_allclose(volume_by_force, tip_by_pressure.T, atol=1e-7 * np.abs(volume_by_force).max())


def test_derivatives_of_free_bending() -> None:
    solve = jax.jit(answer)
    expected = differences(solve, PRESSURE, 70.0)
    for mode in (jax.jacfwd, jax.jacrev):
        found = jax.jit(mode(answer))(PRESSURE)
        np.testing.assert_allclose(found, expected, atol=1e-9 * np.abs(expected).max())


def test_second_derivatives_are_those_of_the_first() -> None:
    """Forward over reverse, of the tip's height by the force."""

    def height(force: Array) -> Array:
        return ROD.solve(PRESSURE, force, throw=False).tip_position[2]

    gradient = jax.jit(jax.grad(height))
    expected = differences(gradient, FORCE, 1e-4)
    hessian = jax.jit(jax.jacfwd(jax.grad(height)))(FORCE)
    np.testing.assert_allclose(hessian, expected, atol=1e-6 * np.abs(expected).max())
