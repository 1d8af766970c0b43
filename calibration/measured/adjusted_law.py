"""Section law adjusted to a measured actuator by ten parameters."""

from dataclasses import replace
from typing import Any, final

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from rodmodel import CurvatureLaw, Domain, Rod, SectionLaw
from rodmodel.io import Adjustment, OuterWall, scaled_ends

NAMES = (
    "stiffness_scale",
    *(f"pressure_gain_{k}" for k in (1, 2, 3)),
    *(f"pressure_offset_{k}" for k in (1, 2, 3)),
    *(f"wall_variation_{k}" for k in (1, 2, 3)),
)

# Newton's method from the map's free curvature converges quadratically: 1e-2, 1e-4, 1e-8, 1e-16.
_NEWTON_STEPS = 6


@final
class AdjustedLaw(SectionLaw):
    """A map (section law of the finite elements) with scaled stiffness, pressures and outer walls.

        Π(u, p) = s [ Π_map(u, g p + o) + ½ Σ_k w_k uᵀ W_k u ]

    s is the stiffness scale. It multiplies the moment law, so that it has an effect under loads only. g and o
    are gain [-] and offset [Pa] of each chamber's pressure, from the sensor and from the strength of the
    chamber. A softer silicone, all moduli times c, has s = c and g = 1/c. w is the wall variation: the
    relative excess stiffness of the outer wall of chamber k, or its relative excess thickness in the same
    silicone. The effect of a thicker wall on its own chamber is part of the gain; its effect when other
    chambers bend the rod is in w only.

    Volumes are conjugate to the pressure readings, −∂Π/∂p. With offsets, the section is not straight at a
    reading of zero. The map is extrapolated where g p + o is negative.

    Attributes
    ----------
    law : section law of the finite elements.
    parameters : s, g (three), o (three, [Pa]), w (three), in the order of `NAMES`.
    wall : outer wall to which w refers.
    """

    law: SectionLaw
    parameters: Float[Array, "10"]
    wall: OuterWall = eqx.field(static=True, default=OuterWall())

    def at(self, pressure: Float[Array, "3"]) -> "AdjustedCurvatureLaw":
        """Contract the law to a function of the curvature.

        Parameters
        ----------
        pressure : reading of each chamber's gauge pressure [Pa].
        """
        scale, gain, offset, variation = _parts(self.parameters)
        law = self.law.at(gain * pressure + offset)
        walls = jnp.asarray(self.wall.stiffness(), self.parameters.dtype)
        return AdjustedCurvatureLaw(law, scale, jnp.tensordot(variation, walls, axes=1))


@final
class AdjustedCurvatureLaw(CurvatureLaw):
    """Adjusted law at one pressure: s [Π_map(u) + ½ uᵀ W u]."""

    law: CurvatureLaw
    free_curvature: Float[Array, "3"]
    scale: Float[Array, ""]
    walls: Float[Array, "3 3"]

    def __init__(self, law: CurvatureLaw, scale: Float[Array, ""], walls: Float[Array, "3 3"]) -> None:
        self.law = law
        self.scale = scale
        self.walls = walls

        def newton(u: Float[Array, "3"], _: None) -> tuple[Float[Array, "3"], None]:
            step = jnp.linalg.solve(law.stiffness(u) + walls, law.moment(u) + walls @ u)
            return u - step, None

        self.free_curvature = jax.lax.scan(newton, law.free_curvature, None, _NEWTON_STEPS)[0]

    def energy(self, curvature: Float[Array, "3"]) -> Float[Array, ""]:
        """Potential Π [J/m]."""
        return self.scale * (self.law.energy(curvature) + 0.5 * curvature @ self.walls @ curvature)

    def moment(self, curvature: Float[Array, "3"]) -> Float[Array, "3"]:
        """Moment ∂Π/∂u [N m]."""
        return self.scale * (self.law.moment(curvature) + self.walls @ curvature)

    def stiffness(self, curvature: Float[Array, "3"]) -> Float[Array, "3 3"]:
        """Tangent stiffness ∂²Π/∂u² [N m²]."""
        return self.scale * (self.law.stiffness(curvature) + self.walls)


def units_of(domain: Domain) -> Float[np.ndarray, "10"]:
    """Return the unit of each parameter: a map's largest pressure for offsets, and 1 for numbers."""
    return np.array([1.0] * 4 + [max(domain.pressure_max)] * 3 + [1.0] * 3)


def default_parameters() -> np.ndarray:
    """Return the parameters of the unchanged map: s = 1, g = 1, o = 0, w = 0."""
    return np.array([1.0, 1.0, 1.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0])


def adjustment_of(parameters: np.ndarray, wall: OuterWall | None = None) -> Adjustment:
    """Convert parameters, in the order and units of `NAMES`, for `rodmodel.io`."""
    scale, gain, offset, variation = _parts(np.asarray(parameters, np.float64))
    return Adjustment(float(scale), gain, offset, variation, OuterWall() if wall is None else wall)


def adjusted_rod(rod: Rod, parameters: np.ndarray, wall: OuterWall | None = None) -> Rod:
    """Return the rod of a measured actuator, with adjusted section and a domain of pressure readings.

    Parameters
    ----------
    rod : rod with a section law of any kind; see `rodmodel.io.adjusted` for calibrations.
    parameters : in the order and units of `NAMES` and [`AdjustedLaw`][].
    wall : outer wall to which the wall variation refers.

    Returns
    -------
    rod : adjusted rod; its `error_estimate` is still that of the map against the FEM.
    """
    adjustment = adjustment_of(parameters, wall)
    law = AdjustedLaw(rod.section, jnp.asarray(parameters, float), adjustment.wall)
    ends = scaled_ends(rod.actuator, adjustment.stiffness_scale)
    return replace(rod, section=law, actuator=ends, domain=adjustment.domain(rod.domain))


def _parts(parameters: Any) -> tuple[Any, Any, Any, Any]:
    return parameters[0], parameters[1:4], parameters[4:7], parameters[7:10]
