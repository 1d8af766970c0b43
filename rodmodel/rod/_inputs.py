"""Conversion and checks of the inputs of a solve."""

from functools import reduce

import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float

from rodmodel.statics import Numbers

# Largest error of RᵀR − I, entry by entry: a rotation in single precision passes.
_ORTHOGONAL = 1e-5


def all_finite(values: object) -> Bool[Array, ""]:
    """Return whether all numbers of a pytree are finite."""
    finite = (jnp.all(jnp.isfinite(value)) for value in jax.tree.leaves(values))
    return reduce(jnp.logical_and, finite, jnp.array(True))


def is_rotation(matrix: Float[Array, "3 3"] | None) -> Bool[Array, ""]:
    """Return whether a matrix is a rotation; true for None."""
    if matrix is None:
        return jnp.array(True)
    near = jnp.all(jnp.abs(matrix.T @ matrix - jnp.eye(3, dtype=matrix.dtype)) < _ORTHOGONAL)
    return near & (jnp.dot(jnp.cross(matrix[0], matrix[1]), matrix[2]) > 0.0)


def vector_of(name: str, value: Numbers | None, what: str) -> Float[Array, "3"] | None:
    """Return an argument as three numbers of the default precision, or None for None.

    Raises
    ------
    ValueError
        For another value; the message names the argument and `what` it must be.
    """
    if value is None:
        return None
    try:
        vector = jnp.asarray(value, float)
    except (TypeError, ValueError) as error:
        raise ValueError(f"{name}: got {value!r}, expected three {what}") from error
    if vector.shape != (3,):
        raise ValueError(f"{name}: got shape {vector.shape}, expected (3,): three {what}")
    return vector
