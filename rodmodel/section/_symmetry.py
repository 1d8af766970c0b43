"""Section laws of turned and mirrored windings: the same section, with the chambers renumbered."""

from typing import final

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from rodmodel.io import MIRROR, SWAPPED, turn_matrix
from rodmodel.section._law import CurvatureLaw, SectionLaw


@final
class TurnedLaw(SectionLaw):
    """Law of a section whose winding is turned by 120° · `turns` from that of `law`.

    In axes that turn with the winding, chamber 1 + `turns` is chamber 1, and the section is that of `law`:

        Π(u, p) = Π_law(R_z(−120° turns) u, (p_{1+turns}, p_{2+turns}, p_{3+turns}))

    Attributes
    ----------
    law : the law at the winding's own orientation.
    turns : 1 or 2.
    """

    law: SectionLaw
    turns: int = eqx.field(static=True)

    def __check_init__(self) -> None:
        """Refuse other numbers of turns than 1 and 2."""
        if self.turns not in (1, 2):
            raise ValueError(f"turns: got {self.turns}, expected 1 or 2 (times 120 degrees)")

    def at(self, pressure: Float[Array, "3"]) -> CurvatureLaw:
        """Contract the law to a function of the curvature."""
        return CurvatureLawInAxes(self.law.at(jnp.roll(pressure, -self.turns)), turn_matrix(self.turns))

    def contracted(self, pressure: Float[Array, "3"]) -> CurvatureLaw:
        """See `SectionLaw.contracted`."""
        return CurvatureLawInAxes(
            self.law.contracted(jnp.roll(pressure, -self.turns)), turn_matrix(self.turns)
        )


@final
class MirroredLaw(SectionLaw):
    """Law of the mirror image y → −y of a section: the winding at −ψ, with chambers 2 and 3 swapped.

        Π(u, p) = Π_law(−u₁, u₂, −u₃, p₁, p₃, p₂)

    Curvatures about axes in the mirror plane change their sign, as axial vectors do.

    Attributes
    ----------
    law : law of the section itself.
    """

    law: SectionLaw

    def at(self, pressure: Float[Array, "3"]) -> CurvatureLaw:
        """Contract the law to a function of the curvature."""
        return CurvatureLawInAxes(self.law.at(pressure[SWAPPED]), MIRROR)

    def contracted(self, pressure: Float[Array, "3"]) -> CurvatureLaw:
        """See `SectionLaw.contracted`."""
        return CurvatureLawInAxes(self.law.contracted(pressure[SWAPPED]), MIRROR)


@final
class CurvatureLawInAxes(CurvatureLaw):
    """Law Π(Q u) at one pressure, where Q u are the components of the curvature in the law's own axes."""

    law: CurvatureLaw
    free_curvature: Float[Array, "3"]
    axes: Float[Array, "3 3"]
    """Orthogonal matrix Q."""

    def __init__(self, law: CurvatureLaw, axes: np.ndarray) -> None:
        self.law = law
        self.axes = jnp.asarray(axes, law.free_curvature.dtype)
        self.free_curvature = self.axes.T @ law.free_curvature

    def energy(self, curvature: Float[Array, "3"]) -> Float[Array, ""]:
        """Return the potential Π [J/m]."""
        return self.law.energy(self.axes @ curvature)

    def moment(self, curvature: Float[Array, "3"]) -> Float[Array, "3"]:
        """Return the moment ∂Π/∂u [N m]."""
        return self.axes.T @ self.law.moment(self.axes @ curvature)

    def stiffness(self, curvature: Float[Array, "3"]) -> Float[Array, "3 3"]:
        """Return the tangent stiffness ∂²Π/∂u² [N m²]."""
        return self.axes.T @ self.law.stiffness(self.axes @ curvature) @ self.axes
