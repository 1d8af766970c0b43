"""States of several laws' mean: loads in and just beyond the domain, slopes that are their laws' mean."""

from dataclasses import replace

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from calibration.fit import Scales, initial_law, initial_oriented
from calibration.fit.distil_mean import BEYOND, mean_states
from calibration.fit.initial_law import with_guess
from rodmodel import Domain

DOMAIN = Domain((70e3, 50e3, 40e3), 100e3, 2e-3, 1e-3)
SCALES = Scales.of(DOMAIN, 0.06, 15.5e-6)
NO_ANGLE = np.array([np.nan])


@pytest.fixture(scope="module")
def laws():
    """Two laws of small weights, stable everywhere."""
    made = [initial_law(SCALES, 4, 3, seed=seed, symmetry="none") for seed in (0, 1)]
    return [with_guess(replace(law, weights=0.3 * law.weights), DOMAIN) for law in made]


@eqx.filter_jit
def slopes(law, y):
    """Gradient and Hessian of a law's potential."""

    def potential(y):
        return law.potential(y[:3], y[3:])

    return jax.grad(potential)(y), jax.hessian(potential)(y)


def test_slopes_are_the_mean_of_the_laws_own(laws):
    states = mean_states(laws, DOMAIN, NO_ANGLE, seed=0)
    assert len(states) > 1000
    for k in (0, 17, 400):
        u, p = jnp.asarray(states.curvature[k]), jnp.asarray(states.pressure[k])
        y = jnp.concatenate([u, p])
        own = [slopes(law, y) for law in laws]
        slope, curved = (sum(each) / 2 for each in zip(*own, strict=True))
        np.testing.assert_allclose(states.gradient[k], slope, rtol=1e-9, atol=1e-18)
        # Entries of moments by curvatures are 1e8 times those of volumes by pressures.
        for rows in (slice(0, 3), slice(3, 6)):
            for columns in (slice(0, 3), slice(3, 6)):
                block = curved[rows, columns]
                tolerance = 1e-9 * float(jnp.abs(block).max())
                np.testing.assert_allclose(states.hessian[k][rows, columns], block, rtol=0, atol=tolerance)


def test_the_first_law_balances_the_moments_of_the_domain(laws):
    states = mean_states(laws[:1], DOMAIN, NO_ANGLE, seed=3)
    moment = states.moment / np.asarray(DOMAIN.moment_axes)
    size = np.linalg.norm(moment, axis=1)
    # Newton's tolerance of 1e-8 of the curvature, up to 100 1/m, by a stiffness of 1e-3 N m² at most.
    assert size.max() <= 1.0 + 1e-3
    assert 0.1 < np.mean(size < 1e-3) < 0.3
    assert states.pressure.min() >= 0.0
    reached = np.append(states.pressure.max(axis=0), states.pressure.sum(axis=1).max())
    most = np.append(DOMAIN.pressure_max, DOMAIN.pressure_sum_max)
    # Of 1 500 states some come near the farthest, and none goes beyond it.
    assert (reached > 0.99 * BEYOND * most).all()
    assert (reached <= BEYOND * most * (1.0 + 1e-12)).all()
    assert not states.held_out.any()


def test_loads_are_those_of_the_seed(laws):
    first, again, other = (mean_states(laws, DOMAIN, NO_ANGLE, seed=seed).pressure for seed in (1, 1, 2))
    np.testing.assert_array_equal(first, again)
    assert not np.array_equal(first[0], other[0])


def test_orientations_are_drawn_from_those_of_the_states():
    law = with_guess(initial_oriented(SCALES, 4, 3, seed=0), DOMAIN)
    states = mean_states([law], DOMAIN, np.array([0.1, 0.4]), seed=0)
    assert set(states.psi) == {0.1, 0.4}
