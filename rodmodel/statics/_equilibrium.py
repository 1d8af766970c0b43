"""Equilibrium of a rod: its differential equations, and its end condition."""

from typing import NamedTuple, final

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from rodmodel.actuator import Actuator
from rodmodel.section import CurvatureLaw
from rodmodel.statics._loads import Resultants
from rodmodel.statics._solve_3x3 import solve_3x3


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
    its frame, and c the compliance in shear, by which sections lean with the force across them,

        R' = R û,   r' = R (e₃ + c (f₁, f₂, 0)),   K u' = −u × m − (1 − c f₃) e₃ × f

    where n(s) = F + (1 − s/L) W is all that hangs on the section. At the end of the body,

        m = Rᵀ M + M_f + e₃ × Rᵀ(lever) + o × Rᵀ C

    with M the dead and M_f the follower moment, and C the force on a cap that lies aside by o. Positions
    enter no condition. A follower force R(L) F_f is a dead force P that is not known beforehand: P joins the
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
    """How far the cap lies beside the end of the body, in its frame [m]."""

    @property
    def unknowns(self) -> int:
        """How many there are."""
        return 3 if self.loads.follower_force is None else 6

    def scaled(self, fraction: Float[Array, ""]) -> "Equilibrium":
        """The same under a fraction of the loads."""
        loads = jax.tree.map(lambda load: fraction * load, self.loads)
        return Equilibrium(self.law, loads, self.actuator, self.offset)

    def base(self, unknown: Float[Array, " n"]) -> State:
        """Section at the clamp."""
        none = jnp.zeros(3, unknown.dtype)
        return State(none, jnp.eye(3, dtype=unknown.dtype), unknown[:3])

    def turn_rate(
        self, fraction: Float[Array, ""], state: State, unknown: Float[Array, " n"]
    ) -> Float[Array, "3"]:
        """Derivative of u L by s/L at the fraction s/L of the body."""
        length = self.actuator.bending_length
        u = state.turn / length
        force = self._body_force(fraction, state, unknown)
        lean = 1.0 - self.actuator.shear_compliance * force[2]
        torque = -jnp.cross(u, self.law.moment(u)) - lean * _axis_cross(force)
        return length**2 * solve_3x3(self.law.stiffness(u), torque)

    def lean(
        self, fraction: Float[Array, ""], state: State, unknown: Float[Array, " n"]
    ) -> Float[Array, "3"]:
        """What shear adds to r', body frame: c times the force across the section."""
        force = self._body_force(fraction, state, unknown)
        return self.actuator.shear_compliance * force.at[2].set(0.0)

    def imbalance(self, end: State, unknown: Float[Array, " n"]) -> Float[Array, " n"]:
        """Moment that the end of the body lacks to balance the cap [N m], body frame.

        Under a follower force, after it the force that is missing [N].
        """
        loads, back = self.loads, end.rotation.T
        pull = unknown[3:] if self.unknowns == 6 else jnp.zeros(3, unknown.dtype)
        lever, push = loads.lever + self.actuator.tip_length * pull, loads.cap_force + pull
        moment = self.law.moment(end.turn / self.actuator.bending_length)
        moment = moment - back @ loads.end_moment - loads.follower_moment
        moment = moment - _axis_cross(back @ lever) - jnp.cross(self.offset, back @ push)
        if loads.follower_force is None:
            return moment
        return jnp.concatenate([moment, back @ pull - loads.follower_force])

    def _body_force(
        self, fraction: Float[Array, ""], state: State, unknown: Float[Array, " n"]
    ) -> Float[Array, "3"]:
        """Force f on a section [N], body frame."""
        force = self.loads.end_force + (1.0 - fraction) * self.loads.body_force
        return state.rotation.T @ (force + unknown[3:] if self.unknowns == 6 else force)


def _axis_cross(v: Float[Array, "3"]) -> Float[Array, "3"]:
    """Product e₃ × v."""
    return jnp.stack([-v[1], v[0], jnp.zeros_like(v[0])])
