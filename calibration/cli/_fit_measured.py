"""`rodmodel-calibrate fit-measured`: adjust the map to an actuator that was measured."""

import argparse
import json
import math
from pathlib import Path
from typing import TYPE_CHECKING

from calibration.cli._arguments import (
    GOOD,
    NOT_CONVERGED,
    BadInputError,
    Parser,
    complain,
    number,
    positive,
    refuse_unwritable,
)

if TYPE_CHECKING:
    from rodmodel import Rod


def add_to(commands: "argparse._SubParsersAction[Parser]") -> Parser:
    """Add the command."""
    parser = commands.add_parser("fit-measured", help="adjust the map to measurements of a real actuator")
    add = parser.add_argument
    add("data", help="CSV file of pressures and what was measured under them; see docs/calibration.md")
    add("--layout", default="double-helix", help="winding layout (default: %(default)s)")
    add("--psi-deg", type=number, default=0.0, help="winding orientation [deg]")
    add("--pitch-mm", type=positive, default=3.0, help="winding pitch [mm]")
    add("--calibration", default=None, metavar="FILE", help="calibration file in place of those that ship")
    add("--angle-noise-deg", type=positive, default=1.0, help="standard deviation of angles (default: 1)")
    add(
        "--position-noise-mm", type=positive, default=0.5, help="of each coordinate of the tip (default: 0.5)"
    )
    add(
        "--estimate-noise",
        action="store_true",
        help="take only the ratio of the two, and their size from the residuals",
    )
    add("--out", default=None, metavar="FILE", help="JSON file of the parameters to write")
    add("--plot", default=None, metavar="FILE", help="residual plot to write: PNG, PDF or SVG")
    parser.set_defaults(command=_run)
    return parser


def _run(options: argparse.Namespace, command: str) -> int:
    from calibration.adjusted_law import OuterWall
    from calibration.measured import MeasuredError, read_measured
    from calibration.measured_file import Adjustment, save_adjustment
    from calibration.measured_fit import MeasuredFitError, Noise, fit_measured
    from calibration.measured_report import fit_record, fit_text, write_residual_plot
    from calibration.provenance import code_version, sha256, today
    from rodmodel import Layout

    data = Path(options.data)
    rod = _rod(options)
    try:
        measured = read_measured(data, rod.domain)
    except MeasuredError as error:
        raise BadInputError(str(error)) from error
    if options.plot is not None and Path(options.plot).suffix.lower() not in (".pdf", ".png", ".svg"):
        raise BadInputError(f"--plot: got {options.plot!r}, expected a .pdf, .png or .svg file")
    for flag, file in (("--out", options.out), ("--plot", options.plot)):
        if file is not None:
            refuse_unwritable(flag, Path(file))
    noise = Noise(
        math.radians(options.angle_noise_deg), 1e-3 * options.position_noise_mm, options.estimate_noise
    )
    wall = OuterWall()
    try:
        fit = fit_measured(rod, measured, noise, wall)
    except MeasuredFitError as error:
        return complain(f"rodmodel-calibrate fit-measured: {data}: {error}; nothing written", NOT_CONVERGED)
    record = fit_record(fit, measured)
    if options.plot is not None:
        write_residual_plot(fit, measured, Path(options.plot))
    if options.out is not None:
        provenance = {
            "command": command,
            "code_version": code_version(),
            "data_sha256": sha256(data),
            "date": today(),
            "fit": record,
        }
        layout = Layout(options.layout, math.radians(options.psi_deg), 1e-3 * options.pitch_mm)
        save_adjustment(
            Adjustment(layout, wall, fit.parameters, fit.standard_error, provenance), Path(options.out)
        )
    print(json.dumps(record) if options.json else fit_text(fit, measured))
    return GOOD


def _rod(options: argparse.Namespace) -> "Rod":
    from rodmodel import CalibrationFileError, CalibrationNotFoundError, load

    try:
        psi, pitch = math.radians(options.psi_deg), 1e-3 * options.pitch_mm
        return load(options.layout, psi, pitch, options.calibration)
    except CalibrationNotFoundError as error:
        flag, came = {
            "layout": ("--layout", options.layout),
            "psi": ("--psi-deg", f"{options.psi_deg:g}"),
            "pitch": ("--pitch-mm", f"{options.pitch_mm:g}"),
        }[error.argument]
        raise BadInputError(f"{flag}: got {came!r}, expected {error.expected}") from error
    except CalibrationFileError as error:
        raise BadInputError(f"--calibration: {error}") from error
