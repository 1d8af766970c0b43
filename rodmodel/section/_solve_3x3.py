"""Closed-form solution of three equations, which is far cheaper than a factorisation."""

import jax.numpy as jnp
from jaxtyping import Array, Float


def solve_3x3(matrix: Float[Array, "3 3"], right: Float[Array, "3"]) -> Float[Array, "3"]:
    """Solve a 3 × 3 system by Cramer's rule."""
    a, b, c = matrix
    cofactors = jnp.stack([jnp.cross(b, c), jnp.cross(c, a), jnp.cross(a, b)])
    return right @ cofactors / (a @ cofactors[0])
