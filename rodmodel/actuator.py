"""Winding, dimensions and masses of an actuator, and the loads inside which its law was calibrated.

Nothing here needs JAX. Numbers are floats, or 0-d arrays of NumPy or JAX where rods are stacked or
differentiated.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import reduce
from typing import Any, final

import numpy as np

# Factor on the limits of the domain: a change of units rounds.
_SLACK = 1.0 + 1e-6
# Largest density of a body [kg/m³], above that of any metal.
_DENSEST = 3e4
_MILLIMETRES = "; is it in millimetres?"
# Plausible ranges in SI: least, most, unit, and the likely mistake behind a larger number. They are wide
# enough for models of unit length and say nothing about what is sensible. Calibration files have their own.
PLAUSIBLE = {
    "body_length": (1e-4, 10.0, "m", _MILLIMETRES),
    "cap_length": (0.0, 2.0, "m", _MILLIMETRES),
    "body_diameter": (1e-6, 2.0, "m", _MILLIMETRES),
    "stiff_tip": (0.0, 2.0, "m", _MILLIMETRES),
    "held_length": (0.0, 2.0, "m", _MILLIMETRES),
    "base_lag": (-2.0, 2.0, "m", _MILLIMETRES),
    "tip_offset": (-1.0, 1.0, "m", _MILLIMETRES),
    "tip_draw": (-10.0, 10.0, "m³", "; is it in cubic millimetres?"),
    "mass_per_length": (0.0, 1e4, "kg/m", "; is it in grams?"),
    "cap_mass": (0.0, 1e4, "kg", "; is it in grams?"),
    "base_turn": (-0.01, 0.01, "rad/Pa", "; is it per kilopascal?"),
    "pitch": (1e-6, 1.0, "m", _MILLIMETRES),
}
# Largest difference between equal angles [rad]: a change of units rounds.
_SAME = 1e-9

#: A float, or a 0-d array where rods are stacked or differentiated by it.
Number = float | Any
#: A sequence or an array of three numbers.
Three = Sequence[Number] | Any


@final
@dataclass(frozen=True)
class Layout:
    """Winding layout: its name, orientation ψ [rad] (None for a law of all orientations), and pitch [m].

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
        so a shift by half a pitch turns ψ into ψ + 180°: together, steps of 60°. Six helices at ψ + 60° are
        those at ψ, shifted by a sixth of a pitch.
        """
        return math.pi / 3.0 if self.name in ("double-helix", "six-helix") else 2.0 * math.pi / 3.0

    @property
    def mirrored_psi(self) -> float | None:
        """ψ of the mirror image y → −y, from 0 to `symmetry` [rad]; None if the section is its own image."""
        if self.psi is None or abs(math.remainder(2.0 * self.psi, self.symmetry)) < _SAME:
            return None
        return -self.psi % self.symmetry


@final
@dataclass(frozen=True)
class Actuator:
    """Dimensions and masses of an actuator, and the effects of its ends.

    Near base and cap, where the section cannot widen freely, the body bends less.

    Attributes
    ----------
    body_length, cap_length, body_diameter : dimensions [m].
    mass_per_length : mass of the body per length [kg/m].
    cap_mass : mass of the cap [kg].
    stiff_tip : length before the cap that does not bend [m].
    base_turn : turn of the base per pressure [rad/Pa], less the free turn over a length `base_lag`.
    base_lag : length whose free turn is subtracted from that of the base [m].
    base_stiffness : bending stiffness of the section for which `base_turn` and `base_lag` hold [N m²]; a
        softer section turns more. Zero: the same turn for all sections.
    base_growth : growth of the base's reach with the softness of the section: one that is s times as soft
        feels the base over 1 + `base_growth` (s - 1) times the length, and turns by as many times more.
    tip_offset : largest distance of the cap from the end of the arc [m].
    tip_offset_curvature : curvature at which the distance is 71 % of the largest [1/m].
    tip_draw : by how much the cap lies nearer to the base, per squared curvature [m³].
    held_length : length, both ends together, over which the chambers keep their volume [m].
    shear_compliance : lean of a section against the axis per transverse force [1/N]; zero for a rod that does
        not shear.

    Raises
    ------
    ValueError
        For a number that is not finite, or seems to be in another unit: see `PLAUSIBLE`.
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
    base_growth: Number = 0.0
    tip_offset: Number = 0.0
    tip_offset_curvature: Number = 1.0
    tip_draw: Number = 0.0
    held_length: Number = 0.0
    shear_compliance: Number = 0.0

    def __post_init__(self) -> None:
        """Refuse numbers that seem to be in another unit."""
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
        """Length of the body up to its stiff tip [m]."""
        return self.body_length - self.stiff_tip

    @property
    def tip_length(self) -> Number:
        """Length from the stiff tip's start to the cap's outer face [m]."""
        return self.cap_length + self.stiff_tip


