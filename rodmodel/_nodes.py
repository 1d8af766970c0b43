"""Functions given at equally spaced points of the body: their slopes there, and their integrals.

Between two points, the function is taken for the polynomial through the nine points nearest, or through all
where there are fewer.

References
----------
Fornberg (1988), Math. Comp. 51, 699, for difference formulas on any points.
"""

from functools import cache

import numpy as np

_WINDOW = 9


@cache
def slope_matrix(steps: int) -> np.ndarray:
    """Matrix from values at the `steps` + 1 points to slopes there, by the fraction of the body's length."""
    matrix = np.zeros((steps + 1, steps + 1))
    for point in range(steps + 1):
        window, powers = _polynomial(steps, point - 0.5)
        x = point - window.mean()
        slopes = np.arange(1, window.size) * x ** np.arange(window.size - 1)
        matrix[point, window] = steps * slopes @ powers[1:]
    return matrix


@cache
def middle_matrix(steps: int) -> np.ndarray:
    """Matrix from values at the `steps` + 1 points to values in the middle between each two."""
    matrix = np.zeros((steps, steps + 1))
    for part in range(steps):
        window, powers = _polynomial(steps, float(part))
        matrix[part, window] = (part + 0.5 - window.mean()) ** np.arange(window.size) @ powers
    return matrix


@cache
def integral_matrix(steps: int) -> np.ndarray:
    """Matrix from values at the `steps` + 1 points to integrals over the fraction of the body's length."""
    matrix = np.zeros((steps + 1, steps + 1))
    for part in range(steps):
        window, powers = _polynomial(steps, float(part))
        degree = np.arange(1, window.size + 1)
        ends = (np.array([part, part + 1.0]) - window.mean())[:, None] ** degree / degree
        matrix[part + 1] = matrix[part]
        matrix[part + 1, window] += (ends[1] - ends[0]) @ powers / steps
    return matrix


def integral_weights(steps: int) -> np.ndarray:
    """Weights of the `steps` + 1 points in the integral over the whole body, as a fraction of its length."""
    weights: np.ndarray = integral_matrix(steps)[-1]
    return weights


def _polynomial(steps: int, centre: float) -> tuple[np.ndarray, np.ndarray]:
    """Points nearest to the part of the body that starts at `centre`, and their polynomial.

    Of it, the matrix from values there to coefficients of powers of the distance from their middle, in steps.
    """
    size = min(_WINDOW, steps + 1)
    first = int(np.clip(np.ceil(centre + 0.5) - size // 2, 0, steps + 1 - size))
    window = np.arange(first, first + size)
    return window, np.linalg.inv(np.vander(window - window.mean(), increasing=True))
