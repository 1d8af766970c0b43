"""A calibration as text and JSON, in the units that their names say: mm, kPa, degrees."""

import math
from typing import Any

from rodmodel.io.calibration_file import Calibration


def calibration_record(calibration: Calibration) -> dict[str, Any]:
    """Return layout, domain and error of a calibration as a JSON object."""
    layout, domain = calibration.layout, calibration.domain
    angle = calibration.error["free_bending_angle_rad"]
    mirrored = None if calibration.law.is_adjusted else layout.mirrored_psi
    limited = domain.beside_max < math.inf
    return {
        "layout": layout.name,
        "psi_deg": None if layout.psi is None else math.degrees(layout.psi),
        "psi_mirrored_deg": None if mirrored is None else math.degrees(mirrored),
        "psi_step_deg": math.degrees(layout.symmetry),
        "pitch_mm": 1e3 * layout.pitch,
        "pressure_max_kpa": [1e-3 * pressure for pressure in domain.pressure_max],
        "pressure_sum_max_kpa": 1e-3 * domain.pressure_sum_max,
        "pressure_beside_share": domain.beside_share if limited else None,
        "pressure_beside_max_kpa": 1e-3 * domain.beside_max if limited else None,
        "single_max_kpa": [1e-3 * p for p in domain.single_max] if any(domain.single_max) else None,
        "single_beside_kpa": 1e-3 * domain.single_beside if any(domain.single_max) else None,
        "moment_max_nmm": 1e3 * domain.moment_max,
        "torque_max_nmm": 1e3 * domain.moment_axes[2],
        "jumps": [
            {
                "chamber": jump.chamber,
                "stood_kpa": 1e-3 * jump.stood,
                "jumped_kpa": None if jump.jumped is None else 1e-3 * jump.jumped,
                "run": jump.run,
                "mesh": jump.mesh,
            }
            for jump in calibration.jumps
        ],
        "error": {
            "bending_angle_deg": {name: math.degrees(angle[name]) for name in ("median", "p95", "worst")}
        },
        "provenance": dict(calibration.provenance),
    }


def layout_text(record: dict[str, Any]) -> str:
    """Return the text of a record's layout and of the orientations that the calibration serves."""
    if record["psi_deg"] is None:
        return f"{record['layout']}, pitch {record['pitch_mm']:g} mm, any psi"
    psi, mirrored = f"psi {record['psi_deg']:g}", record["psi_mirrored_deg"]
    if mirrored is not None:
        psi += f" and {mirrored:g}"
    step = f"every {record['psi_step_deg']:g} deg from {'it' if mirrored is None else 'them'}"
    return f"{record['layout']}, pitch {record['pitch_mm']:g} mm, {psi} deg and {step}"


def calibration_text(record: dict[str, Any]) -> str:
    """Return the text of a calibration's record."""
    first, second, third = record["pressure_max_kpa"]
    angle = record["error"]["bending_angle_deg"]
    share, beside = record["pressure_beside_share"], record["pressure_beside_max_kpa"]
    limit = "" if beside is None else f", {beside:g} kPa in each with {share:g} of the two others"
    if record["single_max_kpa"] is not None:
        alone = ", ".join(f"{p:g}" for p in record["single_max_kpa"])
        few = f"{record['single_beside_kpa']:g} kPa in the others"
        limit += f";\n             alone, with {few}, up to {alone} kPa"
    return "\n".join(
        [
            layout_text(record),
            f"  pressures  up to {first:g}, {second:g}, {third:g} kPa in chambers 1, 2, 3, "
            f"{record['pressure_sum_max_kpa']:g} kPa in sum{limit}",
            f"  moments    up to {record['moment_max_nmm']:g} N mm, "
            f"torques up to {record['torque_max_nmm']:g} N mm",
            "  error      of the bending angle against the FEM, held-out states: "
            f"median {angle['median']:.2g}, 95th percentile {angle['p95']:.2g}, "
            f"worst {angle['worst']:.2g} deg",
            *([_jumps_text(record["jumps"])] if record["jumps"] else []),
        ]
    )


def _jumps_text(jumps: list[dict[str, Any]]) -> str:
    """Return where the full actuator jumped, or stood, under each chamber alone."""
    told = [
        f"chamber {jump['chamber']} stood at {jump['stood_kpa']:g} kPa"
        + ("" if jump["jumped_kpa"] is None else f" and had jumped at {jump['jumped_kpa']:g}")
        for jump in jumps
    ]
    return "  jumps      of the full actuator, one chamber alone: " + ";\n             ".join(told)
