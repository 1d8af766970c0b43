"""Loads on the rod, and their resultants in its equations."""

from typing import NamedTuple, final

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float

from rodmodel.actuator import Actuator

Vector = Float[Array, "3"]
# Largest angle by which the forces may shear a section: that grows with the force as long as it is small.
_SHEARED = 0.2


@final
class Loads(eqx.Module):
    """Loads in the frame of the base; None for a load that is absent.

    Attributes
    ----------
    tip_force : dead force at the centre of the cap's outer face [N].
    tip_moment : dead moment on the cap [N m].
    gravity : acceleration [m/s²].
    distributed_force : dead force along the body, per length [N/m].
    follower_force : force at the centre of the cap's outer face, in the frame of the cap [N].
    follower_moment : moment on the cap, in its frame [N m].
    """

    tip_force: Vector | None = None
    tip_moment: Vector | None = None
    gravity: Vector | None = None
    distributed_force: Vector | None = None
    follower_force: Vector | None = None
    follower_moment: Vector | None = None


class Resultants(NamedTuple):
    """Resultants of the loads at the end of the body, and of those along it.

    The force on a section is `end_force` + (1 − s/L) `body_force`, plus the follower force in the base
    frame. The moment at the end of the body is `end_moment` + d₃ × `lever` + R `follower_moment`, plus d₃ ×
    the follower force times the length of the cap. An offset R o of the cap adds R o × `cap_force` and R o ×
    the follower force.
    """

    end_force: Vector
    """Tip force and weight of the cap [N]."""
    body_force: Vector
    """Weight of the body and distributed force over its length [N]."""
    cap_force: Vector
    """Dead forces on the cap [N]."""
    lever: Vector
    """Dead forces on the cap times their distances from the end of the body [N m]."""
    end_moment: Vector
    """[N m]"""
    follower_moment: Vector
    """[N m], frame of the cap."""
    follower_force: Vector | None
    """[N], frame of the cap; None if absent, with three unknowns fewer."""


def resultants(loads: Loads, actuator: Actuator, dtype: jnp.dtype) -> Resultants:
    """Sum up the loads."""

    def or_zero(load: Vector | None) -> Vector:
        return jnp.zeros(3, dtype) if load is None else load

    force, gravity = or_zero(loads.tip_force), or_zero(loads.gravity)
    stiff, cap = actuator.stiff_tip, actuator.cap_mass * gravity
    per_length = actuator.mass_per_length * gravity + or_zero(loads.distributed_force)
    return Resultants(
        end_force=force + cap + stiff * per_length,
        cap_force=force + cap,
        body_force=actuator.bending_length * per_length,
        lever=actuator.tip_length * force
        + (stiff + 0.5 * actuator.cap_length) * cap
        + 0.5 * stiff**2 * per_length,
        end_moment=or_zero(loads.tip_moment),
        follower_moment=or_zero(loads.follower_moment),
        follower_force=loads.follower_force,
    )


def shears_little(loads: Loads, actuator: Actuator, dtype: jnp.dtype) -> Bool[Array, ""]:
    """Return whether forces shear sections by no more than the angle to which that grows with the force."""
    total = resultants(loads, actuator, dtype)
    forces = [total.end_force, total.body_force, total.follower_force]
    norms = jnp.stack([jnp.sqrt(jnp.sum(force * force)) for force in forces if force is not None])
    return jnp.asarray(actuator.shear_compliance * jnp.sum(norms) <= _SHEARED)


def into_base(loads: Loads, rotation: Float[Array, "3 3"]) -> Loads:
    """Turn loads from the world frame into that of a base; follower loads stay in the frame of the cap."""

    def turned(load: Vector | None) -> Vector | None:
        return None if load is None else rotation.T @ load

    return Loads(
        tip_force=turned(loads.tip_force),
        tip_moment=turned(loads.tip_moment),
        gravity=turned(loads.gravity),
        distributed_force=turned(loads.distributed_force),
        follower_force=loads.follower_force,
        follower_moment=loads.follower_moment,
    )
