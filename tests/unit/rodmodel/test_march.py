"""Fixed steps whose number is known at run time only: as many as where it is known before."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from rodmodel._balance import Equilibrium
from rodmodel._follow import follow
from rodmodel._loads import Loads, resultants
from rodmodel._march import march
from tests.unit.rodmodel import synthetic

ROOM = 32


def equilibrium() -> Equilibrium:
    calibration = synthetic.calibration()
    law = calibration.section_law.at(jnp.array([30e3, 10e3, 2e3]))
    loads = Loads(tip_force=jnp.array([0.01, 0.02, -0.01]), gravity=jnp.array([3.0, 0.0, -9.0]))
    return Equilibrium(
        law, resultants(loads, calibration.actuator, jnp.dtype("float64")), calibration.actuator
    )


@pytest.mark.parametrize("taken", [1, 8, ROOM])
def test_steps_that_are_taken_are_those_of_a_march_of_so_many(taken: int) -> None:
    rod, unknown = equilibrium(), jnp.array([0.3, -0.5, 0.1])
    expected, imbalance = march(rod, unknown, taken)
    found, missing = jax.jit(lambda n: march(rod, unknown, ROOM, n))(jnp.array(taken))
    for few, room in zip(expected, found, strict=True):
        np.testing.assert_allclose(room[: taken + 1], few, rtol=1e-13, atol=1e-15)
        np.testing.assert_array_equal(room[taken + 1 :], 0.0)
    np.testing.assert_allclose(missing, imbalance, rtol=1e-12, atol=1e-18)


@pytest.mark.parametrize("taken", [2, 8])
def test_equilibria_of_steps_that_are_taken_are_those_of_so_many(taken: int) -> None:
    rod = equilibrium()
    expected = follow(rod, None, taken, 1e-10)
    found = jax.jit(lambda n: follow(rod, None, ROOM, 1e-10, taken=n))(jnp.array(taken))
    assert float(found.load_fraction) == float(expected.load_fraction) == 1.0
    assert bool(found.stable)
    assert bool(expected.stable)
    # Newton's method ends at 1e-10; its first guess knows the free shape at more points here.
    np.testing.assert_allclose(found.unknown, expected.unknown, atol=1e-10)
    np.testing.assert_allclose(found.nodes.turns[: taken + 1], expected.nodes.turns, atol=1e-9)
