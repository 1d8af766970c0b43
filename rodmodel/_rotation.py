"""Rotations: the screw of a constant curvature, and quaternions. All smooth at zero."""

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


def rotation_of(quaternion: Float[Array, "4"]) -> Float[Array, "3 3"]:
    """Rotation matrix of a quaternion (scalar first) of any length but zero."""
    w, x, y, z = quaternion
    twice = 2.0 / (w * w + x * x + y * y + z * z)
    return jnp.array(
        [
            [1.0 - twice * (y * y + z * z), twice * (x * y - w * z), twice * (x * z + w * y)],
            [twice * (x * y + w * z), 1.0 - twice * (x * x + z * z), twice * (y * z - w * x)],
            [twice * (x * z - w * y), twice * (y * z + w * x), 1.0 - twice * (x * x + y * y)],
        ]
    )


def quaternion_rate(quaternion: Float[Array, "4"], curvature: Float[Array, "3"]) -> Float[Array, "4"]:
    """Derivative q' = ½ q ⊗ (0, u) of the quaternion of R with R' = R û, u in the body frame."""
    w, v = quaternion[0], quaternion[1:]
    scalar = -jnp.sum(v * curvature, keepdims=True)
    return 0.5 * jnp.concatenate([scalar, w * curvature + jnp.cross(v, curvature)])


def turn_of(quaternion: Float[Array, "4"], rate: Float[Array, "4 n"]) -> Float[Array, "3 n"]:
    """Infinitesimal turns θ in the body frame, δR = R θ̂, of changes of a quaternion, columns of `rate`."""
    w, v = quaternion[0], quaternion[1:]
    vector = w * rate[1:] - v[:, None] * rate[0] - cross_matrix(v) @ rate[1:]
    return 2.0 / jnp.sum(quaternion**2) * vector


def screw(
    curvature: Float[Array, "3"], arc_length: Float[Array, ""]
) -> tuple[Float[Array, "3"], Float[Array, "3 3"]]:
    """Position and frame at an arc length of a rod of constant curvature, exp(s (e₃, û)) in SE(3).

        R = I + A s û + B s² û²,   r = s (I + B s û + C s² û²) e₃,   x = s² |u|²
        A = sin√x/√x,   B = (1 − cos√x)/x,   C = (√x − sin√x)/x^(3/2)

    Parameters
    ----------
    curvature : u [1/m], body frame, the same all along.
    arc_length : s [m], from the origin, where the frame is the identity.

    Returns
    -------
    position : r(s) [m].
    rotation : R(s), directors as columns.

    References
    ----------
    Murray, Li and Sastry (1994), A Mathematical Introduction to Robotic Manipulation, eqs 2.14 and 2.36.
    """
    turn = arc_length * curvature
    x = turn @ turn
    skew = cross_matrix(turn)
    skew_squared = skew @ skew
    a = _series_or(x, 1, lambda x: jnp.sin(jnp.sqrt(x)) / jnp.sqrt(x))
    b = _series_or(x, 2, lambda x: (1.0 - jnp.cos(jnp.sqrt(x))) / x)
    c = _series_or(x, 3, lambda x: (jnp.sqrt(x) - jnp.sin(jnp.sqrt(x))) / (x * jnp.sqrt(x)))
    identity = jnp.eye(3, dtype=turn.dtype)
    rotation = identity + a * skew + b * skew_squared
    position = arc_length * (identity + b * skew + c * skew_squared)[:, 2]
    return position, rotation


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
