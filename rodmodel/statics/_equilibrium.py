"""Equilibrium equations of a rod: the differential equations and the end condition."""

from typing import NamedTuple, final

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from rodmodel.actuator import Actuator
from rodmodel.kinematics import cross_matrix
from rodmodel.section import CurvatureLaw, solve_3x3
from rodmodel.statics._loads import Resultants


class State(NamedTuple):
    """A section of the rod; with a leading axis, sections at equal distances from base to end."""

    position: Float[Array, "*nodes 3"]
    """r/L, base frame."""
    rotation: Float[Array, "*nodes 3 3"]
    """R, directors as columns."""
    turn: Float[Array, "*nodes 3"]
    """u L, body frame."""


@final
class Equilibrium(eqx.Module):
    """Equations of a rod whose base is clamped in the base frame, along +z.

    With m = ∂Π/∂u and K = ∂²Π/∂u² in the body frame, s the arc length, f = Rᵀn the force on the section in
    its frame, and c the shear compliance,

        R' = R û,   r' = R (e₃ + c (f₁, f₂, 0)),   K u' = −u × m − (1 − c f₃) e₃ × f

    where n(s) = F + (1 − s/L) W is the sum of the forces beyond the section. At the end of the body,

        m = Rᵀ M + M_f + e₃ × Rᵀ(lever) + o × Rᵀ C

    with M the dead and M_f the follower moment, and C the force on a cap with the offset o. Positions enter
    no condition. A follower force R(L) F_f is a dead force P that is not known beforehand: P joins the
    unknowns, and R(L)ᵀ P = F_f the conditions at the end.

    The unknowns are u L at the base and, after it, P in the base frame [N].

    References
    ----------
    Antman (2005), Nonlinear Problems of Elasticity, ch. 8, for the balances of force and moment; Reissner
    (1972), Z. angew. Math. Phys. 23, 795, for the shear.
    """

    law: CurvatureLaw
    loads: Resultants
    actuator: Actuator
    offset: Float[Array, "3"]
    """Offset of the cap from the end of the body, in its frame [m]."""

    @property
    def unknowns(self) -> int:
        """Number of unknowns."""
        return 3 if self.loads.follower_force is None else 6

    def scaled(self, fraction: Float[Array, ""]) -> "Equilibrium":
        """Return the equations under a fraction of the loads."""
        loads = jax.tree.map(lambda load: fraction * load, self.loads)
        return Equilibrium(self.law, loads, self.actuator, self.offset)

    def base(self, unknown: Float[Array, " n"]) -> State:
        """Return the section at the clamp."""
        origin = jnp.zeros(3, unknown.dtype)
        return State(origin, jnp.eye(3, dtype=unknown.dtype), unknown[:3])

    def force(self, fraction: Float[Array, ""], unknown: Float[Array, " n"]) -> Float[Array, "3"]:
        """Return the force n on the section at the fraction s/L of the body [N], base frame."""
        force = self.loads.end_force + (1.0 - fraction) * self.loads.body_force
        return force + unknown[3:] if self.unknowns == 6 else force

    def turn_rate(self, force: Float[Array, "3"], turn: Float[Array, "3"]) -> Float[Array, "3"]:
        """Return the derivative of u L by s/L, from the force f [N] and u L, both in the body frame."""
        length = self.actuator.bending_length
        u = turn / length
        shear_factor = 1.0 - self.actuator.shear_compliance * force[2]
        torque = -jnp.cross(u, self.law.moment(u)) - shear_factor * _axis_cross(force)
        return length**2 * solve_3x3(self.law.stiffness(u), torque)

    def turn_rate_slopes(
        self, force: Float[Array, "3"], turn: Float[Array, "3"]
    ) -> tuple[Float[Array, "3 3"], Float[Array, "3 3"]]:
        """Return the derivatives of `turn_rate` by the force and by u L.

        K δu' = −δu × m − u × K δu − δK u' − (1 − c f₃) e₃ × δf + c δf₃ e₃ × f
        """
        length, shear = self.actuator.bending_length, self.actuator.shear_compliance
        u = turn / length
        stiffness = self.law.stiffness(u)
        slope = self.turn_rate(force, turn) / length**2
        stiffening = jax.jacfwd(lambda u: self.law.stiffness(u) @ slope)(u)
        by_curvature = cross_matrix(self.law.moment(u)) - cross_matrix(u) @ stiffness - stiffening
        axis = jnp.array([0.0, 0.0, 1.0], force.dtype)
        by_force = (shear * force[2] - 1.0) * cross_matrix(axis) + shear * jnp.outer(_axis_cross(force), axis)
        flexible = jax.vmap(solve_3x3, (None, 1), 1)(stiffness, jnp.hstack([by_force, by_curvature / length]))
        return length**2 * flexible[:, :3], length**2 * flexible[:, 3:]

    def direction(self, force: Float[Array, "3"]) -> Float[Array, "3"]:
        """Return Rᵀ r' for the force f [N]: the axis, sheared by the transverse force."""
        axis = jnp.array([0.0, 0.0, 1.0], force.dtype)
        return axis + self.actuator.shear_compliance * (force - force[2] * axis)

    def push(self, rotation: Float[Array, "3 3"], unknown: Float[Array, " n"]) -> Float[Array, "3"]:
        """Return the force on the cap [N], in its frame."""
        force = self.loads.cap_force
        return rotation.T @ (force + unknown[3:] if self.unknowns == 6 else force)

    def imbalance(self, end: State, unknown: Float[Array, " n"]) -> Float[Array, " n"]:
        """Return the residual of the end condition: the moment at the body's end [N m], body frame.

        Under a follower force, the residual of that force follows [N].
        """
        loads, into_body = self.loads, end.rotation.T
        follower = unknown[3:] if self.unknowns == 6 else jnp.zeros(3, unknown.dtype)
        lever = loads.lever + self.actuator.tip_length * follower
        moment = self.law.moment(end.turn / self.actuator.bending_length)
        moment = moment - into_body @ loads.end_moment - loads.follower_moment
        moment = moment - _axis_cross(into_body @ lever)
        moment = moment - jnp.cross(self.offset, self.push(end.rotation, unknown))
        if loads.follower_force is None:
            return moment
        return jnp.concatenate([moment, into_body @ follower - loads.follower_force])


def _axis_cross(v: Float[Array, "3"]) -> Float[Array, "3"]:
    """Return the product e₃ × v."""
    return jnp.stack([-v[1], v[0], jnp.zeros_like(v[0])])
