"""Linear section law: moments linear in the curvature, free curvature linear in the pressures."""

import math
from typing import final

import jax.numpy as jnp
from jaxtyping import Array, Float

from rodmodel.actuator import Number
from rodmodel.section._law import CurvatureLaw, SectionLaw


@final
class LinearLaw(SectionLaw):
    """Section of constant stiffness with a free curvature proportional to the pressures.

        Π(u, p) = ½ (u − C p)ᵀ K (u − C p) − V₀ Σ p_k

    Attributes
    ----------
    section_stiffness : stiffness K, symmetric [N m²], of bending about the section's two axes, and of twist.
    curvature_by_pressure : C [1/(m Pa)], with a column for each chamber.
    rest_volume : chamber volume V₀ per length at rest [m²].
    """

    section_stiffness: Float[Array, "3 3"]
    curvature_by_pressure: Float[Array, "3 3"]
    rest_volume: Number = 0.0

    def __check_init__(self) -> None:
        """Refuse arrays of wrong shapes, and a volume that is not finite."""
        for name in ("section_stiffness", "curvature_by_pressure"):
            if jnp.shape(getattr(self, name)) != (3, 3):
                raise ValueError(f"{name}: got shape {jnp.shape(getattr(self, name))}, expected (3, 3)")
        if isinstance(self.rest_volume, float | int) and not math.isfinite(self.rest_volume):
            raise ValueError(f"rest_volume: got {self.rest_volume}, expected a finite number [m²]")

    def at(self, pressure: Float[Array, "3"]) -> "LinearCurvatureLaw":
        """Contract the law to a function of the curvature."""
        return LinearCurvatureLaw(
            free_curvature=self.curvature_by_pressure @ pressure,
            section_stiffness=self.section_stiffness,
            constant=-self.rest_volume * jnp.sum(pressure),
        )


@final
class LinearCurvatureLaw(CurvatureLaw):
    """Linear law at one pressure: Π = ½ (u − û)ᵀ K (u − û) + constant."""

    free_curvature: Float[Array, "3"]
    section_stiffness: Float[Array, "3 3"]
    constant: Float[Array, ""]

    def energy(self, curvature: Float[Array, "3"]) -> Float[Array, ""]:
        """Return the potential Π [J/m]."""
        w = curvature - self.free_curvature
        return 0.5 * w @ self.section_stiffness @ w + self.constant

    def moment(self, curvature: Float[Array, "3"]) -> Float[Array, "3"]:
        """Return the moment ∂Π/∂u [N m]."""
        return self.section_stiffness @ (curvature - self.free_curvature)

    def stiffness(self, curvature: Float[Array, "3"]) -> Float[Array, "3 3"]:
        """Return the tangent stiffness ∂²Π/∂u² [N m²]."""
        del curvature
        return self.section_stiffness
