"""The command `rodmodel`: predictions of the rod, for people and for programs."""

import argparse
import json
import math
import os
import sys
from collections.abc import Sequence
from pathlib import Path

import jax
import numpy as np

from rodmodel._arguments import InputError, Parser, numbers
from rodmodel._load import CalibrationNotFoundError, load, shipped_calibrations
from rodmodel._record import CalibrationFileError
from rodmodel._report import calibration_record, calibration_text, prediction_record, prediction_text
from rodmodel._rod import Rod
from rodmodel._solution import Solution

_GOOD, _BAD_INPUT, _NO_CONVERGENCE = 0, 2, 3

_PRESSURES = "three gauge pressures, one for each chamber, each 0 or more [kPa]"
_PITCH = "one positive length [mm]"
_PLOT_SUFFIXES = (".pdf", ".png", ".svg")
_PLOT_FILE = "a .pdf, .png or .svg file in a directory that can be written to"


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command.

    Returns
    -------
    status : 0 good; 2 bad input, told in one line on standard error; 3 no convergence, with what was reached.
    """
    jax.config.update("jax_enable_x64", True)
    try:
        options = _parser().parse_args(arguments)
        status: int = options.command(options)
    except InputError as error:
        # One line, whatever a file name or the system put into it.
        print("rodmodel:", *str(error).split(), file=sys.stderr)
        return _BAD_INPUT
    return status


def _parser() -> Parser:
    parser = Parser(
        prog="rodmodel", description="Bending of a soft pneumatic actuator, calibrated from 3D FEM."
    )
    commands = parser.add_subparsers(required=True, metavar="layouts | predict")

    layouts = commands.add_parser(
        "layouts", help="list the shipped calibrations: validity, error against the FEM"
    )
    layouts.add_argument("--json", action="store_true", help="print one JSON object and nothing else")
    layouts.set_defaults(command=_layouts)

    predict = commands.add_parser(
        "predict", help="predict pose and chamber volumes under pressures and dead loads"
    )
    add = predict.add_argument
    add("--layout", default="double-helix", help="winding layout (default: %(default)s)")
    add("--psi-deg", nargs="+", default=["0"], metavar="PSI", help="winding orientation [deg] (default: 0)")
    add("--pitch-mm", nargs="+", default=["3"], metavar="P", help="winding pitch [mm] (default: 3)")
    add("--pressure-kpa", nargs="+", default=[], metavar="P", help=f"P1 P2 P3: {_PRESSURES}")
    add("--tip-force-n", nargs="+", metavar="F", help="FX FY FZ: on the cap's outer face, world frame [N]")
    add("--tip-moment-nmm", nargs="+", metavar="M", help="MX MY MZ: on the cap, world frame [N mm]")
    add("--gravity", nargs="+", metavar="G", help="GX GY GZ: acceleration, world frame [m/s²]")
    add("--json", action="store_true", help="print one JSON object and nothing else")
    add("--plot", metavar="FILE", help="draw the bent rod: a PNG, PDF or SVG file")
    add("--calibration", metavar="FILE", help="calibration file to take in place of those that ship")
    predict.set_defaults(command=_predict)
    return parser


def _layouts(options: argparse.Namespace) -> int:
    records = [calibration_record(calibration) for calibration in shipped_calibrations()]
    print(
        json.dumps({"calibrations": records}) if options.json else "\n".join(map(calibration_text, records))
    )
    return _GOOD


def _predict(options: argparse.Namespace) -> int:
    pressure_kpa = numbers("--pressure-kpa", options.pressure_kpa, 3, _PRESSURES, negative=False)
    force = _components("--tip-force-n", options.tip_force_n, "N")
    moment = _components("--tip-moment-nmm", options.tip_moment_nmm, "N mm")
    gravity = _components("--gravity", options.gravity, "m/s²")
    if options.plot is not None:
        _check_plot_file(Path(options.plot))
    rod = _load_rod(options)
    pressure = 1e3 * np.array(pressure_kpa)
    _check_domain(rod, pressure, options.pressure_kpa)
    solution = rod.solve(
        pressure,
        tip_force=force,
        tip_moment=None if moment is None else 1e-3 * moment,
        gravity=gravity,
        throw=False,
    )
    if options.plot is not None:
        _plot(rod, pressure, solution, Path(options.plot))
    record = prediction_record(solution)
    print(json.dumps(record) if options.json else prediction_text(record))
    if not record["converged"]:
        reached = 100.0 * float(solution.stats["load_fraction"])
        print(
            f"rodmodel: no convergence, the above is the equilibrium at {reached:.3g} % of the loads",
            file=sys.stderr,
        )
        return _NO_CONVERGENCE
    return _GOOD


def _components(flag: str, came: list[str] | None, unit: str) -> np.ndarray | None:
    if came is None:
        return None
    return np.array(
        numbers(flag, came, 3, f"three finite components in the world frame [{unit}]", negative=True)
    )


def _load_rod(options: argparse.Namespace) -> Rod:
    (psi_deg,) = numbers("--psi-deg", options.psi_deg, 1, "one finite angle [deg]", negative=True)
    (pitch_mm,) = numbers("--pitch-mm", options.pitch_mm, 1, _PITCH, negative=False)
    if pitch_mm == 0.0:
        raise InputError(f"--pitch-mm: got {options.pitch_mm[0]!r}, expected {_PITCH}")
    try:
        return load(options.layout, math.radians(psi_deg), 1e-3 * pitch_mm, options.calibration)
    except CalibrationNotFoundError as error:
        flag, came = {
            "layout": ("--layout", options.layout),
            "psi": ("--psi-deg", options.psi_deg[0]),
            "pitch": ("--pitch-mm", options.pitch_mm[0]),
        }[error.argument]
        raise InputError(f"{flag}: got {came!r}, expected {error.expected}") from error
    except CalibrationFileError as error:
        raise InputError(f"--calibration: {error}") from error


def _check_domain(rod: Rod, pressure: np.ndarray, came: list[str]) -> None:
    domain = rod.domain
    if not domain.covers_pressure(pressure):
        first, second, third = (1e-3 * maximum for maximum in domain.pressure_max)
        raise InputError(
            f"--pressure-kpa: got {' '.join(came)!r}, expected what the calibration covers: "
            f"at most {first:g}, {second:g}, {third:g} kPa in chambers 1, 2, 3 "
            f"and {1e-3 * domain.pressure_sum_max:g} kPa in sum"
        )


def _check_plot_file(file: Path) -> None:
    """Refuse before the solve what can be known to fail after it."""
    try:
        usable = not file.is_dir() and os.access(file.parent, os.W_OK)
    except OSError:  # a name that is too long, say
        usable = False
    if not usable or file.suffix.lower() not in _PLOT_SUFFIXES:
        raise InputError(f"--plot: got {str(file)!r}, expected {_PLOT_FILE}")


def _plot(rod: Rod, pressure: np.ndarray, solution: Solution, file: Path) -> None:
    # Imported late: matplotlib takes as long to import as a prediction takes.
    from rodmodel.plot import plot_rod

    try:
        plot_rod([(pressure, solution)], rod.actuator, file)
    except OSError as error:
        raise InputError(f"--plot: got {str(file)!r} ({error.strerror}), expected {_PLOT_FILE}") from error
