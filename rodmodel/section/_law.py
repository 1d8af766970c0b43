"""What every section law offers: a potential of curvature and pressure, and its derivatives."""

import abc
import itertools
from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from rodmodel._components import Scalar, Symmetric, Triple, triple

_AXES = range(3)
PAIRS, TRIPLES, QUADRUPLES = (tuple(itertools.combinations_with_replacement(_AXES, n)) for n in (2, 3, 4))


class Expansion(NamedTuple):
    """First three derivatives of a potential by the curvature, in scalars, for the solvers."""

    moment: Triple
    """∂Π/∂u [N m]."""
    stiffness: Symmetric
    """∂²Π/∂u² [N m²], entries 11, 12, 13, 22, 23, 33."""
    third: tuple[Scalar, ...] | None
    """∂³Π/∂u³ [N m³], the ten entries of non-decreasing indices; None where it is zero."""


class CurvatureLaw(eqx.Module):
    """Section potential at one fixed pressure: a function of the curvature alone.

    The pressures are the same all along a rod, so a rod contracts its [`rodmodel.SectionLaw`][] once, by
    [`rodmodel.SectionLaw.at`][], and integrates what is left. `energy`, `moment` and `stiffness` take one
    curvature; `jax.vmap` them over many.
    """

    free_curvature: eqx.AbstractVar[Float[Array, "3"]]
    """Curvature û at which the moment vanishes [1/m], body frame."""

    @abc.abstractmethod
    def energy(self, curvature: Float[Array, "3"]) -> Float[Array, ""]:
        """Potential Π per length [J/m], zero at rest without pressure."""

    @abc.abstractmethod
    def moment(self, curvature: Float[Array, "3"]) -> Float[Array, "3"]:
        """Moment ∂Π/∂u [N m], body frame."""

    @abc.abstractmethod
    def stiffness(self, curvature: Float[Array, "3"]) -> Float[Array, "3 3"]:
        """Tangent stiffness ∂²Π/∂u² [N m²], body frame, symmetric."""

    def expand(self, curvature: Triple) -> Expansion:
        """Moment, stiffness and its slope at a curvature [1/m], in scalars."""
        u = jnp.stack(curvature)
        stiffness = self.stiffness(u)
        slope = jax.jacfwd(self.stiffness)(u)
        a, b, c, d, e, f = (stiffness[pair] for pair in PAIRS)
        return Expansion(triple(self.moment(u)), (a, b, c, d, e, f), tuple(slope[t] for t in TRIPLES))

    def linearise(self, curvature: Triple) -> tuple[Triple, Symmetric]:
        """Moment and stiffness alone, as `expand` gives them."""
        return self.expand(curvature)[:2]

    def slopes_by(self, curvature: Triple, change: "CurvatureLaw") -> Float[Array, "9"]:
        """Change of the moment and of the stiffness' entries at a curvature, as the law's leaves change."""

        def section(law: CurvatureLaw) -> Float[Array, "9"]:
            moment, stiffness = law.linearise(curvature)
            return jnp.stack([*moment, *stiffness])

        return jnp.asarray(jax.jvp(section, (self,), (change,))[1])

    def seen_in(self, axes: np.ndarray) -> "CurvatureLaw":
        """Law of curvatures u whose components in this law's axes are Q u, Q orthogonal: Π(Q u)."""
        # Imported here: a law in other axes is a law.
        from rodmodel.section._turned import CurvatureLawInAxes

        return CurvatureLawInAxes(self, axes)


class SectionLaw(eqx.Module):
    """Potential Π(u, p) per length of a uniform section, of which moment and chamber volume are the slopes.

    With u the curvature and twist in the body frame, p the gauge pressures of the three chambers,

        ∂Π/∂u = m,    ∂Π/∂p = −V,    Π(0, 0) = 0,    û(0) = 0,

    m the internal moment with the pressure on the section included, and V the chamber volumes per length.
    As both derive from one potential, stiffness is symmetric and a cycle of pressure and bending loses no
    work.
    """

    @abc.abstractmethod
    def at(self, pressure: Float[Array, "3"]) -> CurvatureLaw:
        """Contract the law to a function of the curvature.

        Parameters
        ----------
        pressure : gauge pressure of each chamber [Pa].
        """

    def potential(self, curvature: Float[Array, "3"], pressure: Float[Array, "3"]) -> Float[Array, ""]:
        """Potential Π per length [J/m].

        Parameters
        ----------
        curvature : [1/m], body frame.
        pressure : gauge pressure of each chamber [Pa].
        """
        return self.at(pressure).energy(curvature)

    def moment(self, curvature: Float[Array, "3"], pressure: Float[Array, "3"]) -> Float[Array, "3"]:
        """Internal moment ∂Π/∂u.

        Parameters
        ----------
        curvature : [1/m], body frame.
        pressure : gauge pressure of each chamber [Pa].

        Returns
        -------
        moment : [N m], body frame; pressure on the section included.
        """
        return self.at(pressure).moment(curvature)

    def stiffness(self, curvature: Float[Array, "3"], pressure: Float[Array, "3"]) -> Float[Array, "3 3"]:
        """Tangent stiffness ∂²Π/∂u² at constant pressure.

        Parameters
        ----------
        curvature : [1/m], body frame.
        pressure : gauge pressure of each chamber [Pa].

        Returns
        -------
        stiffness : [N m²], body frame, symmetric.
        """
        return self.at(pressure).stiffness(curvature)

    def volume(self, curvature: Float[Array, "3"], pressure: Float[Array, "3"]) -> Float[Array, "3"]:
        """Chamber volumes per length, −∂Π/∂p.

        Parameters
        ----------
        curvature : [1/m], body frame.
        pressure : gauge pressure of each chamber [Pa].

        Returns
        -------
        volume : of each chamber, per length of the axis [m²].
        """
        return -jax.jacfwd(self.potential, argnums=1)(curvature, pressure)

    def free_curvature(self, pressure: Float[Array, "3"]) -> Float[Array, "3"]:
        """Curvature û(p) at which the moment vanishes.

        Parameters
        ----------
        pressure : gauge pressure of each chamber [Pa].

        Returns
        -------
        curvature : [1/m], body frame.
        """
        return self.at(pressure).free_curvature
