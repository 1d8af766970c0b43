"""Shared parts of the commands of ``rodmodel-fem``: flags of the actuator, numbers, one-line errors."""

import argparse
import contextlib
import math
import os
import re
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, NoReturn

from fem_reference.design import Design, read_design
from fem_reference.geometry import LAYOUTS, ActuatorGeometry, NoWinding, Ring, Winding, layout
from fem_reference.mesh import LEVELS

GOOD, BAD_INPUT, NO_CONVERGENCE = 0, 2, 3
#: Exit status after Ctrl-C, as in shells.
INTERRUPTED = 130
_WALLS = {
    "--outer-wall-mm": "outer_wall",
    "--inner-wall-mm": "inner_wall",
    "--partition-wall-mm": "partition_wall",
}
_VTK_SUFFIXES = (".vtu", ".vtk")
PICTURES = (".png", ".pdf", ".svg")


class InputError(Exception):
    """Error for bad input; the message is one line."""


class Parser(argparse.ArgumentParser):
    def __init__(self, **options: Any) -> None:
        super().__init__(allow_abbrev=False, **options)
        # Without this argparse reads -1e-3 as an option.
        self._negative_number_matcher = re.compile(r"-(\d+\.?\d*|\.\d+)(e[-+]?\d+)?$", re.IGNORECASE)

    def error(self, message: str) -> NoReturn:
        raise InputError(f"{message} (see {self.prog} --help)")


def add_actuator(add: Callable[..., Any], elements: str | None) -> None:
    """Add the flags of the actuator: design, winding, walls, mesh, pressures.

    ``elements`` is the default mesh level; None for that of the winding (`converged_level`).
    """
    told = elements or "fine, and finer for rings"
    add(
        "--design",
        metavar="FILE",
        help="design file, which other options change (default: the paper's actuator)",
    )
    add("--layout", help=f"winding: {', '.join(LAYOUTS)} (default: double-helix, or the design's)")
    add("--psi-deg", nargs="+", metavar="PSI", help="winding orientation [deg] (default: 0, or the design's)")
    add("--pitch-mm", nargs="+", metavar="P", help="winding pitch [mm] (default: 3, or the design's)")
    add("--spacing-mm", nargs="+", metavar="S", help="distance of rings [mm] (default: half the pitch)")
    add("--pressure-kpa", nargs="+", default=[], metavar="P", help="P1 P2 P3: gauge pressures [kPa]")
    add("--elements", default=elements, help=f"mesh level: {', '.join(LEVELS)} (default: {told})")
    for flag in _WALLS:
        add(flag, nargs="+", metavar="T", help=f"thickness of the {_WALLS[flag].replace('_', ' ')} [mm]")
    add(
        "--outer-wall-variation",
        nargs="+",
        metavar="V",
        help="V1 V2 V3: relative excess thickness of the outer wall at each chamber (default: 0 0 0)",
    )


def design_of(options: argparse.Namespace) -> Design:
    """Return the design of the file, or else the paper's, with what the other flags change.

    Raises
    ------
    ValueError
        For a file or a change that is impossible.
    """
    own = Design() if options.design is None else read_design(options.design)
    geometry = _geometry(options, own.geometry)
    return replace(own, geometry=geometry, winding=_winding(options, own.winding, geometry))


def _winding(options: argparse.Namespace, own: Winding, geometry: ActuatorGeometry) -> Winding:
    flags = (options.layout, options.psi_deg, options.pitch_mm, options.spacing_mm)
    if all(flag is None for flag in flags):
        return own
    name = options.layout or own.name
    if name in (Ring.name, NoWinding.name) and options.psi_deg is not None:
        raise InputError(f"--psi-deg: got it for the layout {name}, expected it for helices only")
    if options.pitch_mm is not None and options.spacing_mm is not None:
        raise InputError(
            "--pitch-mm: got it with --spacing-mm, expected one of them: rings lie half a pitch apart"
        )
    psi = getattr(own, "psi", 0.0)
    if options.psi_deg is not None:
        (psi_deg,) = numbers("--psi-deg", options.psi_deg, 1, "deg")
        psi = math.radians(psi_deg if abs(psi_deg) <= 360.0 else math.remainder(psi_deg, 360.0))
    # Rings half a pitch apart need the thread of a double helix.
    length = own.cell_length(geometry.body_diameter)
    pitch = 2.0 * own.spacing if isinstance(own, Ring) else getattr(own, "pitch", length)
    if options.pitch_mm is not None:
        pitch = 1e-3 * numbers("--pitch-mm", options.pitch_mm, 1, "mm")[0]
    spacing = None
    if options.spacing_mm is not None:
        spacing = 1e-3 * numbers("--spacing-mm", options.spacing_mm, 1, "mm")[0]
    return layout(name, psi, pitch, spacing)


