"""Abstract section law: a potential of curvature and pressure, and its derivatives."""

import abc
import functools
from collections.abc import Callable
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float


def _compiled(method: Callable[..., Array]) -> Callable[..., Array]:
    """Compile a law's method once for all laws of one shape.

    The law's numbers, such as its scales, first become arrays: floats would be constants of the compiled
    program, and another law could not share it.
    """
    compiled = eqx.filter_jit(method)

    @functools.wraps(method)
    def call(law: "SectionLaw", *arguments: Any, **named: Any) -> Array:
        arrays = jax.tree.map(lambda x: jnp.asarray(x, float) if isinstance(x, float | int) else x, law)
        found: Array = compiled(arrays, *arguments, **named)
        return found

    return call


class CurvatureLaw(eqx.Module):
    """Section potential at one fixed pressure: a function of the curvature alone.

    The pressures are uniform along a rod, so a rod contracts its [`rodmodel.SectionLaw`][] once, by
    [`rodmodel.SectionLaw.at`][], and integrates with the result. `energy`, `moment` and `stiffness` take one
    curvature; use `jax.vmap` for many.
    """

    free_curvature: eqx.AbstractVar[Float[Array, "3"]]
    """Curvature û at which the moment vanishes [1/m], body frame."""

    @abc.abstractmethod
    def energy(self, curvature: Float[Array, "3"]) -> Float[Array, ""]:
        """Return the potential Π per length [J/m], zero at rest without pressure."""

    @abc.abstractmethod
    def moment(self, curvature: Float[Array, "3"]) -> Float[Array, "3"]:
        """Return the moment ∂Π/∂u [N m], body frame."""

    @abc.abstractmethod
    def stiffness(self, curvature: Float[Array, "3"]) -> Float[Array, "3 3"]:
        """Return the tangent stiffness ∂²Π/∂u² [N m²], body frame, symmetric."""


class SectionLaw(eqx.Module):
    """Potential Π(u, p) per length of a uniform section; moment and chamber volumes are its derivatives.

    With u the curvature and twist in the body frame, p the gauge pressures of the three chambers,

        ∂Π/∂u = m,    ∂Π/∂p = −V,    Π(0, 0) = 0,    û(0) = 0,

    where m is the internal moment, including the pressure on the section, and V the chamber volumes per
    length. As both derive from one potential, the stiffness is symmetric, and a cycle of pressure and bending
    dissipates no work.
    """

    @abc.abstractmethod
    def at(self, pressure: Float[Array, "3"]) -> CurvatureLaw:
        """Contract the law to a function of the curvature.

        Parameters
        ----------
        pressure : gauge pressure of each chamber [Pa].
        """

    def contracted(self, pressure: Float[Array, "3"]) -> CurvatureLaw:
        """Contract the law as `at` does, but without solving for the free curvature."""
        return self.at(pressure)

    @_compiled
    def potential(self, curvature: Float[Array, "3"], pressure: Float[Array, "3"]) -> Float[Array, ""]:
        """Return the potential Π per length [J/m].

        Parameters
        ----------
        curvature : curvature and twist [1/m], body frame.
        pressure : gauge pressure of each chamber [Pa].
        """
        return self.contracted(pressure).energy(curvature)

    @_compiled
    def moment(self, curvature: Float[Array, "3"], pressure: Float[Array, "3"]) -> Float[Array, "3"]:
        """Return the internal moment ∂Π/∂u.

        Parameters
        ----------
        curvature : curvature and twist [1/m], body frame.
        pressure : gauge pressure of each chamber [Pa].

        Returns
        -------
        moment : moment [N m], body frame, including the pressure on the section.
        """
        return self.contracted(pressure).moment(curvature)

    @_compiled
    def stiffness(self, curvature: Float[Array, "3"], pressure: Float[Array, "3"]) -> Float[Array, "3 3"]:
        """Return the tangent stiffness ∂²Π/∂u² at constant pressure.

        Parameters
        ----------
        curvature : curvature and twist [1/m], body frame.
        pressure : gauge pressure of each chamber [Pa].

        Returns
        -------
        stiffness : symmetric matrix [N m²], body frame.
        """
        return self.contracted(pressure).stiffness(curvature)

    @_compiled
    def volume(self, curvature: Float[Array, "3"], pressure: Float[Array, "3"]) -> Float[Array, "3"]:
        """Return the chamber volumes per length, −∂Π/∂p.

        Parameters
        ----------
        curvature : curvature and twist [1/m], body frame.
        pressure : gauge pressure of each chamber [Pa].

        Returns
        -------
        volume : volume of each chamber per length of the axis [m²].
        """
        return -jax.jacfwd(self.potential, argnums=1)(curvature, pressure)

    @_compiled
    def free_curvature(self, pressure: Float[Array, "3"]) -> Float[Array, "3"]:
        """Return the curvature û(p) at which the moment vanishes.

        Parameters
        ----------
        pressure : gauge pressure of each chamber [Pa].

        Returns
        -------
        curvature : curvature and twist [1/m], body frame.
        """
        return self.at(pressure).free_curvature
