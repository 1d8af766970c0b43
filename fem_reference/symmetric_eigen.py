"""Eigenvalues and eigenvectors of many symmetric 3×3 matrices at once, by Jacobi's cyclic rotations.

LAPACK takes them one by one, at some microseconds each. Here every rotation is applied to all of them
together; four sweeps reach round-off, as the off-diagonal elements fall quadratically.

References
----------
Golub and Van Loan (2013), Matrix Computations, 4th ed., algorithms 8.5.1 and 8.5.2.
"""

import numpy as np
from jaxtyping import Float

_SWEEPS = 4
_PLANES = ((0, 1, 2), (0, 2, 1), (1, 2, 0))


def symmetric_eigen(
    matrix: Float[np.ndarray, "*batch 3 3"],
) -> tuple[Float[np.ndarray, "*batch 3"], Float[np.ndarray, "*batch 3 3"]]:
    """Eigenvalues, in no order, and eigenvectors as columns.

    Parameters
    ----------
    matrix : symmetric; only the upper triangle is read.
    """
    batch = matrix.shape[:-2]
    a = np.ascontiguousarray(np.moveaxis(matrix.reshape(-1, 3, 3), 0, -1))
    diagonal = [a[0, 0].copy(), a[1, 1].copy(), a[2, 2].copy()]
    # Off-diagonal element opposite to each axis.
    across = [a[1, 2].copy(), a[0, 2].copy(), a[0, 1].copy()]
    vectors = np.zeros_like(a)
    for axis in range(3):
        vectors[axis, axis] = 1.0
    for sweep in range(_SWEEPS):
        for p, q, r in _PLANES:
            element = across[r]
            if sweep > 1 and not element.any():
                continue
            # tan of the rotation that makes the element zero: the smaller root of t² + 2θt = 1.
            theta = diagonal[q] - diagonal[p]
            twice = 2.0 * element
            root = np.sqrt(theta * theta + twice * twice)
            t = twice / (theta + np.where(theta >= 0.0, root, -root) + _TINY)
            c = 1.0 / np.sqrt(1.0 + t * t)
            s = t * c
            shift = t * element
            diagonal[p] -= shift
            diagonal[q] += shift
            across[r] = np.zeros_like(element)
            x, y = across[q], across[p]
            across[q], across[p] = c * x - s * y, s * x + c * y
            x, y = vectors[:, p].copy(), vectors[:, q]
            vectors[:, p] = c * x - s * y
            vectors[:, q] = s * x + c * y
    values = np.stack(diagonal, axis=-1).reshape(*batch, 3)
    return values, np.moveaxis(vectors, -1, 0).reshape(*batch, 3, 3)


# Keeps 0/0 from a matrix that is diagonal already.
_TINY = 1e-300
