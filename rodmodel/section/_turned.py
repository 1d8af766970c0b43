"""A section law seen from another chamber: the same section, turned about its axis by a multiple of 120°."""

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
        return self.law.at(jnp.roll(pressure, -self.turns)).turned(self.turns)


@final
class TurnedCurvatureLaw(CurvatureLaw):
    """Law at one pressure, in axes from which the section is turned by 120° · `turns`."""

    law: CurvatureLaw
    free_curvature: Float[Array, "3"]
    turns: int = eqx.field(static=True)

    def __init__(self, law: CurvatureLaw, turns: int) -> None:
        self.law = law
        self.turns = turns
        self.free_curvature = self._into_turned(law.free_curvature).T @ law.free_curvature

    def energy(self, curvature: Float[Array, "3"]) -> Float[Array, ""]:
        """Potential Π [J/m]."""
        return self.law.energy(self._into_turned(curvature) @ curvature)

    def moment(self, curvature: Float[Array, "3"]) -> Float[Array, "3"]:
        """Moment ∂Π/∂u [N m]."""
        turn = self._into_turned(curvature)
        return turn.T @ self.law.moment(turn @ curvature)

    def stiffness(self, curvature: Float[Array, "3"]) -> Float[Array, "3 3"]:
        """Tangent stiffness ∂²Π/∂u² [N m²]."""
        turn = self._into_turned(curvature)
        return turn.T @ self.law.stiffness(turn @ curvature) @ turn

    def _into_turned(self, like: Float[Array, "3"]) -> Float[Array, "3 3"]:
        return jnp.asarray(INTO_TURNED[self.turns], like.dtype)
