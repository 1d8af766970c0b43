"""Rotations and screws. All smooth at zero."""

from collections.abc import Callable

import jax.numpy as jnp
from jaxtyping import Array, Float

# Terms kept of the series below 1: the first one dropped is under 1/23! of the leading one.
_TERMS = 11


def cross_matrix(v: Float[Array, "3"]) -> Float[Array, "3 3"]:
    """Matrix v̂ with v̂ w = v × w."""
    x, y, z = v
    zero = jnp.zeros_like(x)
    return jnp.array([[zero, -z, y], [z, zero, -x], [-y, x, zero]])


def turn_change(rotation: Float[Array, "3 3"], change: Float[Array, "3 3"]) -> Float[Array, "3"]:
    """Small turn ω of a changed rotation, δR = ω̂ R; in the frame of R it is Rᵀ ω."""
    skew = change @ rotation.T
    skew = 0.5 * (skew - skew.T)
    return jnp.stack([skew[2, 1], skew[0, 2], skew[1, 0]])


def rotation_of(turn: Float[Array, "3"]) -> Float[Array, "3 3"]:
    """Rotation by a rotation vector w [rad], exp ŵ."""
    return screw(turn, jnp.zeros_like(turn))[1]


def screw(turn: Float[Array, "3"], shift: Float[Array, "3"]) -> tuple[Float[Array, "3"], Float[Array, "3 3"]]:
    """Position and frame at the end of a screw motion, exp of (v, ŵ) in SE(3).

        R = I + A ŵ + B ŵ²,   r = (I + B ŵ + C ŵ²) v,   x = |w|²
        A = sin√x/√x,   B = (1 − cos√x)/x,   C = (√x − sin√x)/x^(3/2)

    A rod of constant curvature u has come to exp of (s e₃, s û) at the arc length s.

    Parameters
    ----------
    turn : w [rad].
    shift : v, of any unit.

    Returns
    -------
    position : r, of the shift's unit.
    rotation : R, directors as columns.

    References
    ----------
    Murray, Li and Sastry (1994), A Mathematical Introduction to Robotic Manipulation, eqs 2.14 and 2.36.
    """
    x = turn @ turn
    skew = cross_matrix(turn)
    skew_squared = skew @ skew
    a = _series_or(x, 1, lambda x: jnp.sin(jnp.sqrt(x)) / jnp.sqrt(x))
    b = _series_or(x, 2, lambda x: (1.0 - jnp.cos(jnp.sqrt(x))) / x)
    c = _series_or(x, 3, lambda x: (jnp.sqrt(x) - jnp.sin(jnp.sqrt(x))) / (x * jnp.sqrt(x)))
    identity = jnp.eye(3, dtype=turn.dtype)
    return (identity + b * skew + c * skew_squared) @ shift, identity + a * skew + b * skew_squared


def _series_or(
    x: Float[Array, ""], first: int, closed: Callable[[Float[Array, ""]], Float[Array, ""]]
) -> Float[Array, ""]:
    """Σ (−x)ⁿ/(2n + first)! below x = 1, where the closed form cancels, and the closed form above."""
    small = x < 1.0
    y = jnp.where(small, x, 0.0)
    series = jnp.zeros_like(x)
    for n in range(_TERMS - 1, 0, -1):
        series = (1.0 + series) * -y / ((2 * n + first) * (2 * n + first - 1))
    factorial = (1.0, 2.0, 6.0)[first - 1]
    return jnp.where(small, (1.0 + series) / factorial, closed(jnp.where(small, 1.0, x)))
