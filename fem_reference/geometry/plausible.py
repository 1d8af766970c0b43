"""Ranges of dimensioned inputs, so that a number in another unit is refused and not computed with.

One table. The ranges are wide: they hold every soft actuator that we know of, and leave out what a thousand
times more or less of one would be. They say nothing about what is sensible.
"""

import math
from collections.abc import Mapping
from typing import NamedTuple


class Range(NamedTuple):
    """Numbers from `least` to `most`, both included, and which unit those beyond may be in."""

    least: float
    most: float
    unit: str
    if_less: str | None = None
    if_more: str | None = None


_Three = tuple[float, float, float]
_DIAMETER = Range(1e-4, 0.5, "m", if_more="millimetres")
_WALL = Range(1e-6, 0.1, "m", if_more="millimetres")
_LENGTH = Range(1e-4, 2.0, "m", if_more="millimetres")
_ADVANCE = Range(1e-5, 0.5, "m", if_more="millimetres")

#: By the argument's name.
PLAUSIBLE: Mapping[str, Range] = {
    "body_diameter": _DIAMETER,
    "cavity_diameter": _DIAMETER,
    "winding_diameter": _DIAMETER,
    "outer_wall": _WALL,
    "inner_wall": _WALL,
    "partition_wall": _WALL,
    "body_length": _LENGTH,
    "cap_length": _LENGTH,
    "pitch": _ADVANCE,
    "spacing": _ADVANCE,
    "psi": Range(-8.0, 8.0, "rad", if_less="degrees", if_more="degrees"),
    "radius": Range(1e-6, 0.01, "m", if_more="millimetres"),
    "young_modulus": Range(1e5, 1e13, "Pa", if_less="megapascals"),
    "shear_moduli": Range(100.0, 1e9, "Pa", if_less="megapascals"),
    "constants": Range(100.0, 1e9, "Pa", if_less="megapascals"),
    "bulk_modulus": Range(1e3, 1e12, "Pa", if_less="megapascals"),
    "density": Range(50.0, 3e4, "kg/m³", if_less="g/cm³"),
    "end_compliance": Range(0.0, 0.05, "m/N", if_more="mm/N"),
    "axial_size": Range(0.01, 100.0, "mm", if_less="metres"),
    "gravity": Range(0.0, 1000.0, "m/s²", if_more="mm/s²"),
}
#: Bulk modulus over shear modulus: below, the body is not nearly incompressible; above, rounding takes over.
BULK_TO_SHEAR = (2.0, 2e6)
#: Of G D³, with G the body's shear modulus and D its diameter, the largest moment on a section, and the
#: largest force times the body's length; and of 1/D, the largest curvature. Bodies fold far below.
MOMENT_SHARE, CURVATURE_SHARE = 1.0, 4.0
#: Of G, the largest pressure in a chamber that is computed: walls of such bodies fold at a sixth of it.
PRESSURE_SHARE = 4.0


def refuse_implausible(name: str, value: float) -> None:
    """Raise a ValueError that names the argument, its range, and the unit that the number may be in."""
    range_ = PLAUSIBLE[name]
    if range_.least <= value <= range_.most:
        return
    other = range_.if_less if value < range_.least else range_.if_more
    hint = "" if other is None else f"; is it in {other}?"
    unit = range_.unit
    raise ValueError(
        f"{name}: got {value:g} {unit}, expected {range_.least:g} to {range_.most:g} {unit}{hint}"
    )


def refuse_moment_beyond(name: str, moment: _Three, shear_modulus: float, diameter: float) -> None:
    """Raise a ValueError for a moment [N m] that no body of that modulus [Pa] and diameter [m] carries."""
    _refuse_beyond(name, moment, MOMENT_SHARE * shear_modulus * diameter**3, "N m", diameter, "N mm")


def refuse_force_beyond(
    name: str, force: _Three, shear_modulus: float, diameter: float, length: float
) -> None:
    """Raise a ValueError for a force [N] whose moment over the body's length [m] no such body carries."""
    most = MOMENT_SHARE * shear_modulus * diameter**3 / length
    _refuse_beyond(name, force, most, "N", diameter, "millinewtons")


def refuse_curvature_beyond(name: str, curvature: _Three, diameter: float) -> None:
    """Raise a ValueError for a curvature [1/m] that no body of that diameter [m] takes."""
    _refuse_beyond(name, curvature, CURVATURE_SHARE / diameter, "1/m", diameter, "degrees per metre")


def _refuse_beyond(name: str, vector: _Three, most: float, unit: str, diameter: float, other: str) -> None:
    size = math.hypot(*vector)
    if size > most:
        raise ValueError(
            f"{name}: got {size:g} {unit}, expected at most {most:.3g} {unit} on a body of "
            f"{1e3 * diameter:g} mm; is it in {other}?"
        )


def refuse_pressure_beyond(pressure: _Three, shear_modulus: float) -> None:
    """Raise a ValueError for a gauge pressure [Pa] that no body of that shear modulus [Pa] holds."""
    most = PRESSURE_SHARE * shear_modulus
    if max(pressure) > most:
        raise ValueError(
            f"pressure: got {pressure!r} Pa, expected each between 0 and {most:.3g} Pa, {PRESSURE_SHARE:g} "
            "shear moduli of the material; is it in another unit?"
        )
