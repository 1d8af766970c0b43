"""Dimensions of the three-chamber actuator, checked when they are given."""

import math
from dataclasses import dataclass, fields

import numpy as np
from jaxtyping import Float

from fem_reference.geometry.paper import paper_number
from fem_reference.geometry.plausible import refuse_implausible


def _length(key: str) -> float:
    return paper_number("dimensions", key, -3)


@dataclass(frozen=True)
class ActuatorGeometry:
    """Three-chamber silicone tube with a central rod and a winding.

    Lengths are in metres. A chamber is an annular sector between the inner and the outer wall; its sides run
    parallel to the mid-line of the partitions, half a partition's thickness away. Chamber ``k`` (1, 2, 3) is
    centred at azimuth 120°(k − 1).

    Parameters
    ----------
    body_diameter : outer diameter of the tube [m].
    cavity_diameter : diameter of the central rod and of the cavity that it lies in [m].
    outer_wall, inner_wall, partition_wall : wall thicknesses [m].
    body_length, cap_length : length of the chambers and of the solid cap beyond them [m].
    winding_diameter : diameter of the cylinder that the thread lies on [m].
    outer_wall_variation : relative excess thickness of the outer wall at each chamber, as from eccentric
        mould cores. The outer diameter stays; the chamber becomes smaller.

    Raises
    ------
    ValueError
        For a length that is not positive and finite or seems to be in another unit (`plausible`), a
        variation that is not three numbers above -1, and walls that leave no chamber.

    References
    ----------
    "Modeling of a two-degree-of-freedom fiber-reinforced soft pneumatic actuator", Robotica (2023), Table I.
    """

    body_diameter: float = _length("body_diameter_mm")
    cavity_diameter: float = _length("cavity_diameter_mm")
    outer_wall: float = _length("outer_wall_mm")
    inner_wall: float = _length("inner_wall_mm")
    partition_wall: float = _length("partition_wall_mm")
    body_length: float = _length("body_length_mm")
    cap_length: float = _length("cap_length_mm")
    winding_diameter: float = _length("winding_diameter_mm")
    outer_wall_variation: tuple[float, float, float] = (0.0, 0.0, 0.0)

    def __post_init__(self) -> None:
        for field in fields(self):
            value = getattr(self, field.name)
            if field.name == "outer_wall_variation":
                continue
            if not (isinstance(value, int | float) and math.isfinite(value) and value > 0.0):
                raise ValueError(f"{field.name}: got {value!r}, expected a positive finite length in metres")
            refuse_implausible(field.name, value)
        variation = np.asarray(self.outer_wall_variation, dtype=float)
        if variation.shape != (3,) or not np.all(np.isfinite(variation) & (variation > -1.0)):
            raise ValueError(
                f"outer_wall_variation: got {self.outer_wall_variation!r}, expected three finite numbers "
                "above -1, relative to the outer wall"
            )
        inner, outer = self.chamber_inner_radius, min(self.chamber_outer_radii)
        if inner >= outer:
            raise ValueError(
                f"outer_wall and inner_wall: got {(self.body_diameter / 2.0 - outer) * 1e3:g} mm and "
                f"{self.inner_wall * 1e3:g} mm, which leave no chamber between radius {inner * 1e3:g} mm and "
                f"{outer * 1e3:g} mm; expected thinner walls"
            )
        # Where a partition reaches 60° of half-width at the inner wall, the chambers' inner arcs vanish.
        widest = 2.0 * inner * math.sin(math.pi / 3.0)
        if self.partition_wall >= widest:
            raise ValueError(
                f"partition_wall: got {self.partition_wall * 1e3:g} mm, which closes the chambers; expected "
                f"less than {widest * 1e3:g} mm for an inner chamber radius of {inner * 1e3:g} mm"
            )
        outer = max(self.chamber_outer_radii)
        if not outer < self.winding_diameter / 2.0 < self.body_diameter / 2.0:
            raise ValueError(
                f"winding_diameter: got {self.winding_diameter * 1e3:g} mm, expected between "
                f"{2e3 * outer:g} and {self.body_diameter * 1e3:g} mm (inside the outer wall)"
            )

    @property
    def chamber_inner_radius(self) -> float:
        """Radius of a chamber's inner arc [m]."""
        return self.cavity_diameter / 2.0 + self.inner_wall

    @property
    def chamber_outer_radius(self) -> float:
        """Radius of a chamber's outer arc for an even outer wall [m]."""
        return self.body_diameter / 2.0 - self.outer_wall

    @property
    def chamber_outer_radii(self) -> tuple[float, float, float]:
        """Radius of each chamber's outer arc [m]."""
        first, second, third = (
            self.body_diameter / 2.0 - self.outer_wall * (1.0 + v) for v in self.outer_wall_variation
        )
        return first, second, third

    def chamber_half_angle(self, radius: float) -> float:
        """Half the angle that a chamber spans at ``radius`` [rad]."""
        return math.pi / 3.0 - math.asin(self.partition_wall / 2.0 / radius)

    @property
    def chamber_area(self) -> float:
        """Cross-section of a chamber for an even outer wall [m²]."""
        return self._area_within(self.chamber_outer_radius)

    @property
    def chamber_areas(self) -> tuple[float, float, float]:
        """Cross-section of each chamber [m²]."""
        first, second, third = map(self._area_within, self.chamber_outer_radii)
        return first, second, third

    def _area_within(self, outer_radius: float) -> float:
        """Cross-section of a chamber whose outer arc has this radius [m²], in closed form."""

        def half_sector(radius: float) -> float:
            # ∫ r·(60° − asin(t/2r)) dr; the antiderivative of r·asin(c/r) is (r² asin(c/r) + c √(r² − c²))/2.
            c = self.partition_wall / 2.0
            return math.pi / 6.0 * radius**2 - 0.5 * (
                radius**2 * math.asin(c / radius) + c * math.sqrt(radius**2 - c**2)
            )

        return 2.0 * (half_sector(outer_radius) - half_sector(self.chamber_inner_radius))

    @property
    def body_area(self) -> float:
        """Cross-section of the silicone [m²]: the tube less cavity and chambers."""
        ring = math.pi / 4.0 * (self.body_diameter**2 - self.cavity_diameter**2)
        return ring - sum(self.chamber_areas)


def as_vector(name: str, value: object, unit: str) -> np.ndarray:
    """Return ``value`` as three finite floats, or raise a ValueError that names the argument."""
    vector = np.asarray(value, dtype=float)
    if vector.shape != (3,) or not np.all(np.isfinite(vector)):
        raise ValueError(f"{name}: got {value!r}, expected three finite numbers [{unit}]")
    return vector


def as_pressure(value: object) -> np.ndarray:
    """Return the pressures of three chambers as floats, or raise a ValueError, also for a negative one."""
    pressure = as_vector("pressure", value, "Pa")
    if pressure.min() < 0.0:
        raise ValueError(f"pressure: got {value!r} Pa, expected none below 0 Pa")
    return pressure


def as_triple(vector: Float[np.ndarray, "3"]) -> tuple[float, float, float]:
    """Return a vector as three floats."""
    first, second, third = (float(value) for value in vector)
    return first, second, third
