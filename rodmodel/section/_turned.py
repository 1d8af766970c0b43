"""A section law seen from another chamber or in a mirror: the same section, its chambers numbered anew."""

import math
from typing import final

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from rodmodel.section._law import CurvatureLaw, SectionLaw

# By turns of 120°: components in the turned axes from those in the given axes, R_z(−120° k).
_COS = (1.0, -0.5, -0.5)
_SIN = (0.0, math.sqrt(0.75), -math.sqrt(0.75))
INTO_TURNED = np.array(
    [[[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]] for c, s in zip(_COS, _SIN, strict=True)]
)


MIRROR = np.diag([-1.0, 1.0, -1.0])  # of curvatures, y → −y
SWAPPED = np.array([0, 2, 1])  # chambers in the mirror


@final
class TurnedLaw(SectionLaw):
    """Law of a section whose winding lies 120° · `turns` further round than that of `law`.

    Seen from axes that turn with the winding, chamber 1 + `turns` is chamber 1 and the section is that of
    `law`:

        Π(u, p) = Π_law(R_z(−120° turns) u, (p_{1+turns}, p_{2+turns}, p_{3+turns}))

    Attributes
    ----------
    law : the law at the winding's own orientation.
    turns : 1 or 2.
    """

    law: SectionLaw
    turns: int = eqx.field(static=True)

    def __check_init__(self) -> None:
        """Refuse a turn that is none or more than one."""
        if self.turns not in (1, 2):
            raise ValueError(f"turns: got {self.turns}, expected 1 or 2 (times 120 degrees)")

    def at(self, pressure: Float[Array, "3"]) -> CurvatureLaw:
        """Contract the law to a function of the curvature."""
        return CurvatureLawInAxes(self.law.at(jnp.roll(pressure, -self.turns)), INTO_TURNED[self.turns])

    def contracted(self, pressure: Float[Array, "3"]) -> CurvatureLaw:
        """See `SectionLaw.contracted`."""
        return CurvatureLawInAxes(
            self.law.contracted(jnp.roll(pressure, -self.turns)), INTO_TURNED[self.turns]
        )


@final
class MirroredLaw(SectionLaw):
    """Law of the mirror image y → −y of a section: of the winding at −ψ, chambers 2 and 3 swapped.

        Π(u, p) = Π_law(−u₁, u₂, −u₃, p₁, p₃, p₂)

    Curvatures about axes in the mirror's plane change their sign, as all turns do that a mirror shows.

    Attributes
    ----------
    law : the law of the section itself.
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
    """Law at one pressure, Π(Q u), of curvatures whose components in the law's own axes are Q u."""

    law: CurvatureLaw
    free_curvature: Float[Array, "3"]
    axes: Float[Array, "3 3"]
    """Q, orthogonal."""

    def __init__(self, law: CurvatureLaw, axes: np.ndarray) -> None:
        self.law = law
        self.axes = jnp.asarray(axes, law.free_curvature.dtype)
        self.free_curvature = self.axes.T @ law.free_curvature

    def energy(self, curvature: Float[Array, "3"]) -> Float[Array, ""]:
        """Potential Π [J/m]."""
        return self.law.energy(self.axes @ curvature)

    def moment(self, curvature: Float[Array, "3"]) -> Float[Array, "3"]:
        """Moment ∂Π/∂u [N m]."""
        return self.axes.T @ self.law.moment(self.axes @ curvature)

    def stiffness(self, curvature: Float[Array, "3"]) -> Float[Array, "3 3"]:
        """Tangent stiffness ∂²Π/∂u² [N m²]."""
        return self.axes.T @ self.law.stiffness(self.axes @ curvature) @ self.axes
