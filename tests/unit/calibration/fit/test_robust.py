"""A few states that no law reaches do not pull a robust fit away from the others."""

from dataclasses import replace

import jax.numpy as jnp
import numpy as np
import pytest
from manufactured_law import Manufactured

from calibration.fit import fit, mean_square
from calibration.fit.robust import robust_fit, weights_of
from calibration.fit.samples import metric

LENGTH, MOMENT_MAX = 0.06, 2e-3

# The moment of every tenth state is off by this [N m].
WRONG = np.array([0.0, MOMENT_MAX, 0.0])


def scales_of(samples):
    return metric(samples, LENGTH, 3e3, MOMENT_MAX / 3)


def loss_of(law, samples):
    return mean_square(law, samples, scales_of(samples))


@pytest.fixture
def spoilt(some):
    gradient = some.gradient.copy()
    gradient[::10, :3] += WRONG
    return replace(some, gradient=gradient)


@pytest.fixture(scope="module")
def some(samples):
    return samples.where(np.arange(len(samples)) % 10 == 0)


def test_a_state_counts_by_less_the_farther_it_is_beyond_two_degrees():
    residual = np.array([[0.1, 0.0], [0.0, 2.0], [3.0, 4.0], [0.0, 0.0], [0.0, 20.0]])
    np.testing.assert_allclose(weights_of(residual), [1.0, 1.0, 0.4, 1.0, 0.1])


def test_wrong_states_pull_least_squares_away_and_a_robust_fit_hardly(some, spoilt):
    """Least squares errs by a tenth of what they are off, some 40 degrees.

    At a weight of 1 in 20 they are left with a two-hundredth; softer states, which weigh more, with at most
    a few times that. The loss is quadratic in the error.
    """
    start = Manufactured(jnp.zeros(3))
    plain = fit(start, spoilt, scales_of(spoilt), 40).law
    robust = robust_fit(start, spoilt, scales_of(spoilt), 40)
    off = [float(np.abs(law.offset).max()) / np.abs(WRONG).max() for law in (plain, robust.law)]
    assert 0.03 < off[0] < 0.3
    assert off[1] < 0.02
    assert loss_of(robust.law, some) < (0.02 / off[0]) ** 2 * loss_of(plain, some)
    assert robust.converged


def test_the_prior_stays_about_the_same_law_in_all_rounds(some):
    law = Manufactured(jnp.array([0.0, 1e-5, 0.0]))
    found = robust_fit(law, some, scales_of(some), 10, prior=1e20, near=law)
    np.testing.assert_allclose(found.law.offset, law.offset, rtol=1e-6, atol=1e-12)
