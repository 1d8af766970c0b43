"""Derivatives of the pose by pressures and loads, along the rod if asked."""

from typing import final

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float


@final
class PoseDerivative(eqx.Module):
    """Derivative of the pose by one input of three components, which are the last axis of each array.

    Attributes
    ----------
    tip_position : of the centre of the cap's outer face [m].
    tip_turn : small turn of the cap in the world frame, δR = (turn × R) [rad].
    bending_angle, bending_plane : θ and γ [rad].
    positions, turns : of the sections at `arc_lengths`, as for the tip.
    """

    tip_position: Float[Array, "3 3"]
    tip_turn: Float[Array, "3 3"]
    bending_angle: Float[Array, "3"]
    bending_plane: Float[Array, "3"]
    positions: Float[Array, "s 3 3"]
    turns: Float[Array, "s 3 3"]


@final
class Jacobian(eqx.Module):
    """Derivatives of the pose of a rod, by input.

    Attributes
    ----------
    pressure : [1/Pa].
    tip_force : [1/N]: the compliance of the rod at its tip.
    tip_moment : [1/(N m)].
    gravity : [s²/m].
    arc_lengths : of the sections along the rod [m].
    """

    pressure: PoseDerivative
    tip_force: PoseDerivative
    tip_moment: PoseDerivative
    gravity: PoseDerivative
    arc_lengths: Float[Array, " s"]


def turn_change(rotation: Float[Array, "3 3"], change: Float[Array, "3 3 m"]) -> Float[Array, "3 m"]:
    """Turns ω with δR = ω̂ R, of changes of a rotation; in sums, so that it can be in a kernel."""
    skew = jnp.sum(change[:, None] * rotation[None, :, :, None], axis=2)
    skew = 0.5 * (skew - jnp.swapaxes(skew, 0, 1))
    return jnp.stack([skew[2, 1], skew[0, 2], skew[1, 0]])
