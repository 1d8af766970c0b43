"""Eigenvalues and eigenvectors of many symmetric 3×3 matrices at once, by Jacobi's cyclic rotations.

LAPACK takes some microseconds for each matrix. Here every rotation is applied to all matrices at once; four
sweeps reach round-off, because the off-diagonal elements fall quadratically.

References
----------
Golub and Van Loan (2013), Matrix Computations, 4th ed., algorithms 8.5.1 and 8.5.2.
"""

import jax
import jax.numpy as jnp
from jax import Array
from jaxtyping import Float

_SWEEPS = 4
_PLANES = ((0, 1, 2), (0, 2, 1), (1, 2, 0))
# Avoids 0/0 for a diagonal matrix.
_TINY = 1e-300


def symmetric_eigen(
    matrix: Float[Array, "3 3 *batch"],
) -> tuple[Float[Array, "3 *batch"], Float[Array, "3 3 *batch"]]:
    """Return eigenvalues, in no order, and eigenvectors as columns.

    Parameters
    ----------
    matrix : symmetric matrices in double precision (`jax.enable_x64`); only the upper triangle is read.
    """
    diagonal = [matrix[i, i] for i in range(3)]
    # Off-diagonal elements, each in the plane normal to its axis.
    across = [matrix[1, 2], matrix[0, 2], matrix[0, 1]]
    vectors = [[jnp.full_like(diagonal[0], float(i == j)) for j in range(3)] for i in range(3)]
    start = (jnp.stack(diagonal), jnp.stack(across), jnp.stack([jnp.stack(row) for row in vectors]))
    values, _, axes = jax.lax.fori_loop(0, _SWEEPS, lambda _, state: _sweep(state), start)
    return values, axes


def _sweep(state: tuple[Array, Array, Array]) -> tuple[Array, Array, Array]:
    """Rotate once in each of the three planes."""
    diagonal, across = list(state[0]), list(state[1])
    vectors = [list(row) for row in state[2]]
    for p, q, r in _PLANES:
        element = across[r]
        # tan of the rotation that makes the element zero: the smaller root of t² + 2θt = 1.
        theta = diagonal[q] - diagonal[p]
        twice = 2.0 * element
        root = jnp.sqrt(theta * theta + twice * twice)
        t = twice / (theta + jnp.where(theta >= 0.0, root, -root) + _TINY)
        c = 1.0 / jnp.sqrt(1.0 + t * t)
        s = t * c
        shift = t * element
        diagonal[p] = diagonal[p] - shift
        diagonal[q] = diagonal[q] + shift
        across[r] = jnp.zeros_like(element)
        across[q], across[p] = c * across[q] - s * across[p], s * across[q] + c * across[p]
        for row in vectors:
            row[p], row[q] = c * row[p] - s * row[q], s * row[p] + c * row[q]
    return jnp.stack(diagonal), jnp.stack(across), jnp.stack([jnp.stack(row) for row in vectors])
