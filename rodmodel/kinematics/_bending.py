"""Bending angle and bending plane of a rod, from the tangents along it."""

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

# Rounding of the azimuth in units of the machine epsilon, for a rod that bends in its plane of symmetry: its
# free curvature comes from an iteration.
_ROUNDINGS = 4096
# sin² of the tip's polar angle below which the bend is computed from its series.
_FLAT = 1e-8


def bending(
    tangents: Float[Array, "n 3"], chord: Float[Array, "3"]
) -> tuple[Float[Array, ""], Float[Array, ""]]:
    """Return bending angle θ and bending plane γ of the tip.

    θ is the polar angle of the tip's tangent t from +z, and γ the azimuth opposite to t: chamber 1 alone
    bends the tip towards −x and has γ = 0. Past 180° t leans back over the base: θ is continued, and γ stays
    on the side to which the rod bent. The half turn of the tip is counted from the angle of t in the vertical
    plane through the chord, along the rod; where a rod that is not planar crosses 180°, θ jumps by twice the
    angle by which t misses −z.

    Parameters
    ----------
    tangents : unit tangents along the rod, base (+z) to tip, less than 180° between neighbours.
    chord : vector from the base to the end of the body.

    Returns
    -------
    angle : θ [rad], zero or positive.
    plane : γ [rad], in [0, 2π); 0 for a straight rod.

    Both derivatives are zero, not undefined, where the tip's tangent is vertical.

    References
    ----------
    "Modeling of a two-degree-of-freedom fiber-reinforced soft pneumatic actuator", Robotica (2023), eqs 1-4,
    with two-argument arctangents.
    """
    half_turns = _half_turns(jax.lax.stop_gradient(tangents), jax.lax.stop_gradient(chord))
    x, y, z = tangents[-1]
    horizontal_squared = x * x + y * y
    vertical = horizontal_squared == 0.0
    horizontal = jnp.where(vertical, 0.0, jnp.sqrt(jnp.where(vertical, 1.0, horizontal_squared)))
    polar = jnp.arctan2(horizontal, z)
    back = half_turns % 2.0 == 1.0
    angle = jnp.pi * half_turns + jnp.where(back, jnp.pi - polar, polar)
    # Subtracted, not negated: y = 0 then gives +0, and the azimuth +0 or π.
    ahead_x, ahead_y = jnp.where(back, x, 0.0 - x), jnp.where(back, y, 0.0 - y)
    azimuth = jnp.arctan2(jnp.where(vertical, 0.0, ahead_y), jnp.where(vertical, 1.0, ahead_x))
    # An azimuth a few roundings below zero becomes zero, not 2π; the derivative stays that of the azimuth.
    rounding = azimuth > -_ROUNDINGS * jnp.finfo(azimuth.dtype).eps
    below = jnp.minimum(jax.lax.stop_gradient(azimuth), 0.0)
    return angle, jnp.where(rounding, azimuth - below, azimuth + 2.0 * jnp.pi)


def bend(tangent: Float[Array, "3"], angle: Float[Array, ""]) -> Float[Array, "2"]:
    """Return the bend vector (θ cos γ, θ sin γ) [rad], which is smooth also where the rod is straight.

    θ = arctan(h/t_z), h² = t_x² + t_y², and θ (cos γ, sin γ) is −(t_x, t_y) θ/h.

    Parameters
    ----------
    tangent : tangent t of the tip.
    angle : θ from `bending` [rad], which fixes the half turn.
    """
    ahead, up = -tangent[:2], tangent[2]
    size = jnp.sum(ahead**2)
    straight = (size < _FLAT) & (angle < 1.0)
    near = ahead / jnp.where(straight, up, 1.0) * (1.0 - size / 3.0)
    # Past a half turn θ grows as the tangent comes up again, on the other side.
    half_turns = jax.lax.stop_gradient(jnp.floor(angle / jnp.pi))
    back = half_turns % 2.0 == 1.0
    vertical = size == 0.0
    sine = jnp.sqrt(jnp.where(straight | vertical, 1.0, size))
    polar = jnp.arctan2(sine, up)
    theta = jnp.pi * half_turns + jnp.where(back, jnp.pi - polar, polar)
    away = jnp.where(back, -theta, theta) * ahead / sine
    # A tangent that points straight down has no azimuth: γ is zero.
    down = jax.lax.stop_gradient(angle) * jnp.array([1.0, 0.0], tangent.dtype)
    return jnp.where(straight, near, jnp.where(vertical, down, away))


def _half_turns(tangents: Float[Array, "n 3"], chord: Float[Array, "3"]) -> Float[Array, ""]:
    """Count the whole half turns of the tangent in the vertical plane through the chord."""
    forward = jax.vmap(jnp.dot, in_axes=(0, None))(tangents[:, :2], chord[:2])
    length = jnp.hypot(chord[0], chord[1])
    forward = forward / jnp.where(length > 0.0, length, 1.0)
    turns = jnp.diff(jnp.arctan2(forward, tangents[:, 2])) / np.pi
    return jnp.floor(jnp.abs(jnp.sum(turns - 2.0 * jnp.round(0.5 * turns))))