@final
@dataclass(frozen=True)
class Domain:
    """Loads inside which the law was calibrated.

    Attributes
    ----------
    pressure_max : largest pressure of each chamber [Pa].
    pressure_sum_max : largest sum of the three pressures [Pa].
    moment_max : largest bending moment on a section [N m].
    torque_max : largest torque on a section [N m]; None if it equals `moment_max`. Moments are inside if they
        lie in the ellipsoid with these half axes.
    beside_share, beside_max : the more pressure one chamber has, the less may those beside it have. The
        pressure of each and this share of the sum of the two others are together at most `beside_max` [Pa],
        which is infinite if there is no such limit.
    pressure_min : least pressure of each chamber [Pa], for a branch that ends below; 0 if it has none.
    single_max, single_beside : beyond all these limits, largest pressure of each chamber while each of the
        two others has at most `single_beside` [Pa]; 0 if a chamber alone has no more than beside others.

    Raises
    ------
    ValueError
        For plain numbers that are negative or NaN, and for pressures that are not three.
    """

    pressure_max: tuple[Number, Number, Number]
    pressure_sum_max: Number
    moment_max: Number
    torque_max: Number | None = None
    beside_share: Number = 0.0
    beside_max: Number = math.inf
    pressure_min: tuple[Number, Number, Number] = (0.0, 0.0, 0.0)
    single_max: tuple[Number, Number, Number] = (0.0, 0.0, 0.0)
    single_beside: Number = 0.0

    def __post_init__(self) -> None:
        """Refuse numbers that are no limits."""
        for name in ("pressure_max", "pressure_min", "single_max"):
            if len(getattr(self, name)) != 3:
                raise ValueError(
                    f"{name}: got {len(getattr(self, name))} numbers, expected three pressures [Pa]"
                )
        for name, value in vars(self).items():
            for number in value if isinstance(value, tuple) else (value,):
                if _is_number(number) and not number >= 0.0:
                    raise ValueError(f"{name}: got {number:g}, expected 0 or more")

    @property
    def moment_axes(self) -> tuple[Number, Number, Number]:
        """Half axes of the ellipsoid of moments, body frame [N m]."""
        torque = self.moment_max if self.torque_max is None else self.torque_max
        return self.moment_max, self.moment_max, torque

    def covers_pressure(self, pressure: Three) -> Any:
        """Return whether three pressures [Pa] are inside, with a slack for the rounding of units."""
        first, second, third = pressure
        total = first + second + third
        inside = total <= _SLACK * self.pressure_sum_max
        for p, maximum in zip(pressure, self.pressure_max, strict=True):
            inside &= p <= _SLACK * maximum
            inside &= p + self.beside_share * (total - p) <= _SLACK * self.beside_max
        for p, minimum in zip(pressure, self.pressure_min, strict=True):
            inside &= (minimum <= 0.0) | (_SLACK * p >= minimum)
        for (a, b, c), maximum in zip(_alone(pressure), self.single_max, strict=True):
            alone = (b <= _SLACK * self.single_beside) & (c <= _SLACK * self.single_beside)
            inside |= (maximum > 0.0) & alone & (a <= _SLACK * maximum)
        return inside

    def reach(self, pressure: Three) -> float:
        """Return the largest factor on three pressures [Pa] for which they are within the upper limits.

        It is below one for pressures beyond them, infinite without pressure, and NaN if one of them is.
        """
        given = tuple(float(p) for p in pressure)
        use = float(self.utilisation(given))
        if math.isnan(use):
            return math.nan
        factors = [1.0 / use if use > 0.0 else math.inf]
        for (own, *others), maximum in zip(_alone(given), self.single_max, strict=True):
            if own > 0.0 and maximum > 0.0:
                besides = [self.single_beside / p for p in others if p > 0.0]
                factors.append(min([maximum / own, *besides]))
        return float(max(factors))

    def utilisation(self, pressure: Three) -> Any:
        """Return the largest share of an upper limit that three pressures [Pa] use, `single_max` left aside.

        Each of the three may be an array of numbers, one for each row of pressures.
        """
        first, second, third = pressure
        total = first + second + third
        uses = [total / self.pressure_sum_max]
        for p, maximum in zip(pressure, self.pressure_max, strict=True):
            uses += [p / maximum, (p + self.beside_share * (total - p)) / self.beside_max]
        return reduce(np.maximum, uses)

    def largest_pressures(self, unit: str) -> str:
        """Return the limits of the pressures in words, in Pa or kPa. Each rod of a stack has its own."""
        factor = {"Pa": 1.0, "kPa": 1e-3}[unit]
        limits = (*self.pressure_max, self.pressure_sum_max, self.beside_max)
        first, second, third, total, beside = (
            f"{factor * p:g}" if _is_number(p) else "its largest" for p in limits
        )
        each = f"{first}, {second}, {third} {unit} in chambers 1, 2, 3"
        if any(not _is_number(p) or p > 0.0 for p in self.pressure_min):
            least = ", ".join(f"{factor * p:g}" if _is_number(p) else "its least" for p in self.pressure_min)
            each += f" (at least {least} {unit})"
        alone = ""
        if any(not _is_number(p) or p > 0.0 for p in self.single_max):
            most = ", ".join(f"{factor * p:g}" if _is_number(p) else "its largest" for p in self.single_max)
            least = f"{factor * self.single_beside:g}" if _is_number(self.single_beside) else "its least"
            alone = f"; alone, with {least} {unit} in each of the others, up to {most} {unit}"
        if _is_number(self.beside_max) and math.isinf(self.beside_max):
            return f"{each} and {total} {unit} in sum{alone}"
        share = f"{self.beside_share:g}" if _is_number(self.beside_share) else "its share"
        besides = f"{beside} {unit} in each with {share} of the two others"
        return f"{each}, {total} {unit} in sum, and {besides}{alone}"

    def covers_moment(self, moment: Three) -> Any:
        """Return whether a moment [N m], body frame, is inside."""
        x, y, z = (m / axis for m, axis in zip(moment, self.moment_axes, strict=True))
        return x * x + y * y + z * z <= _SLACK**2


def _alone(pressure: Three) -> tuple[tuple[Number, Number, Number], ...]:
    """Return each pressure with the two others."""
    first, second, third = pressure
    return (first, second, third), (second, third, first), (third, first, second)


def _is_number(value: Number) -> bool:
    """Return whether a value is a plain number and not an array of stacked rods."""
    return isinstance(value, float | int)


def _refuse_implausible(name: str, value: Number) -> None:
    least, most, unit, hint = PLAUSIBLE[name]
    if _is_number(value) and not least <= value <= most:
        remedy = hint if value > most else ""
        raise ValueError(f"{name}: got {value:g} {unit}, expected {least:g} to {most:g} {unit}{remedy}")
