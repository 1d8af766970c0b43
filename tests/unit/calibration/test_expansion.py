"""The fit's closed form is the law's own potential, differentiated."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from calibration.expansion import derivatives
from rodmodel import FreeStateExpansion

HIDDEN, STATES = 7, 40


def random_law(mirror, warp):
    rng = np.random.default_rng(1)
    weights = [rng.standard_normal(shape) for shape in ((HIDDEN, 3), (HIDDEN, HIDDEN), (35, HIDDEN))]
    biases = [rng.standard_normal(n) for n in (HIDDEN, HIDDEN, 35)]
    return FreeStateExpansion(
        weights=tuple(map(jnp.asarray, weights)),
        biases=tuple(map(jnp.asarray, biases)),
        pressure_scale=3e4,
        curvature_scale=15.0,
        energy_scale=0.05,
        rest_volume=15e-6,
        pressure_warp=warp,
        mirror=mirror,
    )


@pytest.mark.parametrize("mirror", [True, False])
@pytest.mark.parametrize("warp", [None, 5e3])
def test_value_gradient_and_hessian_are_those_of_automatic_differentiation(mirror, warp):
    law = random_law(mirror, warp)
    rng = np.random.default_rng(2)
    curvature = jnp.asarray(20.0 * rng.standard_normal((STATES, 3)))
    pressure = jnp.asarray(5e4 * rng.random((STATES, 3)))

    def potential(y):
        return law.potential(y[:3], y[3:])

    y = jnp.concatenate([curvature, pressure], axis=1)
    found = jax.jit(lambda u, p: derivatives(law, u, p))(curvature, pressure)
    expected = (jax.jit(jax.vmap(f))(y) for f in (potential, jax.grad(potential), jax.hessian(potential)))
    for ours, theirs in zip(found, expected, strict=True):
        # Both sum some hundred products: rounding is measured against the largest entry of a kind.
        size = np.abs(theirs).max(axis=0)
        assert np.all(np.abs(ours - theirs) <= 1e3 * np.finfo(float).eps * size)
