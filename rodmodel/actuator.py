"""What a rod is made of and where it was calibrated: winding, lengths and masses, largest loads.

Nothing here needs JAX. Numbers are floats, or 0-d arrays of NumPy or JAX where rods are stacked or
differentiated.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, final

_SLACK = 1.0 + 1e-6
# Densest body [kg/m³]: heavier than any metal.
_DENSEST = 3e4
_MILLIMETRES = "; is it in millimetres?"
# What a number in SI may be: least, most, unit, and what one beyond is likely to be. Wide enough for models
# of unit length, and no statement of what is sensible. Calibration files have ranges of their own.
PLAUSIBLE = {
    "body_length": (1e-4, 10.0, "m", _MILLIMETRES),
    "cap_length": (0.0, 2.0, "m", _MILLIMETRES),
    "body_diameter": (1e-6, 2.0, "m", _MILLIMETRES),
    "stiff_tip": (0.0, 2.0, "m", _MILLIMETRES),
    "held_length": (0.0, 2.0, "m", _MILLIMETRES),
    "base_lag": (-2.0, 2.0, "m", _MILLIMETRES),
    "tip_offset": (-1.0, 1.0, "m", _MILLIMETRES),
    "mass_per_length": (0.0, 1e4, "kg/m", "; is it in grams?"),
    "cap_mass": (0.0, 1e4, "kg", "; is it in grams?"),
    "base_turn": (-0.01, 0.01, "rad/Pa", "; is it per kilopascal?"),
    "pitch": (1e-6, 1.0, "m", _MILLIMETRES),
}
_SAME = 1e-9  # but for the rounding of a change of units [rad]

#: Of one rod; a 0-d array where rods are stacked or differentiated by it.
Number = float | Any
#: Of three numbers, or an array of them.
Three = Sequence[Number] | Any


@final
@dataclass(frozen=True)
class Layout:
    """Winding layout: its name, orientation ψ [rad], None for a law of all, and pitch [m].

    Raises
    ------
    ValueError
        For a pitch in another unit.
    """

    name: str
    psi: float | None
    pitch: float

    def __post_init__(self) -> None:
        _refuse_implausible("pitch", self.pitch)

    @property
    def symmetry(self) -> float:
        """Step of ψ between sections that differ only in how their chambers are numbered [rad].

        A turn by 120° renumbers the chambers. The double helix crosses itself every 180°, half a pitch apart,
        so that a shift by half a pitch makes ψ + 180° of ψ: together, steps of 60°. Six helices are the same
        at ψ + 60° but for a shift by a sixth of a pitch.
        """
        return math.pi / 3.0 if self.name in ("double-helix", "six-helix") else 2.0 * math.pi / 3.0

    @property
    def mirrored_psi(self) -> float | None:
        """ψ of the mirror image y → −y, from 0 to `symmetry` [rad]; None where it is the section itself."""
        if self.psi is None or abs(math.remainder(2.0 * self.psi, self.symmetry)) < _SAME:
            return None
        return -self.psi % self.symmetry


@final
@dataclass(frozen=True)
class Actuator:
    """Lengths and masses of an actuator, and what its ends do.

    Near base and cap, where the section cannot widen freely, the body bends less.

    Attributes
    ----------
    body_length, cap_length, body_diameter : [m].
    mass_per_length : of the body [kg/m].
    cap_mass : [kg].
    stiff_tip : length before the cap that does not bend at all [m].
    base_turn : by which the base turns with the pressures [rad/Pa], less by the free turn of a length
        `base_lag` [m].
    base_lag : see `base_turn` [m].
    base_stiffness : bending stiffness of the section for which both hold [N m²]; they are more for a softer
        one. Zero: the same for all.
    tip_offset : by up to how much the cap lies beside the arc [m].
    tip_offset_curvature : curvature at which it is 71 % of that [1/m].
    held_length : length of both ends together over which the chambers keep their volume [m].
    shear_compliance : by how much sections lean against the axis for each newton across them [1/N]; zero for
        a rod that does not shear.

    Raises
    ------
    ValueError
        For a number that is not finite, or in another unit: see `PLAUSIBLE`.
    """

    body_length: Number
    cap_length: Number
    body_diameter: Number
    mass_per_length: Number
    cap_mass: Number
    stiff_tip: Number = 0.0
    base_turn: Number = 0.0
    base_lag: Number = 0.0
    base_stiffness: Number = 0.0
    tip_offset: Number = 0.0
    tip_offset_curvature: Number = 1.0
    held_length: Number = 0.0
    shear_compliance: Number = 0.0

    def __post_init__(self) -> None:
        """Refuse what is in another unit."""
        for name in PLAUSIBLE.keys() - {"pitch"}:
            _refuse_implausible(name, getattr(self, name))
        lengths = (self.body_length, self.cap_length, self.body_diameter)
        if not all(map(_is_number, (*lengths, self.mass_per_length, self.cap_mass))):
            return
        area = 0.25 * math.pi * self.body_diameter**2
        # A cap of no length may stand for a mass at the end of the body, such as a gripper's.
        held = {"mass_per_length": area, "cap_mass": area * (self.cap_length + self.body_length)}
        for name, volume in held.items():
            most, value, unit = _DENSEST * volume, getattr(self, name), PLAUSIBLE[name][2]
            if value > most:
                raise ValueError(
                    f"{name}: got {value:g} {unit}, expected at most {most:.3g} {unit} for a body of "
                    f"{1e3 * self.body_diameter:g} mm diameter; is it in grams?"
                )

    @property
    def bending_length(self) -> Number:
        """Length of the body up to its stiff end [m]."""
        return self.body_length - self.stiff_tip

    @property
    def tip_length(self) -> Number:
        """From where the body ends to bend to the cap's outer face [m]."""
        return self.cap_length + self.stiff_tip


