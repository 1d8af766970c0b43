"""Gregory's rule, and values between equally spaced points: exact for polynomials."""

import numpy as np
import pytest
from numpy.polynomial import Polynomial

from rodmodel.kinematics import integral_weights, middle_matrix


def polynomial(degree: int) -> Polynomial:
    return Polynomial(np.random.default_rng(degree).normal(size=degree + 1))


@pytest.mark.parametrize("steps", [1, 2, 3, 5, 8, 9, 16, 40])
def test_weights_are_exact_for_polynomials(steps: int) -> None:
    """With m differences, of degree m, and of m + 1 where that is odd: its error term is symmetric."""
    differences = min(steps, 8)
    weights, s = integral_weights(steps), np.linspace(0.0, 1.0, steps + 1)
    np.testing.assert_allclose(weights, weights[::-1], rtol=1e-12)
    for degree in range(differences + 1 + differences % 2):
        if degree > differences and degree % 2 == 0:
            continue
        exact = polynomial(degree).integ()(1.0)
        np.testing.assert_allclose(weights @ polynomial(degree)(s), exact, atol=1e-13)


def test_weights_are_no_better_than_their_degree() -> None:
    s = np.linspace(0.0, 1.0, 5)
    assert abs(integral_weights(4) @ s**6 - 1.0 / 7.0) > 1e-5


@pytest.mark.parametrize("steps", [1, 2, 5, 8, 12])
def test_middles_are_exact_for_polynomials(steps: int) -> None:
    """Of degree 8, or as many as there are steps."""
    s = np.linspace(0.0, 1.0, steps + 1)
    for degree in range(min(steps, 8) + 1):
        expected = polynomial(degree)(0.5 * (s[:-1] + s[1:]))
        np.testing.assert_allclose(middle_matrix(steps) @ polynomial(degree)(s), expected, atol=1e-12)
