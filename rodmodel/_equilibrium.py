"""Equilibrium of a uniform rod under dead loads: its differential equations and its end condition."""

from typing import final

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from rodmodel._rotation import quaternion_rate, rotation_of
from rodmodel.calibration_file import Actuator
from rodmodel.section import CurvatureLaw


@final
class Loads(eqx.Module):
    """Dead loads in the world frame: force [N] and moment [N m] on the cap's outer face, gravity [m/s²].

    What is None is absent and costs nothing.
    """

    tip_force: Float[Array, "3"] | None
    tip_moment: Float[Array, "3"] | None
    gravity: Float[Array, "3"] | None


@final
class Equilibrium(eqx.Module):
    """Equations of a uniform rod whose base is clamped at the origin, along +z.

    With m = ∂Π/∂u and K = ∂²Π/∂u² in the body frame, and s the arc length,

        r' = R e₃,   R' = R û,   K u' = −u × m − e₃ × Rᵀn

    where n(s) = F + (m_c + μ (L − s)) g is the force on the section: tip force and weight of all that hangs
    on it, the rest of the body and the cap. At the end of the body, with L_c the cap's length and M the tip
    moment,

        R m = M + d₃ × (L_c F + ½ L_c m_c g)

    The state is one vector of numbers near one: r/L in the world frame, the quaternion of R, scalar first,
    and u L in the body frame, L the body's length.

    References
    ----------
    Antman (2005), Nonlinear Problems of Elasticity, ch. 8, for the balances of force and moment.
    """

    law: CurvatureLaw
    loads: Loads
    actuator: Actuator = eqx.field(static=True)

    def rate(self, fraction: Float[Array, ""], state: Float[Array, "10"]) -> Float[Array, "10"]:
        """Derivative of the state by s/L at the fraction s/L of the body."""
        length = self.actuator.body_length
        _, quaternion, turn = split(state)
        rotation = rotation_of(quaternion)
        moment = self.law.moment(turn / length)
        shear = _into_body(rotation, self._force(fraction))
        torque = -jnp.cross(turn / length, moment) - _axis_cross(shear)
        turn_rate = length**2 * solve_3x3(self.law.stiffness(turn / length), torque)
        return jnp.concatenate([rotation[:, 2], quaternion_rate(quaternion, turn), turn_rate])

    def end_imbalance(self, state: Float[Array, "10"]) -> Float[Array, "3"]:
        """Moment that the end of the body lacks to balance the cap [N m], body frame."""
        _, quaternion, turn = split(state)
        rotation = rotation_of(quaternion)
        balance = self.law.moment(turn / self.actuator.body_length)
        if self.loads.tip_moment is not None:
            balance = balance - _into_body(rotation, self.loads.tip_moment)
        return balance - _axis_cross(_into_body(rotation, self._cap_lever()))

    def _force(self, fraction: Float[Array, ""]) -> Float[Array, "3"]:
        """Force n(s) on a section [N], world frame."""
        force = jnp.zeros(3, fraction.dtype) if self.loads.tip_force is None else self.loads.tip_force
        if self.loads.gravity is not None:
            body_mass = self.actuator.mass_per_length * self.actuator.body_length
            force = force + (self.actuator.cap_mass + body_mass * (1.0 - fraction)) * self.loads.gravity
        return force

    def _cap_lever(self) -> Float[Array, "3"]:
        """Forces on the cap times their distances from its inner face, L_c F + ½ L_c m_c g [N m]."""
        length = self.actuator.cap_length
        lever = jnp.zeros(3, self.law.free_curvature.dtype)
        if self.loads.tip_force is not None:
            lever = lever + length * self.loads.tip_force
        if self.loads.gravity is not None:
            lever = lever + 0.5 * length * self.actuator.cap_mass * self.loads.gravity
        return lever


def base_state(turn: Float[Array, "3"]) -> Float[Array, "10"]:
    """State at the clamp for a curvature u L = `turn` there."""
    pose = jnp.asarray([0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0], turn.dtype)
    return jnp.concatenate([pose, turn])


def split(
    state: Float[Array, "*n 10"],
) -> tuple[Float[Array, "*n 3"], Float[Array, "*n 4"], Float[Array, "*n 3"]]:
    """r/L, quaternion and u L of a state."""
    return state[..., :3], state[..., 3:7], state[..., 7:]


def _axis_cross(v: Float[Array, "3"]) -> Float[Array, "3"]:
    """Product e₃ × v."""
    return jnp.stack([-v[1], v[0], jnp.zeros_like(v[0])])


def _into_body(rotation: Float[Array, "3 3"], v: Float[Array, "3"]) -> Float[Array, "3"]:
    """Components Rᵀv in the body frame of a vector of the world frame."""
    return jnp.sum(rotation * v[:, None], axis=0)


def solve_3x3(matrix: Float[Array, "3 3"], right: Float[Array, "3"]) -> Float[Array, "3"]:
    """Solve a 3 × 3 system by Cramer's rule, far cheaper than a factorisation at this size."""
    a, b, c = matrix
    cofactors = jnp.stack([jnp.cross(b, c), jnp.cross(c, a), jnp.cross(a, b)])
    return jnp.sum(cofactors * right[:, None], axis=0) / jnp.sum(a * cofactors[0])
