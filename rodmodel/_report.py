"""Results for people and files: millimetres, kilopascals and degrees, as the names say."""

import math
from typing import Any

import numpy as np
from jaxtyping import Array

from rodmodel._inverse import Inverse
from rodmodel._solution import Solution
from rodmodel._workspace import Workspace
from rodmodel.calibration_file import Calibration

# The farthest bend is looked for in so wide sectors of planes.
_PLANE_STEP_DEG = 15


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
        # The only one that section laws know: their domains end before walls snap.
        "branch": "loading" if solution.in_domain else None,
        "stable": bool(solution.stable),
    }


def prediction_text(record: dict[str, Any]) -> str:
    """Prediction for people, of its record."""
    error = record["error_estimate"]["bending_angle_deg"]
    if error is None:
        trust = "the moment in the rod is beyond the calibration: an extrapolation"
    else:
        trust = f"90 % of states within {error:.2g} deg of the FEM"
    branch = (
        "unknown" if record["branch"] is None else "loading: pressures have only risen, no wall has snapped"
    )
    return "\n".join(
        [
            f"bending angle    {_row([record['bending_angle_deg']])} deg   ({trust})",
            f"bending plane    {_row([record['bending_plane_deg']])} deg",
            f"tip position     {_row(record['tip_position_mm'])} mm    (centre of the cap's outer face)",
            f"chamber volumes  {_row(record['chamber_volume_mm3'])} mm3",
            f"branch              {branch}; the rod is {'stable' if record['stable'] else 'not stable'}",
        ]
    )


def inverse_record(found: Inverse, is_bend: bool) -> dict[str, Any]:
    """Pressures, how near they come, and the prediction for them, as a JSON object."""
    distance = float(found.distance)
    left = {"distance_deg": math.degrees(distance)} if is_bend else {"distance_mm": 1e3 * distance}
    return {
        "pressure_kpa": [_number(p) for p in 1e-3 * np.asarray(found.pressure)],
        "reached": bool(found.reached),
        **{name: _number(value) for name, value in left.items()},
        **prediction_record(found.solution),
        "converged": bool(found.converged),
    }


def inverse_text(record: dict[str, Any]) -> str:
    """Pressures and the prediction for them, for people, of their record."""
    return "\n".join(
        [f"pressures        {_row(record['pressure_kpa'])} kPa", prediction_text(record)],
    )


def workspace_record(space: Workspace) -> dict[str, Any]:
    """What a rod reaches, and the samples, as a JSON object; samples without an equilibrium are left out."""
    good = space.converged
    angle = np.degrees(space.bending_angle[good])
    plane = np.degrees(space.bending_plane[good])
    tip = 1e3 * space.tip_position[good]
    pressure = 1e-3 * space.pressure[good]
    farthest = []
    for towards in range(0, 360, _PLANE_STEP_DEG):
        near = np.abs(np.mod(plane - towards + 180.0, 360.0) - 180.0) <= 0.5 * _PLANE_STEP_DEG
        if near.any():
            row = np.argmax(np.where(near, angle, -1.0))
            farthest.append(
                {
                    "bending_plane_deg": float(plane[row]),
                    "bending_angle_deg": float(angle[row]),
                    "pressure_kpa": pressure[row].tolist(),
                }
            )
    return {
        "samples": int(good.sum()),
        "not_converged": int((~good).sum()),
        "in_domain": int(space.in_domain[good].sum()),
        "tip_min_mm": tip.min(axis=0).tolist() if good.any() else None,
        "tip_max_mm": tip.max(axis=0).tolist() if good.any() else None,
        "farthest_bends": farthest,
        "pressure_kpa": pressure.tolist(),
        "tip_position_mm": tip.tolist(),
        "bending_angle_deg": angle.tolist(),
        "bending_plane_deg": plane.tolist(),
    }


def workspace_text(record: dict[str, Any]) -> str:
    """What a rod reaches, for people, of its record."""
    lines = [
        f"samples          {record['samples']:10d}   "
        f"({record['in_domain']} with moments inside the calibration)",
        f"tip, least       {_row(record['tip_min_mm'])} mm",
        f"tip, most        {_row(record['tip_max_mm'])} mm",
        f"farthest bends, every {_PLANE_STEP_DEG} deg of the plane:",
        "   plane [deg]  angle [deg]   pressures [kPa]",
    ]
    lines += [
        f"  {bend['bending_plane_deg']:12.1f} {bend['bending_angle_deg']:12.1f}   "
        + " ".join(f"{p:5.1f}" for p in bend["pressure_kpa"])
        for bend in record["farthest_bends"]
    ]
    return "\n".join(lines)


def calibration_record(calibration: Calibration) -> dict[str, Any]:
    """Layout, validity and error of a calibration as a JSON object."""
    layout, domain = calibration.layout, calibration.domain
    angle = calibration.error["free_bending_angle_rad"]
    return {
        "layout": layout.name,
        "psi_deg": None if layout.psi is None else math.degrees(layout.psi),
        "psi_mirrored_deg": None if layout.mirrored_psi is None else math.degrees(layout.mirrored_psi),
        "psi_step_deg": math.degrees(layout.symmetry),
        "pitch_mm": 1e3 * layout.pitch,
        "pressure_max_kpa": [1e-3 * pressure for pressure in domain.pressure_max],
        "pressure_sum_max_kpa": 1e-3 * domain.pressure_sum_max,
        "moment_max_nmm": 1e3 * domain.moment_max,
        "torque_max_nmm": 1e3 * domain.moment_axes[2],
        "error": {
            "bending_angle_deg": {name: math.degrees(angle[name]) for name in ("median", "p95", "worst")}
        },
        "provenance": dict(calibration.provenance),
    }


def layout_text(record: dict[str, Any]) -> str:
    """Layout and the orientations that its calibration serves, of the calibration's record."""
    if record["psi_deg"] is None:
        return f"{record['layout']}, pitch {record['pitch_mm']:g} mm, any psi"
    psi, mirrored = f"psi {record['psi_deg']:g}", record["psi_mirrored_deg"]
    if mirrored is not None:
        psi += f" and {mirrored:g}"
    step = f"every {record['psi_step_deg']:g} deg from {'it' if mirrored is None else 'them'}"
    return f"{record['layout']}, pitch {record['pitch_mm']:g} mm, {psi} deg and {step}"


def calibration_text(record: dict[str, Any]) -> str:
    """Calibration for people, of its record."""
    first, second, third = record["pressure_max_kpa"]
    angle = record["error"]["bending_angle_deg"]
    return "\n".join(
        [
            layout_text(record),
            f"  pressures  up to {first:g}, {second:g}, {third:g} kPa in chambers 1, 2, 3, "
            f"{record['pressure_sum_max_kpa']:g} kPa in sum",
            f"  moments    up to {record['moment_max_nmm']:g} N mm, "
            f"torques up to {record['torque_max_nmm']:g} N mm",
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
