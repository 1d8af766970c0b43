"""Results for people and files: millimetres, kilopascals and degrees, as the names say."""

import math
from typing import Any

import numpy as np
from jaxtyping import Array

from rodmodel._solution import Solution
from rodmodel.calibration_file import Calibration


def prediction_record(solution: Solution) -> dict[str, Any]:
    """Prediction as a JSON object; what is not known is null."""
    return {
        "bending_angle_deg": _degrees(solution.bending_angle),
        "bending_plane_deg": _degrees(solution.bending_plane),
        "tip_position_mm": [_number(x) for x in 1e3 * np.asarray(solution.tip_position)],
        "chamber_volume_mm3": [_number(x) for x in 1e9 * np.asarray(solution.chamber_volume)],
        "converged": bool(solution.converged),
        "in_domain": bool(solution.in_domain),
        "error_estimate": {"bending_angle_deg": _degrees(solution.error_estimate)},
    }


def prediction_text(record: dict[str, Any]) -> str:
    """Prediction for people, of its record."""
    error = record["error_estimate"]["bending_angle_deg"]
    if error is None:
        trust = "the moment in the rod is beyond the calibration: an extrapolation"
    else:
        trust = f"95 % of held-out states within {error:.2g} deg of the FEM"
    return "\n".join(
        [
            f"bending angle    {_row([record['bending_angle_deg']])} deg   ({trust})",
            f"bending plane    {_row([record['bending_plane_deg']])} deg",
            f"tip position     {_row(record['tip_position_mm'])} mm    (centre of the cap's outer face)",
            f"chamber volumes  {_row(record['chamber_volume_mm3'])} mm3",
        ]
    )


def calibration_record(calibration: Calibration) -> dict[str, Any]:
    """Layout, validity and error of a calibration as a JSON object."""
    layout, domain = calibration.layout, calibration.domain
    angle = calibration.error["free_bending_angle_rad"]
    return {
        "layout": layout.name,
        "psi_deg": math.degrees(layout.psi),
        "psi_step_deg": math.degrees(layout.symmetry),
        "pitch_mm": 1e3 * layout.pitch,
        "pressure_max_kpa": [1e-3 * pressure for pressure in domain.pressure_max],
        "pressure_sum_max_kpa": 1e-3 * domain.pressure_sum_max,
        "moment_max_nmm": 1e3 * domain.moment_max,
        "error": {
            "bending_angle_deg": {name: math.degrees(angle[name]) for name in ("median", "p95", "worst")}
        },
        "provenance": dict(calibration.provenance),
    }


def calibration_text(record: dict[str, Any]) -> str:
    """Calibration for people, of its record."""
    first, second, third = record["pressure_max_kpa"]
    angle = record["error"]["bending_angle_deg"]
    return "\n".join(
        [
            f"{record['layout']}, pitch {record['pitch_mm']:g} mm, "
            f"psi {record['psi_deg']:g} deg and every {record['psi_step_deg']:g} deg from it",
            f"  pressures  up to {first:g}, {second:g}, {third:g} kPa in chambers 1, 2, 3, "
            f"{record['pressure_sum_max_kpa']:g} kPa in sum",
            f"  moments    up to {record['moment_max_nmm']:g} N mm",
            "  error      of the bending angle against the FEM, held-out states: "
            f"median {angle['median']:.2g}, 95th percentile {angle['p95']:.2g}, "
            f"worst {angle['worst']:.2g} deg",
        ]
    )


def _number(value: float) -> float | None:
    return float(value) if math.isfinite(value) else None


def _degrees(angle: Array) -> float | None:
    return _number(math.degrees(float(angle)))


def _row(values: list[float | None]) -> str:
    return " ".join(f"{'unknown':>10s}" if value is None else f"{value:10.3f}" for value in values)
