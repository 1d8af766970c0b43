"""`rodmodel-calibrate ends`: fit the ends to runs of the full actuator; write them to calibration files."""

import argparse
import json
import math
from dataclasses import asdict, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from calibration.cli._arguments import GOOD, BadInputError, Parser, not_negative
from calibration.cli._files import read_calibration_file, read_truth, write_calibration_file

if TYPE_CHECKING:
    from calibration.ends.fit import Compliance, Ends
    from rodmodel import Calibration, Layout

_ENDS = {
    "base_turn": ("base turn", "mrad/kPa", 1e6),
    "base_lag": ("base lag", "mm", 1e3),
    "stiff_tip": ("stiff tip", "mm", 1e3),
    "tip_offset": ("largest cap offset", "mm", 1e3),
    "tip_offset_curvature": ("curvature of the offset", "1/m", 1.0),
    "base_growth": ("growth of the base's reach", "", 1.0),
    "held_length": ("held chamber length", "mm", 1e3),
}


def add_to(commands: "argparse._SubParsersAction[Parser]") -> Parser:
    """Add the command."""
    ends = commands.add_parser(
        "ends",
        help="fit the actuator's ends to the fit runs of the truth, and write them to calibration files",
    )
    ends.add_argument("truth", help="netCDF file that `truth --gather` wrote")
    ends.add_argument(
        "files",
        nargs="*",
        metavar="FILE",
        help="calibration files to write; each gets the ends of its own winding's runs, or of the paper's",
    )
    ends.add_argument(
        "--end-compliance-mm-per-n",
        type=not_negative,
        default=None,
        metavar="C",
        help="compliance of the ends in the cell (default: as in `run`)",
    )
    ends.set_defaults(command=_ends)
    return ends


def _ends(options: argparse.Namespace, command: str) -> int:
    from calibration.ends.fit import fit_compliance, fit_ends, fit_shear
    from calibration.ends.runs_for_layout import PAPER, runs_for
    from calibration.provenance import code_version, sha256, today
    from calibration.sweep import usual_end_compliance
    from calibration.truth.dataset import TruthError
    from fem_reference import ActuatorGeometry, Design

    truth, geometry = read_truth(options.truth), ActuatorGeometry()
    given = options.end_compliance_mm_per_n
    usual = usual_end_compliance(Design())
    compliance = usual if given is None else 1e-3 * given
    calibrations = {file: read_calibration_file(file) for file in options.files}
    for file, calibration in calibrations.items():
        if calibration.law.is_adjusted:
            raise BadInputError(
                f"{file}: got a law adjusted to measurements, expected the map that it was made of"
            )
    try:
        shear = fit_shear(truth)
        windings = {file: runs_for(truth, c.layout)[0] for file, c in calibrations.items()}
        fitted: dict[Layout, tuple[Compliance, Ends]] = {}
        for winding in dict.fromkeys(windings.values()) or [PAPER]:
            runs = runs_for(truth, winding)[1]
            found = fit_compliance(runs, geometry.body_length, compliance or usual)
            fitted[winding] = found, fit_ends(runs, geometry.body_length, geometry.cap_length, compliance)
    except (ValueError, TruthError) as error:
        raise BadInputError(str(error)) from error
    notes = {
        winding: {
            "command": command,
            "code_version": code_version(),
            "date": today(),
            "truth_sha256": sha256(Path(options.truth)),
            "winding": asdict(winding),
            "compliance_m_per_n": compliance,
            "fitted_compliance": asdict(found),
            "shear_compliance_per_n": shear,
            **asdict(ends),
        }
        for winding, (found, ends) in fitted.items()
    }
    for file, calibration in calibrations.items():
        winding = windings[file]
        _write_ends(file, calibration, fitted[winding][1], shear, notes[winding])
    if options.json:
        print(json.dumps({"ends": list(notes.values())}))
        return GOOD
    for winding, (found, ends) in fitted.items():
        _print_ends(winding, found, ends, shear, compliance)
    return GOOD


def _write_ends(
    file: str,
    calibration: "Calibration",
    ends: "Ends",
    shear: tuple[float, float] | None,
    note: dict[str, Any],
) -> None:
    leaning = {} if shear is None else {"shear_compliance": shear[0]}
    try:
        actuator = replace(calibration.actuator, **ends.values, **leaning)
    except ValueError as error:
        raise BadInputError(f"{file}: {error}; nothing is written") from error
    provenance = {**calibration.provenance, "ends": note}
    left_out = {"median": ends.angle_median, "p90": ends.angle_p90, "worst": ends.angle_worst}
    errors = {**calibration.error, "actuator_angle_rad": left_out}
    # A bound is one of the rod with its ends: `bounds` makes it anew.
    made = replace(calibration, actuator=actuator, error=errors, provenance=provenance, bound=None)
    write_calibration_file(made, file)


def _print_ends(
    winding: "Layout",
    found: "Compliance",
    ends: "Ends",
    shear: tuple[float, float] | None,
    compliance: float,
) -> None:
    psi = math.degrees(winding.psi or 0.0)
    print(f"fit runs of {winding.name}, pitch {1e3 * winding.pitch:g} mm, psi {psi:g} deg:")
    print(
        f"end compliance {1e3 * found.value:.3f} ± {1e3 * found.standard_error:.3f} mm/N, from "
        f"{found.states} states; error of the middle's angle over a body length: "
        f"{math.degrees(found.after):.2f} deg (root mean square), "
        f"{math.degrees(found.before):.2f} deg with rigid ends"
    )
    print(f"with {1e3 * compliance:g} mm/N in the cell:")
    for name, (title, unit, factor) in _ENDS.items():
        value, spread = factor * ends.values[name], factor * ends.standard_errors[name]
        print(f"  {title:24s} {value:8.3f} ± {spread:.3f} {unit}".rstrip())
    if shear is not None:
        print(f"shear compliance {shear[0]:.3f} ± {shear[1]:.3f} rad/N")
    print(
        f"tip error {1e3 * ends.after:.2f} mm and {math.degrees(ends.turn_after):.2f} deg (root mean "
        f"square), without ends {1e3 * ends.before:.2f} mm and {math.degrees(ends.turn_before):.2f} deg"
    )
    print(
        f"chamber volume error {1e9 * ends.volume_after:.0f} mm3 (root mean square), without a held length "
        f"{1e9 * ends.volume_before:.0f} mm3"
    )
    print(
        f"leave-one-run-out angle error: median {math.degrees(ends.angle_median):.2f}, 90 % within "
        f"{math.degrees(ends.angle_p90):.2f}, worst {math.degrees(ends.angle_worst):.2f} deg"
    )
