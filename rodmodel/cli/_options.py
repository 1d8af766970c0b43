"""Options that several commands share, and exit statuses."""

import argparse
import math
import os
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from rodmodel.cli._arguments import InputError, numbers
from rodmodel.io import (
    CalibrationFileError,
    CalibrationNotFoundError,
    Found,
    find_among,
    read_calibration,
    shipped_calibrations,
)

if TYPE_CHECKING:
    import rodmodel.control
    import rodmodel.core

GOOD, BAD_INPUT, NO_CONVERGENCE = 0, 2, 3

_LAYOUT, _PSI_DEG, _PITCH_MM = "double-helix", 0.0, 3.0
_PITCH = "one positive length [mm]"
_PLOT_SUFFIXES = (".pdf", ".png", ".svg")
_PLOT_FILE = "a .pdf, .png or .svg file in a directory that can be written to"


def add_layout(parser: argparse.ArgumentParser) -> None:
    """Add the options that choose the rod."""
    add = parser.add_argument
    add("--layout", help=f"winding layout (default: {_LAYOUT}, or that of the calibration file)")
    add("--psi-deg", nargs="+", metavar="PSI", help="winding orientation [deg] (default: 0, or the file's)")
    add("--pitch-mm", nargs="+", metavar="P", help="winding pitch [mm] (default: 3, or the file's)")
    add("--calibration", metavar="FILE", help="calibration file to use instead of the shipped ones")


def add_loads(parser: argparse.ArgumentParser) -> None:
    """Add the options of the dead loads."""
    add = parser.add_argument
    add("--tip-force-n", nargs="+", metavar="F", help="FX FY FZ: on the cap's outer face, world frame [N]")
    add("--tip-moment-nmm", nargs="+", metavar="M", help="MX MY MZ: on the cap, world frame [N mm]")
    add("--gravity", nargs="+", metavar="G", help="GX GY GZ: acceleration, world frame [m/s²]")


def add_output(parser: argparse.ArgumentParser, plot: str | None) -> None:
    """Add the options of the output; `plot` names the picture's content, None for no picture."""
    parser.add_argument("--json", action="store_true", help="print one JSON object and nothing else")
    if plot is not None:
        parser.add_argument("--plot", metavar="FILE", help=f"draw {plot}: a PNG, PDF or SVG file")


def loads_of(options: argparse.Namespace) -> dict[str, Any]:
    """Return the loads in SI, as `CoreRod.solve` takes them."""
    moment = components("--tip-moment-nmm", options.tip_moment_nmm, "N mm")
    return {
        "tip_force": components("--tip-force-n", options.tip_force_n, "N"),
        "tip_moment": None if moment is None else 1e-3 * moment,
        "gravity": components("--gravity", options.gravity, "m/s²"),
    }


def components(
    flag: str, words: list[str] | None, unit: str, frame: str = "the world frame"
) -> np.ndarray | None:
    """Return the three components of an option, or None if it is absent."""
    if words is None:
        return None
    return np.array(numbers(flag, words, 3, f"three finite components in {frame} [{unit}]", negative=True))


def find_calibration(options: argparse.Namespace) -> Found:
    """Return the calibration of the requested layout; options not given default to the calibration file's."""
    try:
        known = (
            shipped_calibrations() if options.calibration is None else [read_calibration(options.calibration)]
        )
    except CalibrationFileError as error:
        raise InputError(f"--calibration: {error}") from error
    layout, psi, pitch = _LAYOUT, math.radians(_PSI_DEG), 1e-3 * _PITCH_MM
    if options.calibration is not None:
        own = known[0].layout
        layout, pitch = own.name, own.pitch
        psi = psi if own.psi is None else own.psi
    if options.layout is not None:
        layout = options.layout
    if options.psi_deg is not None:
        (psi_deg,) = numbers("--psi-deg", options.psi_deg, 1, "one finite angle [deg]", negative=True)
        psi = math.radians(math.remainder(psi_deg, 360.0))
    if options.pitch_mm is not None:
        (pitch_mm,) = numbers("--pitch-mm", options.pitch_mm, 1, _PITCH, negative=False)
        if pitch_mm == 0.0:
            raise InputError(f"--pitch-mm: got {options.pitch_mm[0]!r}, expected {_PITCH}")
        pitch = 1e-3 * pitch_mm
    try:
        return find_among(known, layout, psi, pitch)
    except CalibrationNotFoundError as error:
        flag, value = {
            "layout": ("--layout", layout),
            "psi": ("--psi-deg", options.psi_deg[0] if options.psi_deg else f"{_PSI_DEG:g}"),
            "pitch": ("--pitch-mm", options.pitch_mm[0] if options.pitch_mm else f"{_PITCH_MM:g}"),
        }[error.argument]
        raise InputError(f"{flag}: got {value!r}, expected {error.expected}") from error


def load_rod(options: argparse.Namespace) -> "rodmodel.core.CoreRod":
    """Return the rod of the requested layout."""
    # Imported late: `layouts` and errors do without it.
    from rodmodel.core import CoreRod

    return CoreRod.of(find_calibration(options))


def load_branches(options: argparse.Namespace) -> "rodmodel.control.Branches":
    """Return the rods of all branches of the requested layout."""
    # Imported late, as above.
    from rodmodel.io import branches_of

    return branches_of(find_calibration(options))


def check_plot_file(options: argparse.Namespace) -> None:
    """Refuse a picture that cannot be written, before the solve."""
    if options.plot is None:
        return
    file = Path(options.plot)
    try:
        usable = not file.is_dir() and os.access(file.parent, os.W_OK)
    except OSError:  # for example, a name that is too long
        usable = False
    if not usable or file.suffix.lower() not in _PLOT_SUFFIXES:
        raise InputError(f"--plot: got {options.plot!r}, expected {_PLOT_FILE}")


def plot(options: argparse.Namespace, draw: Callable[[Path], None]) -> None:
    """Draw into the requested file, if any."""
    if options.plot is None:
        return
    try:
        draw(Path(options.plot))
    except OSError as error:
        raise InputError(f"--plot: got {options.plot!r} ({error.strerror}), expected {_PLOT_FILE}") from error
