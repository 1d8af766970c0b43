"""Equilibrium of a rod: its differential equations, its end condition, and both linearised."""

from typing import NamedTuple, final

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from rodmodel._components import (
    Quaternion,
    Scalar,
    Triple,
    apply,
    axis_cross,
    combine,
    contract,
    cross,
    into_body,
    inverse,
    out_of_body,
    triple,
)
from rodmodel._ends import is_zero
from rodmodel._loads import Resultants
from rodmodel.calibration_file import Actuator, Number
from rodmodel.section import CurvatureLaw


class State(NamedTuple):
    """Section of the rod: the quaternion of its frame, and its curvature times the body's length, u L."""

    quaternion: Quaternion
    turn: Triple


class Variation(NamedTuple):
    """Small change of a section: a turn of its frame and a change of u L, both in the body frame."""

    rotation: Triple
    turn: Triple


@final
class Equilibrium(eqx.Module):
    """Equations of a rod whose base is clamped in the base frame, along +z.

    With m = ∂Π/∂u and K = ∂²Π/∂u² in the body frame, and s the arc length,

        R' = R û,   K u' = −u × m − e₃ × Rᵀn

    where n(s) = F + (1 − s/L) W is the force on the section: all that hangs on it. At the end of the body,

        m = Rᵀ M + M_f + e₃ × Rᵀ(lever) + o × Rᵀ C

    with M the dead and M_f the follower moment, and C the force on a cap that lies aside by o.

    Where sections shear, with f = Rᵀn and c the compliance, r' = R (e₃ + Γ), Γ = c (f₁, f₂, 0), so that the
    force turns the section by r' × n = R (1 − c f₃) e₃ × f. Positions enter no condition. A follower
    force R(L) F_f is a dead force P that is not known beforehand: P joins the unknowns, and R(L)ᵀ P = F_f
    the conditions at the end.

    References
    ----------
    Antman (2005), Nonlinear Problems of Elasticity, ch. 8, for the balances of force and moment; Reissner
    (1972), Z. angew. Math. Phys. 23, 795, for the shear.
    """

    law: CurvatureLaw
    loads: Resultants
    actuator: Actuator
    offset: Float[Array, "3"] | None = None
    """How far the cap lies beside the end of the body, in its frame [m]."""

    @property
    def unknowns(self) -> int:
        """How many there are: u L at the base, and the follower force in the base frame."""
        return 3 if self.loads.follower_force is None else 6

    @property
    def shear(self) -> Number | None:
        """Compliance of the sections in shear [1/N]; None where they do not shear."""
        return None if is_zero(self.actuator.shear_compliance) else self.actuator.shear_compliance

    def drift(self, fraction: Scalar, quaternion: Quaternion, follower: Triple | None) -> Triple:
        """What shear adds to r', base frame: c times the force across the section."""
        force = into_body(quaternion, self._force(fraction, follower))
        across = out_of_body(quaternion, (force[0], force[1], jnp.zeros_like(force[2])))
        return combine((self.actuator.shear_compliance, across))

    @eqx.filter_jit
    def turn_rate(self, fraction: Scalar, state: State, follower: Triple | None) -> Triple:
        """Derivative of u L by s/L at the fraction s/L of the body, under a follower force [N]."""
        u = self._curvature(state.turn)
        moment, stiffness = self.law.linearise(u)
        force = into_body(state.quaternion, self._force(fraction, follower))
        torque = _torque(moment, u, force, self.shear)
        return combine((self.actuator.bending_length**2, apply(inverse(stiffness), torque)))

    @eqx.filter_jit
    def linearised_rate(
        self,
        fraction: Scalar,
        state: State,
        follower: Triple | None,
        variations: list[Variation],
        follower_variations: list[Triple | None],
    ) -> tuple[Triple, list[Variation]]:
        """Derivative of u L by s/L, and those of neighbouring solutions.

        δθ' = δu − u × δθ,   K δu' = −δu × m − u × K δu − e₃ × (Rᵀn × δθ + Rᵀδn) − δK u'
        """
        length = self.actuator.bending_length
        u = self._curvature(state.turn)
        section = self.law.expand(u)
        force = into_body(state.quaternion, self._force(fraction, follower))
        flexibility = inverse(section.stiffness)
        slope = apply(flexibility, _torque(section.moment, u, force, self.shear))
        stiffening = None if section.third is None else contract(section.third, slope)
        rates = []
        for variation, follower_variation in zip(variations, follower_variations, strict=True):
            du = combine((1.0 / length, variation.turn))
            dforce = cross(force, variation.rotation)
            if follower_variation is not None:
                dforce = combine((1.0, dforce), (1.0, into_body(state.quaternion, follower_variation)))
            dtorque = combine(
                (-1.0, cross(du, section.moment)),
                (-1.0, cross(u, apply(section.stiffness, du))),
                (-1.0, axis_cross(dforce)),
            )
            if self.shear is not None:
                softer, more = self.shear * force[2], self.shear * dforce[2]
                dtorque = combine((1.0, dtorque), (softer, axis_cross(dforce)), (more, axis_cross(force)))
            if stiffening is not None:
                dtorque = combine((1.0, dtorque), (-1.0, apply(stiffening, du)))
            rates.append(
                Variation(
                    combine((1.0, variation.turn), (-1.0, cross(state.turn, variation.rotation))),
                    combine((length**2, apply(flexibility, dtorque))),
                )
            )
        return (combine((length**2, slope)), rates)

    def end_imbalance(self, state: State, follower: Triple | None) -> tuple[Triple, ...]:
        """Moment that the end of the body lacks to balance the cap [N m], body frame.

        Under a follower force, after it the force that is missing [N].
        """
        return self._imbalance(state, follower, [], [])[0]

    def linearised_imbalance(
        self,
        state: State,
        follower: Triple | None,
        variations: list[Variation],
        follower_variations: list[Triple | None],
    ) -> tuple[tuple[Triple, ...], list[tuple[Triple, ...]]]:
        """Imbalance at the end, and how it changes with each variation."""
        return self._imbalance(state, follower, variations, follower_variations)

    def _imbalance(
        self,
        state: State,
        follower: Triple | None,
        variations: list[Variation],
        follower_variations: list[Triple | None],
    ) -> tuple[tuple[Triple, ...], list[tuple[Triple, ...]]]:
        length, cap, loads = self.actuator.bending_length, self.actuator.tip_length, self.loads
        q = state.quaternion
        inner, stiffness = self.law.linearise(self._curvature(state.turn))
        moment = into_body(q, triple(loads.end_moment))
        lever = into_body(q, triple(loads.lever))
        missing: tuple[Triple, ...] = ()
        pulled = None
        if follower is not None and loads.follower_force is not None:
            pulled = into_body(q, follower)
            lever = combine((1.0, lever), (cap, pulled))
            missing = (combine((1.0, pulled), (-1.0, triple(loads.follower_force))),)
        balance = combine(
            (1.0, inner),
            (-1.0, moment),
            (-1.0, triple(loads.follower_moment)),
            (-1.0, axis_cross(lever)),
        )
        offset, push = None, None
        if self.offset is not None:
            offset, push = triple(self.offset), into_body(q, triple(loads.cap_force))
            push = push if pulled is None else combine((1.0, push), (1.0, pulled))
            balance = combine((1.0, balance), (-1.0, cross(offset, push)))
        changes = []
        for variation, follower_variation in zip(variations, follower_variations, strict=True):
            turned = variation.rotation
            dlever = cross(lever, turned)
            dpush = None if push is None else cross(push, turned)
            dmissing: tuple[Triple, ...] = ()
            if pulled is not None:
                dpulled = cross(pulled, turned)
                if follower_variation is not None:
                    body = into_body(q, follower_variation)
                    dpulled = combine((1.0, dpulled), (1.0, body))
                    dlever = combine((1.0, dlever), (cap, body))
                    dpush = None if dpush is None else combine((1.0, dpush), (1.0, body))
                dmissing = (dpulled,)
            dbalance = combine(
                (1.0 / length, apply(stiffness, variation.turn)),
                (-1.0, cross(moment, turned)),
                (-1.0, axis_cross(dlever)),
            )
            if offset is not None and dpush is not None:
                dbalance = combine((1.0, dbalance), (-1.0, cross(offset, dpush)))
            changes.append((dbalance, *dmissing))
        return (balance, *missing), changes

    def section_force(
        self, fraction: Float[Array, ""], follower: Float[Array, "3"] | None
    ) -> Float[Array, "3"]:
        """Force n(s) on a section [N], base frame."""
        return jnp.stack(self._force(fraction, None if follower is None else triple(follower)))

    def turn_rates(
        self, fraction: Float[Array, ""], force: Float[Array, "3"], turn: Float[Array, "3"]
    ) -> Float[Array, "3"]:
        """Derivative of u L by s/L under a force Rᵀn [N] on the section: `turn_rate`, in arrays."""
        length, u = self.actuator.bending_length, turn / self.actuator.bending_length
        arm = 1.0 if self.shear is None else 1.0 - self.shear * force[2]
        torque = -arm * _axis_cross(force) - jnp.cross(u, self.law.moment(u))
        return length**2 * _solve_3x3(self.law.stiffness(u), torque)

    def end_balance(
        self,
        rotation: Float[Array, "3 3"],
        turn: Float[Array, "3"],
        follower: Float[Array, "3"] | None,
    ) -> Float[Array, " n"]:
        """Imbalance at the end of the body: `end_imbalance`, in arrays."""
        loads, moment = self.loads, self.law.moment(turn / self.actuator.bending_length)
        lever = loads.lever if follower is None else loads.lever + self.actuator.tip_length * follower
        balance = moment - rotation.T @ loads.end_moment - loads.follower_moment
        balance = balance - _axis_cross(rotation.T @ lever)
        if self.offset is not None:
            push = loads.cap_force if follower is None else loads.cap_force + follower
            balance = balance - jnp.cross(self.offset, rotation.T @ push)
        if follower is None or loads.follower_force is None:
            return balance
        return jnp.concatenate([balance, rotation.T @ follower - loads.follower_force])

    def _curvature(self, turn: Triple) -> Triple:
        return combine((1.0 / self.actuator.bending_length, turn))

    def _force(self, fraction: Scalar, follower: Triple | None) -> Triple:
        """Force n(s) on a section [N], base frame."""
        ahead = 1.0 - fraction
        force = combine((1.0, triple(self.loads.end_force)), (ahead, triple(self.loads.body_force)))
        return force if follower is None else combine((1.0, force), (1.0, follower))


def _torque(moment: Triple, u: Triple, force: Triple, shear: Number | None) -> Triple:
    """K u' [N]."""
    torque = combine((-1.0, cross(u, moment)), (-1.0, axis_cross(force)))
    return torque if shear is None else combine((1.0, torque), (shear * force[2], axis_cross(force)))


def _axis_cross(v: Float[Array, "3"]) -> Float[Array, "3"]:
    """Product e₃ × v."""
    return jnp.stack([-v[1], v[0], jnp.zeros_like(v[0])])


def _solve_3x3(matrix: Float[Array, "3 3"], right: Float[Array, "3"]) -> Float[Array, "3"]:
    """Solve a 3 × 3 system by Cramer's rule, far cheaper than a factorisation at this size."""
    a, b, c = matrix
    cofactors = jnp.stack([jnp.cross(b, c), jnp.cross(c, a), jnp.cross(a, b)])
    return jnp.sum(cofactors * right[:, None], axis=0) / jnp.sum(a * cofactors[0])
