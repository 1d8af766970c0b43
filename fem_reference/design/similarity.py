"""Whether two designs are similar: the same but for the scale of lengths and of moduli.

The elastic body has no length and no modulus of its own. Where all lengths are λ times, and all moduli μ
times, those of another design, it bends by the same angles at μ times the pressures, μ λ³ times the moments
and μ λ² times the forces; its curvatures are 1/λ times the other's. Weight does not scale along.
"""

import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass, fields
from typing import Any

import numpy as np

from fem_reference.design.design import Design
from fem_reference.geometry import NoWinding
from fem_reference.materials import MODES, Material, nominal_stress


@dataclass(frozen=True)
class Scale:
    """Ratios of one body's lengths, moduli and density to those of another, and the factors that follow.

    Raises
    ------
    ValueError
        For a ratio that is not positive and finite.
    """

    length: float
    modulus: float
    density: float = 1.0

    def __post_init__(self) -> None:
        for field in fields(self):
            value = getattr(self, field.name)
            if not (isinstance(value, float | int) and math.isfinite(value) and value > 0.0):
                raise ValueError(f"{field.name}: got {value!r}, expected a positive finite ratio")

    def factor(self, powers: tuple[int, int, int]) -> float:
        """Return the factor of a quantity from its powers of length, modulus and density."""
        length, modulus, density = powers
        return self.length**length * self.modulus**modulus * self.density**density

    @property
    def pressure(self) -> float:
        """Factor of pressures."""
        return self.factor((0, 1, 0))

    @property
    def force(self) -> float:
        """Factor of forces."""
        return self.factor((2, 1, 0))

    @property
    def moment(self) -> float:
        """Factor of moments."""
        return self.factor((3, 1, 0))


@dataclass(frozen=True)
class Similarity:
    """How one design compares with another.

    Parameters
    ----------
    length : λ, ratio of the body's diameters.
    modulus : μ, ratio of the materials' initial shear moduli.
    deviations : by name, relative difference of each quantity from that of the other design, scaled; 1 for
        words that differ. Quantities that agree to rounding are left out.
    density : ratio of the densities, which is no deviation.
    """

    length: float
    modulus: float
    deviations: Mapping[str, float]
    density: float = 1.0

    @property
    def scale(self) -> Scale:
        """The ratios, with the factors of other quantities."""
        return Scale(self.length, self.modulus, self.density)

    @property
    def pressure(self) -> float:
        """Factor of pressures."""
        return self.scale.pressure

    @property
    def moment(self) -> float:
        """Factor of moments."""
        return self.scale.moment

    @property
    def force(self) -> float:
        """Factor of forces."""
        return self.scale.force

    def within(self, tolerance: float) -> bool:
        """Whether all quantities deviate by at most ``tolerance``."""
        return all(abs(deviation) <= tolerance for deviation in self.deviations.values())


# Relative differences of rounding.
_ROUNDING = 1e-12
_STRETCHES = np.linspace(1.1, 1.6, 6)


def similarity(design: Design, other: Design) -> Similarity:
    """Return how a design compares with another, whose lengths and moduli are scaled to it.

    Ends, bonds and pressures are no part of the comparison; nor is the density, as weight does not scale: its
    ratio stands beside.
    """
    mine, theirs = _shape(design), _shape(other)
    deviations = {}
    for name in mine | theirs:
        own, its = mine.get(name), theirs.get(name)
        if own == its:
            continue
        if isinstance(own, float) and isinstance(its, float):
            deviation = (own - its) / max(abs(own), abs(its))
            if abs(deviation) > _ROUNDING:
                deviations[name] = deviation
        else:
            deviations[name] = 1.0
    material = _material_deviation(design.material, other.material)
    if abs(material) > _ROUNDING:
        deviations["material"] = material
    return Similarity(
        design.geometry.body_diameter / other.geometry.body_diameter,
        design.material.shear_modulus / other.material.shear_modulus,
        deviations,
        design.density / other.density,
    )


def _shape(design: Design) -> dict[str, Any]:
    """Return all that makes the body's answer, in diameters of the body and in shear moduli."""
    diameter, modulus = design.geometry.body_diameter, design.material.shear_modulus
    shape: dict[str, Any] = {
        field.name: getattr(design.geometry, field.name) / diameter
        for field in fields(design.geometry)
        if field.name not in ("body_diameter", "outer_wall_variation")
    }
    shape |= {
        f"outer_wall_variation {k}": float(v)
        for k, v in enumerate(design.geometry.outer_wall_variation, start=1)
    }
    shape |= {
        "core": design.core.young_modulus / modulus,
        "bulk modulus": design.material.bulk_modulus / modulus,
    }
    shape["layout"] = design.winding.name
    if isinstance(design.winding, NoWinding):
        return shape
    for name, value in asdict(design.winding).items():
        shape[name] = value if name == "psi" else value / diameter
    thread = design.thread
    shape |= {
        "thread radius": thread.radius / diameter,
        "thread modulus": thread.young_modulus / modulus,
        "coupling": thread.coupling,
        "bends": thread.bends,
        "slack_share": thread.slack_share,
    }
    return shape


def _material_deviation(law: Material, other: Material) -> float:
    """Return the largest relative difference of two materials' stresses, each over its shear modulus.

    In all modes of `nominal_stress`, at stretches as in an actuator's walls.
    """
    largest = 0.0
    for mode in MODES:
        own, its = (nominal_stress(one, mode, _STRETCHES) / one.shear_modulus for one in (law, other))
        relative = own / its - 1.0
        largest = max(largest, *relative.tolist(), key=abs)
    return largest