@final
@dataclass(frozen=True)
class Domain:
    """Loads inside which the law was calibrated.

    Attributes
    ----------
    pressure_max : of each chamber [Pa].
    pressure_sum_max : of the three chambers together [Pa].
    moment_max : bending moment on a section [N m].
    torque_max : torque on a section [N m]; None where it is as large as the bending moment. The moments
        inside are those of the ellipsoid with these half axes.
    """

    pressure_max: tuple[Number, Number, Number]
    pressure_sum_max: Number
    moment_max: Number
    torque_max: Number | None = None

    @property
    def moment_axes(self) -> tuple[Number, Number, Number]:
        """Half axes of the ellipsoid of moments, body frame [N m]."""
        torque = self.moment_max if self.torque_max is None else self.torque_max
        return self.moment_max, self.moment_max, torque

    def covers_pressure(self, pressure: Three) -> Any:
        """Whether three pressures [Pa] are inside, the rounding of a change of units left aside."""
        first, second, third = pressure
        below = [p <= _SLACK * maximum for p, maximum in zip(pressure, self.pressure_max, strict=True)]
        return below[0] & below[1] & below[2] & (first + second + third <= _SLACK * self.pressure_sum_max)

    def covers_moment(self, moment: Three) -> Any:
        """Whether a moment [N m], body frame, is inside."""
        x, y, z = (m / axis for m, axis in zip(moment, self.moment_axes, strict=True))
        return x * x + y * y + z * z <= _SLACK**2


def _is_number(value: Number) -> bool:
    """Whether it is a plain number; arrays of stacked rods are taken as they are."""
    return isinstance(value, float | int)


def _refuse_implausible(name: str, value: Number) -> None:
    least, most, unit, hint = PLAUSIBLE[name]
    if _is_number(value) and not least <= value <= most:
        remedy = hint if value > most else ""
        raise ValueError(f"{name}: got {value:g} {unit}, expected {least:g} to {most:g} {unit}{remedy}")
