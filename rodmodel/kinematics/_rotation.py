"""Rotations and screw motions, all smooth at zero."""

import math

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

# Power series of A, B and C in −x, used for x < 1: the first term left out is below 1/23! of the first.
_SERIES = np.array([[1.0 / math.factorial(2 * n + first) for first in (1, 2, 3)] for n in range(11)])


def cross_matrix(v: Float[Array, "3"]) -> Float[Array, "3 3"]:
    """Return the matrix v̂ with v̂ w = v × w."""
    x, y, z = v
    zero = jnp.zeros_like(x)
    return jnp.array([[zero, -z, y], [z, zero, -x], [-y, x, zero]])


def turn_change(rotation: Float[Array, "3 3"], change: Float[Array, "3 3"]) -> Float[Array, "3"]:
    """Return the small turn ω of a change δR = ω̂ R of a rotation; in the frame of R it is Rᵀ ω."""
    skew = change @ rotation.T
    skew = 0.5 * (skew - skew.T)
    return jnp.stack([skew[2, 1], skew[0, 2], skew[1, 0]])


def rotation_of(turn: Float[Array, "3"]) -> Float[Array, "3 3"]:
    """Return the rotation exp ŵ of a rotation vector w [rad]."""
    return screw(turn, jnp.zeros_like(turn))[1]


def screw(turn: Float[Array, "3"], shift: Float[Array, "3"]) -> tuple[Float[Array, "3"], Float[Array, "3 3"]]:
    """Return position and frame at the end of a screw motion, the exponential of (v, ŵ) in SE(3).

        R = I + A ŵ + B ŵ²,   r = (I + B ŵ + C ŵ²) v,   x = |w|²
        A = sin√x/√x,   B = (1 − cos√x)/x,   C = (√x − sin√x)/x^(3/2)

    The section of a rod of constant curvature u at the arc length s is the exponential of (s e₃, s û).

    Parameters
    ----------
    turn : rotation vector w [rad].
    shift : v, in any unit.

    Returns
    -------
    position : r, in the unit of the shift.
    rotation : R, directors as columns.

    References
    ----------
    Murray, Li and Sastry (1994), A Mathematical Introduction to Robotic Manipulation, eqs 2.14 and 2.36.
    """
    x = turn @ turn
    a, b, c = _coefficients(x)
    identity, skew = jnp.eye(3, dtype=x.dtype), cross_matrix(turn)
    powers = jnp.stack([identity, skew, jnp.outer(turn, turn) - x * identity])
    one = jnp.ones_like(x)
    rotation, along = jnp.tensordot(jnp.array([[one, a, b], [one, b, c]]), powers, axes=1)
    return along @ shift, rotation


def _coefficients(x: Float[Array, ""]) -> Float[Array, "3"]:
    """Compute A, B and C, below x = 1 by their series: there the closed forms cancel."""
    small = x < 1.0
    minus = jnp.where(small, -x, 0.0)
    series = jnp.asarray(_SERIES[-1], x.dtype)
    for coefficients in _SERIES[-2::-1]:
        series = jnp.asarray(coefficients, x.dtype) + minus * series
    large = jnp.where(small, 1.0, x)
    angle = jnp.sqrt(large)
    a = jnp.sin(angle) / angle
    closed = jnp.stack([a, (1.0 - jnp.cos(angle)) / large, (1.0 - a) / large])
    return jnp.where(small, series, closed)
