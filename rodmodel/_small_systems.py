"""Small systems of equations, within a kernel: LAPACK's would be library calls, which cannot be in one."""

import jax.numpy as jnp
from jaxtyping import Array, Float

from rodmodel._components import cross, dot, solve, triple


def solve_small(
    matrix: Float[Array, "n n"], right: Float[Array, " n"]
) -> tuple[Float[Array, " n"], Float[Array, ""]]:
    """Solution and determinant of a small system."""
    if matrix.shape[0] != 3:
        return eliminate(matrix, right)
    a, b, c = (triple(matrix[:, k]) for k in range(3))
    return jnp.stack(solve((a, b, c), triple(right))), dot(a, cross(b, c))


def eliminate(
    matrix: Float[Array, "n n"], right: Float[Array, " n"]
) -> tuple[Float[Array, " n"], Float[Array, ""]]:
    """Solution of a small system and determinant, by elimination with row pivots."""
    n = matrix.shape[0]
    rows = jnp.concatenate([matrix, right[:, None]], axis=1)
    determinant = jnp.ones((), matrix.dtype)
    for k in range(n):
        pivot = k + jnp.argmax(jnp.abs(rows[k:, k]))
        chosen, here = rows[pivot], rows[k]
        determinant = determinant * jnp.where(pivot == k, chosen[k], -chosen[k])
        is_pivot = (jnp.arange(n) == pivot)[:, None]
        rows = jnp.where(is_pivot, here, rows)
        chosen = chosen / chosen[k]
        others = rows - rows[:, k, None] * chosen
        rows = jnp.where((jnp.arange(n) == k)[:, None], chosen, others)
    return rows[:, n], determinant
