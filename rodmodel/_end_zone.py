"""End zones: a section that changes near the base and near the cap, where it cannot balloon freely."""

from typing import NamedTuple, final

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from rodmodel._components import Scalar, Symmetric, Triple, apply, combine, contract
from rodmodel.section import CurvatureLaw


@final
class End(eqx.Module):
    """How the section differs at one end, and over which length it comes to that of the middle.

    Attributes
    ----------
    stiffness : part by which the stiffness is larger at the end, more than −1.
    free_curvature : part by which the free curvature is larger at the end; −0.3 for 30 % less.
    decay_length : distance over which both differences fall by e [m].
    """

    stiffness: Float[Array, ""] | float
    free_curvature: Float[Array, ""] | float
    decay_length: Float[Array, ""] | float


@final
class EndZone(eqx.Module):
    """Factors of stiffness and free curvature along the body.

    With a the difference of an [`End`][], ℓ its decay length and d the distance from it, the factor is
    1 + Σ a exp(−d/ℓ) over both ends, and the potential of the section at s

        Π(u, p, s) = Π(û, p) + g(s) [Π(u + (1 − f(s)) û, p) − Π(û, p)]

    with g the factor of the stiffness and f that of the free curvature û(p), which becomes f û.
    """

    base: End
    cap: End

    def factors(self, arc_length: Scalar, length: float) -> "Factors":
        """Factors at an arc length [m] of a body of a length [m], and their slopes [1/m]."""
        base = jnp.exp(-arc_length / self.base.decay_length)
        cap = jnp.exp((arc_length - length) / self.cap.decay_length)
        down, up = -base / self.base.decay_length, cap / self.cap.decay_length
        b, c = self.base, self.cap
        return Factors(
            stiffness=1.0 + b.stiffness * base + c.stiffness * cap,
            stiffness_slope=b.stiffness * down + c.stiffness * up,
            free=1.0 + b.free_curvature * base + c.free_curvature * cap,
            free_slope=b.free_curvature * down + c.free_curvature * up,
        )


class Factors(NamedTuple):
    """Factors g and f at one section, and their slopes along the rod [1/m]."""

    stiffness: Scalar
    stiffness_slope: Scalar
    free: Scalar
    free_slope: Scalar


class SectionState(NamedTuple):
    """Section at one place and curvature: all that the equations of the rod need of it."""

    moment: Triple
    """m = ∂Π/∂u [N m]."""
    stiffness: Symmetric
    """K = ∂m/∂u [N m²]."""
    third: tuple[Scalar, ...] | None
    """∂K/∂u [N m³]; None where it is zero."""
    moment_slope: Triple | None
    """∂m/∂s at constant u [N]; None where the section is the same all along."""
    stiffness_slope: Symmetric | None
    """∂K/∂s at constant u [N m]."""


def section_state(
    law: CurvatureLaw, zone: EndZone | None, curvature: Triple, arc_length: Scalar, length: float
) -> SectionState:
    """Evaluate a section at an arc length [m] and a curvature [1/m]."""
    if zone is None:
        return SectionState(*law.expand(curvature), moment_slope=None, stiffness_slope=None)
    at = zone.factors(arc_length, length)
    free = law.free_curvature[0], law.free_curvature[1], law.free_curvature[2]
    m, k, t = law.expand(combine((1.0, curvature), (1.0 - at.free, free)))
    g = at.stiffness
    moved = -g * at.free_slope
    bent = [0.0] * 6 if t is None else contract(t, free)
    a, b, c, d, e, f = (at.stiffness_slope * x + moved * y for x, y in zip(k, bent, strict=True))
    p, q, r, x, y, z = (g * entry for entry in k)
    return SectionState(
        moment=combine((g, m)),
        stiffness=(p, q, r, x, y, z),
        third=None if t is None else tuple(g * entry for entry in t),
        moment_slope=combine((at.stiffness_slope, m), (moved, apply(k, free))),
        stiffness_slope=(a, b, c, d, e, f),
    )


def section_energy(
    law: CurvatureLaw,
    zone: EndZone | None,
    curvature: Float[Array, "3"],
    arc_length: Float[Array, ""],
    length: float,
) -> Float[Array, ""]:
    """Potential per length [J/m] of a section at an arc length [m]."""
    if zone is None:
        return law.energy(curvature)
    at = zone.factors(arc_length, length)
    free = law.free_curvature
    ground = law.energy(free)
    return ground + at.stiffness * (law.energy(curvature + (1.0 - at.free) * free) - ground)