def _geometry(options: argparse.Namespace, own: ActuatorGeometry) -> ActuatorGeometry:
    changed: dict[str, Any] = {
        name: 1e-3 * numbers(flag, getattr(options, f"{name}_mm"), 1, "mm")[0]
        for flag, name in _WALLS.items()
        if getattr(options, f"{name}_mm") is not None
    }
    if options.outer_wall_variation is not None:
        changed["outer_wall_variation"] = tuple(
            numbers("--outer-wall-variation", options.outer_wall_variation, 3, "-")
        )
    return replace(own, **changed)


def numbers(flag: str, given: Sequence[str], count: int, unit: str) -> list[float]:
    """Return ``count`` finite numbers; raise an error that names the flag for anything else."""
    expected = {1: "one finite number", 3: "three finite numbers"}[count]
    try:
        values = [float(value) for value in given]
    except ValueError:
        values = []
    if len(values) != count or not all(map(math.isfinite, values)):
        raise InputError(f"{flag}: got {' '.join(given)!r}, expected {expected} [{unit}]")
    return values


def optional(flag: str, given: Sequence[str] | None, unit: str) -> list[float] | None:
    """Return three finite numbers, or None without the flag."""
    return None if given is None else numbers(flag, given, 3, unit)


def times(vector: Sequence[float], factor: float) -> tuple[float, float, float]:
    """Return a multiple of three numbers."""
    return factor * vector[0], factor * vector[1], factor * vector[2]


def row(values: Sequence[float], form: str = "{:.4g}") -> str:
    """Return numbers side by side."""
    return "  ".join(form.format(value) for value in values)


def stability(record: dict[str, Any]) -> str:
    """Return in words whether the state of a record is stable."""
    return {True: "stable", False: "unstable", None: "stability not known"}[record["stable"]]


def check_writable(flag: str, file: Path, suffixes: tuple[str, ...] = _VTK_SUFFIXES) -> None:
    """Refuse a file with another suffix, or in a directory that is not writable, before the work begins."""
    if file.suffix not in suffixes or file.is_dir() or not os.access(file.parent, os.W_OK):
        kinds = ", ".join(suffixes[:-1]) + f" or {suffixes[-1]}"
        raise InputError(
            f"{flag}: got {str(file)!r}, expected a {kinds} file in a directory that can be written to"
        )


@contextlib.contextmanager
def writing(flag: str, file: str) -> Iterator[None]:
    """Turn an error of writing a file, such as a full disk, into an `InputError`."""
    try:
        yield
    except OSError as error:
        raise InputError(
            f"{flag}: got {file!r} ({error.strerror or error}), expected a file that can be written"
        ) from error


def with_flags(message: str) -> str:
    """Return a library's error message with the argument replaced by its flag."""
    flags = {
        "pressure": "--pressure-kpa",
        "pitch": "--pitch-mm",
        "psi": "--psi-deg",
        "elements": "--elements",
        "layout": "--layout",
        "spacing": "--spacing-mm",
        "tip_force": "--tip-force-n",
        "tip_moment": "--tip-moment-nmm",
        "moment": "--moment-nmm",
        "curvature": "--curvature-per-m",
        "gravity": "--gravity",
        "end_compliance": "--end-compliance-mm-per-n",
        "density": "--density-kg-per-m3",
        "run": "--run",
        "outer_wall_variation": "--outer-wall-variation",
        "slack_share": "--slack-share",
        "symmetric": "--symmetric",
    }
    flags |= {name: flag for flag, name in _WALLS.items()}
    names, colon, rest = message.partition(":")
    return " ".join(flags.get(word, word) for word in names.split(" ")) + colon + rest
