"""`rodmodel-calibrate ends` and `judge`: stiff ends from the full actuator, and the rod against it."""

import argparse
import json
import math
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

from calibration.cli._arguments import GOOD, BadInputError, Parser, not_negative
from calibration.cli._files import read_truth

_ROWS = {
    "tip_percent": "tip, % of length",
    "angle_deg": "bending angle to 150 deg [deg]",
    "loaded_tip_percent": "tip under loads, % of length",
    "loaded_angle_deg": "bending angle under loads [deg]",
    "plane_deg": "bending plane [deg]",
    "response_percent": "way under a tip force, % of it",
    "volume_mm3": "chamber volumes [mm3]",
}

_ENDS = {
    "base_turn": ("turn of the base", "mrad/kPa", 1e6),
    "base_lag": ("less the turn of", "mm", 1e3),
    "stiff_tip": ("stiff tip", "mm", 1e3),
    "tip_offset": ("cap aside, at most", "mm", 1e3),
    "tip_offset_curvature": ("at about a curvature of", "1/m", 1.0),
    "held_length": ("chambers held over", "mm", 1e3),
}


def add_to(commands: "argparse._SubParsersAction[Parser]") -> list[Parser]:
    """Add the commands."""
    ends = commands.add_parser(
        "ends", help="fit what the ends do to the fit runs of the truth, and write it into files"
    )
    ends.add_argument("truth", help="netCDF file that `truth --gather` wrote")
    ends.add_argument("files", nargs="*", metavar="FILE", help="calibration files to write them into")
    ends.add_argument(
        "--end-compliance-mm-per-n",
        type=not_negative,
        default=None,
        metavar="C",
        help="of the cell in the middle (default: as in `run`)",
    )
    ends.set_defaults(command=_ends)
    judge = commands.add_parser("judge", help="shipped rods against the judge runs of the full actuator")
    judge.add_argument("truth", help="netCDF file that `truth --gather` wrote")
    judge.add_argument(
        "--role", default="judge", choices=["judge", "fit"], help="of the runs (default: %(default)s)"
    )
    judge.set_defaults(command=_judge)
    return [ends, judge]


def _ends(options: argparse.Namespace, command: str) -> int:
    from calibration.ends import fit_compliance, fit_ends, fit_shear
    from calibration.provenance import code_version, sha256, today
    from calibration.run import END_COMPLIANCE
    from calibration.truth import TruthError
    from fem_reference import ActuatorGeometry
    from rodmodel import read_calibration, save_calibration

    truth, geometry = read_truth(options.truth), ActuatorGeometry()
    told = options.end_compliance_mm_per_n
    compliance = END_COMPLIANCE if told is None else 1e-3 * told
    try:
        calibrations = {file: read_calibration(file) for file in options.files}
        shear = fit_shear(truth)
        found = fit_compliance(truth, geometry.body_length, compliance or END_COMPLIANCE)
        ends = fit_ends(truth, geometry.body_length, geometry.cap_length, compliance)
    except (ValueError, TruthError) as error:
        raise BadInputError(str(error)) from error
    note = {
        "command": command,
        "code_version": code_version(),
        "date": today(),
        "truth_sha256": sha256(Path(options.truth)),
        "compliance_m_per_n": compliance,
        "fitted_compliance": asdict(found),
        "shear_compliance_per_n": shear,
        **asdict(ends),
    }
    leaning = {} if shear is None else {"shear_compliance": shear[0]}
    for file, calibration in calibrations.items():
        actuator = replace(calibration.actuator, **ends.values, **leaning)
        provenance = {**calibration.provenance, "ends": note}
        left_out = {"median": ends.angle_median, "p90": ends.angle_p90, "worst": ends.angle_worst}
        errors = {**calibration.error, "actuator_angle_rad": left_out}
        changed = replace(calibration, actuator=actuator, error=errors, provenance=provenance)
        save_calibration(changed, file)
    if options.json:
        print(json.dumps(note))
        return GOOD
    print(
        f"ends give by {1e3 * found.value:.3f} ± {1e3 * found.standard_error:.3f} mm/N, from {found.states} "
        f"states: the middle's angle over a body is off by {math.degrees(found.after):.2f} deg (root mean "
        f"square), with ends that hold by {math.degrees(found.before):.2f} deg"
    )
    print(f"with {1e3 * compliance:g} mm/N in the cell:")
    for name, (title, unit, factor) in _ENDS.items():
        value, spread = factor * ends.values[name], factor * ends.standard_errors[name]
        print(f"  {title:24s} {value:8.3f} ± {spread:.3f} {unit}")
    if shear is not None:
        print(f"under a force sections lean by {shear[0]:.3f} ± {shear[1]:.3f} rad/N")
    print(
        f"the tip is off by {1e3 * ends.after:.2f} mm and {math.degrees(ends.turn_after):.2f} deg (root mean "
        f"square), without them by {1e3 * ends.before:.2f} mm and {math.degrees(ends.turn_before):.2f} deg"
    )
    print(
        f"a chamber's volume is off by {1e9 * ends.volume_after:.0f} mm3 (root mean square), without what "
        f"the ends hold by {1e9 * ends.volume_before:.0f} mm3"
    )
    print(
        f"angle on runs left out in turn: median {math.degrees(ends.angle_median):.2f}, 90 % within "
        f"{math.degrees(ends.angle_p90):.2f}, worst {math.degrees(ends.angle_worst):.2f} deg"
    )
    return GOOD


def _judge(options: argparse.Namespace, command: str) -> int:
    from calibration.judge import compare_with_truth, judgement

    found = judgement(compare_with_truth(read_truth(options.truth)), options.role)
    if options.json:
        print(json.dumps(found))
        return GOOD
    print(
        f"{found['judged']} of {found['states']} states of {options.role} runs are inside the rods' domains"
    )
    print(f"{'':32s} {'median':>8s} {'95 %':>8s} {'worst':>8s}   at")
    for key, title in _ROWS.items():
        if key in found:
            row: dict[str, Any] = found[key]
            where = ", ".join(f"{p:g}" for p in row["worst_at"]["pressure_kpa"])
            numbers = " ".join(f"{row[name]:8.2f}" for name in ("median", "p95", "worst"))
            print(f"{title:32s} {numbers}   {row['worst_at']['case']}, {where} kPa")
    if "stated_bound_share" in found:
        print(f"within the rod's own 90 % bound: {100.0 * found['stated_bound_share']:.0f} % of angles")
    return GOOD
