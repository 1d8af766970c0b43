"""Integration along the rod: fixed and adaptive steps, and the neighbouring solutions of either."""

from functools import partial

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from jaxtyping import Array

from rodmodel.statics import Loads
from rodmodel.statics._adaptive import integrate
from rodmodel.statics._equilibrium import Equilibrium
from rodmodel.statics._loads import resultants
from rodmodel.statics._sensitivity import by_unknowns
from rodmodel.statics._shooting import first_slope, shoot
from rodmodel.statics._steps import march
from tests.unit.rodmodel import synthetic

FORCE, GRAVITY = jnp.array([0.01, 0.02, -0.01]), jnp.array([3.0, 0.0, -9.0])
FOLLOWER = jnp.array([0.02, 0.01, 0.0])
OFFSET = jnp.array([1e-3, 2e-3, 0.0])


def equilibrium(follower_force: Array | None = None, share: float = 1.0) -> Equilibrium:
    law = synthetic.bending_law().at(jnp.array([30e3, 10e3, 2e3]))
    pull = None if follower_force is None else share * follower_force
    loads = Loads(tip_force=share * FORCE, gravity=share * GRAVITY, follower_force=pull)
    given = resultants(loads, synthetic.ACTUATOR, jnp.dtype("float64"))
    return Equilibrium(law, given, synthetic.ACTUATOR, OFFSET)


# With a follower force the curvature at the base is among the unknowns as well. Dead loads alone are compiled
# again; `test_core_against_reference.py` holds whole rods under them.
WITH_AND_WITHOUT = pytest.mark.parametrize("unknowns", [pytest.param(3, marks=pytest.mark.slow), 6])
UNKNOWNS = {3: jnp.array([0.3, -0.5, 0.1]), 6: jnp.array([0.3, -0.5, 0.1, 0.02, 0.01, -0.01])}


@WITH_AND_WITHOUT
def test_fixed_steps_come_to_the_adaptive_ones_with_order_4(unknowns: int) -> None:
    rod, unknown = equilibrium(None if unknowns == 3 else FOLLOWER), UNKNOWNS[unknowns]
    exact, kept = jax.jit(lambda x: integrate(rod, x, 8, 1e-12))(unknown)
    assert kept
    errors = []
    for steps in (8, 16, 32):
        nodes, resolved = jax.jit(lambda x, steps=steps: march(rod, x, steps))(unknown)
        assert resolved
        errors.append(max(np.abs(a[-1] - b[-1]).max() for a, b in zip(nodes, exact, strict=True)))
    np.testing.assert_allclose(np.log2(np.array(errors[:-1]) / errors[1:]), 4.0, atol=0.3)


@WITH_AND_WITHOUT
def test_neighbouring_solutions_are_derivatives_of_the_integration(unknowns: int) -> None:
    """Both are of order 4, and what they differ by is a sixteenth where the steps are half as long."""
    rod, unknown = equilibrium(None if unknowns == 3 else FOLLOWER), UNKNOWNS[unknowns]

    def imbalance(x: Array, steps: int) -> Array:
        nodes, _ = march(rod, x, steps)
        return rod.imbalance(jax.tree.map(lambda values: values[-1], nodes), x)

    apart = []
    for steps in (16, 32):
        nodes, _ = jax.jit(lambda x, steps=steps: march(rod, x, steps))(unknown)
        changes, found = jax.jit(by_unknowns)(rod, nodes, unknown)
        expected = jax.jit(jax.jacfwd(partial(imbalance, steps=steps)))(unknown)
        apart.append(np.abs(found - expected).max() / np.abs(expected).max())
        np.testing.assert_array_equal(changes.turn[0, :, :3], np.eye(3))
    assert apart[0] < 1e-4
    assert apart[1] < apart[0] / 10.0


def test_steps_that_are_too_long_for_the_rod_are_told() -> None:
    """A curvature that grows by ten radians in a step of a half is beyond it, and not beyond sixteen."""
    rod, unknown = equilibrium(), jnp.array([0.3, -8.0, 0.1])
    strong = Equilibrium(rod.law, rod.loads._replace(end_force=jnp.array([3.0, 0.0, -3.0])), *_rest(rod))
    resolved = [bool(jax.jit(lambda x, n=n: march(strong, x, n))(unknown)[1]) for n in (2, 64)]
    assert resolved == [False, True]


def _rest(rod: Equilibrium) -> tuple:
    return rod.actuator, rod.offset


@pytest.mark.slow
def test_the_first_guess_is_the_rod_under_small_loads() -> None:
    """Base curvature and follower force to first order in the loads: what is left falls with their square."""

    def left(share: float) -> float:
        rod = equilibrium(FOLLOWER, share)
        free = synthetic.ACTUATOR.body_length * rod.law.free_curvature
        solved = jax.jit(lambda: shoot(rod, None, partial(march, steps=16), 16, 1e-13))()
        assert solved.load_fraction == 1.0
        nodes, _ = march(rod.scaled(jnp.zeros(())), jnp.concatenate([free, jnp.zeros(3)]), 16)
        error = np.abs(solved.unknown - jnp.concatenate([free, jnp.zeros(3)]) - first_slope(rod, nodes))
        return float(np.max(error / np.array([1, 1, 1, *[np.linalg.norm(FOLLOWER)] * 3])))

    assert left(1e-1) / left(1e-2) == pytest.approx(100.0, rel=0.2)
