"""Integration and interpolation of values at equally spaced points of the body."""

from functools import cache

import numpy as np

# Gregory's coefficients c₁, c₂, ….
_FACTORS = (
    1.0 / 12.0,
    1.0 / 24.0,
    19.0 / 720.0,
    3.0 / 160.0,
    863.0 / 60480.0,
    275.0 / 24192.0,
    33953.0 / 3628800.0,
    8183.0 / 1036800.0,
)
# Points of an interpolating polynomial.
_WINDOW = 9


@cache
def integral_weights(steps: int) -> np.ndarray:
    """Return the weights of `steps` + 1 points in the integral over the body, as fractions of its length.

    Gregory's rule: the trapezoidal rule, corrected by up to 8 finite differences at each end,

        ∫ f ≈ h [Σ f − (f₀ + f_n)/2] − h Σ_k c_k (∇ᵏ f_n + (−1)ᵏ Δᵏ f₀)

    References
    ----------
    Davis and Rabinowitz (1984), Methods of Numerical Integration, sec. 2.9.
    """
    weights = np.ones(steps + 1)
    weights[[0, -1]] -= 0.5
    difference = np.ones(1)  # (−1)ⁱ binomial(k, i), from the end inwards
    for factor in _FACTORS[:steps]:
        difference = np.convolve(difference, [1.0, -1.0])
        weights[: difference.size] -= factor * difference
        weights[::-1][: difference.size] -= factor * difference
    return weights / steps


@cache
def middle_matrix(steps: int) -> np.ndarray:
    """Return the matrix from values at `steps` + 1 points to values at the midpoints between them.

    Each is interpolated by the polynomial through the nine nearest points, or all where there are fewer.
    """
    size = min(_WINDOW, steps + 1)
    matrix = np.zeros((steps, steps + 1))
    for part in range(steps):
        first = int(np.clip(part + 1 - size // 2, 0, steps + 1 - size))
        points = np.arange(size) - (part + 0.5 - first)
        powers = np.vander(points, increasing=True)
        matrix[part, first : first + size] = np.linalg.inv(powers)[0]
    return matrix
