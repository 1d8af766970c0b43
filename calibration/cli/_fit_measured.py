"""`rodmodel-calibrate fit-measured`: adjust the map to measurements of a real actuator."""

import argparse
import json
import math
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

from calibration.cli._arguments import (
    GOOD,
    NOT_CONVERGED,
    BadInputError,
    Parser,
    number,
    positive,
    refuse_unwritable,
)
from calibration.cli._files import write_calibration_file

if TYPE_CHECKING:
    from calibration.measured.csv_file import Measured
    from rodmodel.io import Found


def add_to(commands: "argparse._SubParsersAction[Parser]") -> Parser:
    """Add the command."""
    parser = commands.add_parser("fit-measured", help="adjust the map to measurements of a real actuator")
    add = parser.add_argument
    add(
        "data",
        help="CSV file of pressures and measurements; see docs/reference/measured_csv.md",
    )
    add("--layout", default="double-helix", help="winding layout (default: %(default)s)")
    add("--psi-deg", type=number, default=0.0, help="winding orientation [deg]")
    add("--pitch-mm", type=positive, default=3.0, help="winding pitch [mm]")
    add("--calibration", default=None, metavar="FILE", help="calibration file in place of those that ship")
    add("--angle-noise-deg", type=positive, default=1.0, help="standard deviation of angles (default: 1)")
    add(
        "--position-noise-mm",
        type=positive,
        default=0.5,
        help="standard deviation of each tip coordinate (default: 0.5)",
    )
    add(
        "--estimate-noise",
        action="store_true",
        help="use only the ratio of the two standard deviations; estimate their size from the residuals",
    )
    add("--lenient", action="store_true", help="skip unknown columns, rows with an empty cell, missing names")
    add("--force", action="store_true", help="fit and write despite doubts")
    add("--out", default=None, metavar="FILE", help="calibration file of the adjusted map to write")
    add("--plot", default=None, metavar="FILE", help="residual plot to write: PNG, PDF or SVG")
    parser.set_defaults(command=_run)
    return parser


def _run(options: argparse.Namespace, command: str) -> int:
    from calibration.measured.adjustment_file import calibration_of_fit
    from calibration.measured.doubts import doubts_of_units
    from calibration.measured.fit import MeasuredFitError, fit_measured
    from calibration.measured.report import fit_record, fit_text, write_residual_plot
    from calibration.measured.residuals import Noise
    from rodmodel import CoreRod, load
    from rodmodel.io import OuterWall

    data, wall = Path(options.data), OuterWall()
    found = _found(options)
    measured = _measured(options, found)
    for flag, file in (("--out", options.out), ("--plot", options.plot)):
        if file is not None:
            refuse_unwritable(flag, Path(file))

    def say(what: str) -> None:
        print(f"rodmodel-calibrate fit-measured: {data}: {what}", file=sys.stderr)

    if measured.passed_over:
        say(f"passed over: {'; '.join(measured.passed_over)}")
    doubt = doubts_of_units(CoreRod.of(found), measured)
    if doubt is not None:
        say(f"{doubt}{'' if options.force else '; nothing written: --force goes on'}")
        if not options.force:
            return NOT_CONVERGED
    noise = Noise(
        math.radians(options.angle_noise_deg), 1e-3 * options.position_noise_mm, options.estimate_noise
    )
    layout = (options.layout, math.radians(options.psi_deg), 1e-3 * options.pitch_mm)
    try:
        fit = fit_measured(load(*layout, options.calibration), measured, noise, wall, options.force)
    except MeasuredFitError as error:
        say(f"{error}; nothing written")
        return NOT_CONVERGED
    record = fit_record(fit)
    if options.plot is not None:
        write_residual_plot(fit, Path(options.plot))
    print(json.dumps(record) if options.json else fit_text(fit))
    doubts = [doubt, *fit.doubts] if doubt is not None else list(fit.doubts)
    for why in fit.doubts:
        say(why)
    if doubts and not options.force:
        say("the adjusted map should not be used; no calibration written: --force writes it")
        return NOT_CONVERGED
    if options.out is not None:
        try:
            made = calibration_of_fit(found, fit, wall, _provenance(options, command, found, record, doubts))
        except ValueError as error:
            say(f"{error}; nothing written")
            return NOT_CONVERGED
        write_calibration_file(made, options.out)
    return GOOD


def _measured(options: argparse.Namespace, found: "Found") -> "Measured":
    """Read the measurements; refuse them if the requested files cannot be made from them."""
    from calibration.measured.csv_file import ANGLE, POSITIONS, read_measured
    from calibration.measured.text import MeasuredError

    try:
        measured = read_measured(Path(options.data), found.domain, options.lenient)
    except MeasuredError as error:
        raise BadInputError(str(error)) from error
    if options.plot is not None and Path(options.plot).suffix.lower() not in (".pdf", ".png", ".svg"):
        raise BadInputError(f"--plot: got {options.plot!r}, expected a .pdf, .png or .svg file")
    has_angle_or_tip = ANGLE in measured.outputs or set(POSITIONS) <= set(measured.outputs)
    if options.out is not None and not has_angle_or_tip:
        raise BadInputError(
            f"--out: got measurements of {', '.join(measured.outputs)}, expected {ANGLE}, or all of "
            f"{', '.join(POSITIONS)}: nothing else tells how far the adjusted map is off"
        )
    return measured


def _provenance(
    options: argparse.Namespace, command: str, found: "Found", record: dict[str, Any], doubts: list[str]
) -> dict[str, Any]:
    from calibration.measured.adjustment_file import file_of_map
    from calibration.provenance import code_version, sha256, today

    base = file_of_map(found, options.calibration)
    return {
        "command": command,
        "code_version": code_version(),
        "date": today(),
        "data_sha256": sha256(Path(options.data)),
        "base": base.name,
        "base_sha256": sha256(base),
        "fit": record,
        **({"forced_against": doubts} if doubts else {}),
    }


def _found(options: argparse.Namespace) -> "Found":
    from rodmodel import CalibrationFileError, CalibrationNotFoundError
    from rodmodel.io import find

    try:
        psi, pitch = math.radians(options.psi_deg), 1e-3 * options.pitch_mm
        return find(options.layout, psi, pitch, options.calibration)
    except CalibrationNotFoundError as error:
        flag, given = {
            "layout": ("--layout", options.layout),
            "psi": ("--psi-deg", f"{options.psi_deg:g}"),
            "pitch": ("--pitch-mm", f"{options.pitch_mm:g}"),
        }[error.argument]
        raise BadInputError(f"{flag}: got {given!r}, expected {error.expected}") from error
    except CalibrationFileError as error:
        raise BadInputError(f"--calibration: {error}") from error
