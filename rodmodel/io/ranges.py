"""Ranges of the numbers in a calibration file, in one table for the reader and the manual.

A file may come from anywhere, and its numbers reach compiled code. The ranges exclude numbers that no
actuator has; they say nothing about the quality of a calibration.
"""

from collections.abc import Mapping
from typing import NamedTuple


class Range(NamedTuple):
    """Numbers from `least` to `most`, both included."""

    least: float
    most: float
    unit: str
    null: bool = False
    """Whether null is allowed."""
    optional: bool = False
    """Whether the key may be missing."""

    @property
    def expected(self) -> str:
        """Range in words, for an error message."""
        unit = f" {self.unit}" if self.unit else ""
        return f"a number from {self.least:g} to {self.most:g}{unit}{' or null' if self.null else ''}"

    def holds(self, value: float | int) -> bool:
        """Return whether a number is in the range; NaN is not."""
        return self.least <= value <= self.most


_ANGLE_ERROR = Range(0.0, 10.0, "rad")
_PRESSURE = Range(1e-3, 1e8, "Pa")

#: Ranges by key; that of a list, such as `pressure_max_pa`, holds for each of its numbers.
RANGES: Mapping[str, Range] = {
    "layout.psi_rad": Range(-100.0, 100.0, "rad", null=True),
    "layout.pitch_m": Range(1e-6, 1.0, "m"),
    "actuator.body_length_m": Range(1e-4, 10.0, "m"),
    "actuator.cap_length_m": Range(0.0, 10.0, "m"),
    "actuator.body_diameter_m": Range(1e-6, 10.0, "m"),
    "actuator.mass_per_length_kg_per_m": Range(0.0, 1e4, "kg/m"),
    "actuator.cap_mass_kg": Range(0.0, 1e4, "kg"),
    "actuator.stiff_tip_m": Range(0.0, 10.0, "m", optional=True),
    "actuator.base_turn_rad_per_pa": Range(-0.01, 0.01, "rad/Pa", optional=True),
    "actuator.base_lag_m": Range(-10.0, 10.0, "m", optional=True),
    "actuator.base_stiffness_n_m2": Range(0.0, 1e6, "N m2", optional=True),
    "actuator.base_growth": Range(0.0, 10.0, "", optional=True),
    "actuator.tip_offset_m": Range(-1.0, 1.0, "m", optional=True),
    "actuator.tip_offset_curvature_per_m": Range(1e-6, 1e6, "1/m", optional=True),
    "actuator.tip_draw_m3": Range(-10.0, 10.0, "m3", optional=True),
    "actuator.held_length_m": Range(0.0, 10.0, "m", optional=True),
    "actuator.shear_compliance_per_n": Range(0.0, 1e4, "1/N", optional=True),
    "section_law.pressure_scale_pa": _PRESSURE,
    "section_law.curvature_scale_per_m": Range(1e-3, 1e6, "1/m"),
    "section_law.energy_scale_n": Range(1e-12, 1e9, "N"),
    "section_law.rest_volume_m2": Range(1e-12, 10.0, "m2"),
    "domain.pressure_max_pa": _PRESSURE,
    "domain.pressure_sum_max_pa": _PRESSURE,
    "domain.pressure_beside_share": Range(0.0, 1.0, "", optional=True),
    "domain.pressure_beside_max_pa": _PRESSURE._replace(optional=True),
    "domain.pressure_min_pa": Range(0.0, 1e8, "Pa", optional=True),
    "domain.single_max_pa": Range(0.0, 1e8, "Pa", optional=True),
    "domain.single_beside_pa": Range(0.0, 1e8, "Pa", optional=True),
    "domain.moment_max_nm": Range(1e-12, 1e6, "N m"),
    "domain.torque_max_nm": Range(1e-12, 1e6, "N m", null=True),
    "bound.pressure_sum_pa": Range(0.0, 3e8, "Pa", optional=True),
    "bound.angle_rad": _ANGLE_ERROR._replace(optional=True),
    "bound.tip_m": Range(0.0, 10.0, "m", optional=True),
    "bound.angle_rad_per_nm": Range(0.0, 1e9, "rad/(N m)", optional=True),
    "bound.bending_angle_rad": Range(0.0, 1e3, "rad", optional=True),
    "bound.angle_by_bend_rad": _ANGLE_ERROR._replace(optional=True),
    "bound.tip_by_bend_m": Range(0.0, 10.0, "m", optional=True),
    "bound.tip_per_n": Range(0.0, 1e9, "1/N", optional=True),
    "error.free_bending_angle_rad.median": _ANGLE_ERROR,
    "error.free_bending_angle_rad.p90": _ANGLE_ERROR._replace(optional=True),
    "error.free_bending_angle_rad.p95": _ANGLE_ERROR,
    "error.free_bending_angle_rad.worst": _ANGLE_ERROR,
    "error.actuator_angle_rad.p90": _ANGLE_ERROR._replace(optional=True),
    "error.measured_angle_rad.p90": _ANGLE_ERROR._replace(optional=True),
    "error.actuator.angle_rad": _ANGLE_ERROR._replace(optional=True),
    "error.actuator.tip_m": Range(0.0, 10.0, "m", optional=True),
}

#: Ranges of adjustment files, which `rodmodel.io.adjustment_file` reads; for their layout, those above.
ADJUSTMENT_RANGES: Mapping[str, Range] = {
    "wall.radius_m": Range(1e-6, 10.0, "m"),
    "wall.thickness_m": Range(1e-7, 1.0, "m"),
    "wall.shear_modulus_pa": Range(1.0, 1e9, "Pa"),
    "parameters.stiffness_scale": Range(0.01, 100.0, ""),
    **{f"parameters.pressure_gain_{k}": Range(0.01, 100.0, "") for k in (1, 2, 3)},
    **{f"parameters.pressure_offset_{k}_pa": Range(-1e8, 1e8, "Pa") for k in (1, 2, 3)},
    **{f"parameters.wall_variation_{k}": Range(-1.0, 100.0, "") for k in (1, 2, 3)},
}

#: Range of each number of the law's arrays.
ARRAY_NUMBER = Range(-1e9, 1e9, "")


def ranges_table(ranges: Mapping[str, Range] = RANGES) -> str:
    """Return the manual's Markdown table of ranges."""
    rows = ["| key | from | to | unit | |", "|---|---|---|---|---|"]
    arrays = [("each number of the law's arrays", ARRAY_NUMBER)] if ranges is RANGES else []
    for key, range_ in [*ranges.items(), *arrays]:
        notes = ["or null"] * range_.null + ["may be missing"] * range_.optional
        name = f"`{key}`" if key in ranges else key
        rows.append(f"| {name} | {range_.least:g} | {range_.most:g} | {range_.unit} | {', '.join(notes)} |")
    return "\n".join(rows)
