"""What the commands of ``rodmodel-fem`` share: numbers, the actuator's flags, errors in one line."""

import argparse
import contextlib
import math
import os
import re
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any, NoReturn

from fem_reference.geometry import LAYOUTS, ActuatorGeometry, Winding, layout
from fem_reference.mesh import LEVELS

GOOD, BAD_INPUT, NO_CONVERGENCE = 0, 2, 3
#: Of a program that Ctrl-C has ended, as shells tell it.
INTERRUPTED = 130
_WALLS = {
    "--outer-wall-mm": "outer_wall",
    "--inner-wall-mm": "inner_wall",
    "--partition-wall-mm": "partition_wall",
}
_VTK_SUFFIXES = (".vtu", ".vtk")
PICTURES = (".png", ".pdf", ".svg")


class InputError(Exception):
    """Bad input; the message is one line."""


class Parser(argparse.ArgumentParser):
    def __init__(self, **options: Any) -> None:
        super().__init__(allow_abbrev=False, **options)
        # argparse takes -1e-3 for an option; it is a number.
        self._negative_number_matcher = re.compile(r"-(\d+\.?\d*|\.\d+)(e[-+]?\d+)?$", re.IGNORECASE)

    def error(self, message: str) -> NoReturn:
        raise InputError(f"{message} (see {self.prog} --help)")


def add_actuator(add: Callable[..., Any]) -> None:
    """Flags of the actuator itself: winding, walls, mesh, pressures."""
    add("--layout", default="double-helix", help=f"winding: {', '.join(LAYOUTS)} (default: %(default)s)")
    add("--psi-deg", nargs="+", default=["0"], metavar="PSI", help="winding orientation [deg] (default: 0)")
    add("--pitch-mm", nargs="+", default=["3"], metavar="P", help="winding pitch [mm] (default: 3)")
    add("--spacing-mm", nargs="+", metavar="S", help="from ring to ring [mm] (default: half the pitch)")
    add("--pressure-kpa", nargs="+", default=[], metavar="P", help="P1 P2 P3: gauge pressures [kPa]")
    add("--elements", default="coarse", help=f"mesh level: {', '.join(LEVELS)} (default: %(default)s)")
    for flag in _WALLS:
        add(flag, nargs="+", metavar="T", help=f"thickness of the {_WALLS[flag].replace('_', ' ')} [mm]")
    add(
        "--outer-wall-variation",
        nargs="+",
        default=["0", "0", "0"],
        metavar="V",
        help="V1 V2 V3: by which part the outer wall of each chamber is thicker (default: 0 0 0)",
    )


def read_winding(options: argparse.Namespace) -> Winding:
    """The winding that the flags ask for; a ValueError where there is none."""
    (psi_deg,) = numbers("--psi-deg", options.psi_deg, 1, "deg")
    psi = math.radians(psi_deg if abs(psi_deg) <= 360.0 else math.remainder(psi_deg, 360.0))
    pitch = 1e-3 * numbers("--pitch-mm", options.pitch_mm, 1, "mm")[0]
    spacing = None
    if options.spacing_mm is not None:
        spacing = 1e-3 * numbers("--spacing-mm", options.spacing_mm, 1, "mm")[0]
    return layout(options.layout, psi, pitch, spacing)


def read_geometry(options: argparse.Namespace) -> ActuatorGeometry:
    """The geometry that the flags ask for; a ValueError where it is impossible."""
    walls = {
        name: 1e-3 * numbers(flag, getattr(options, f"{name}_mm"), 1, "mm")[0]
        for flag, name in _WALLS.items()
        if getattr(options, f"{name}_mm") is not None
    }
    first, second, third = numbers("--outer-wall-variation", options.outer_wall_variation, 3, "-")
    return ActuatorGeometry(**walls, outer_wall_variation=(first, second, third))


def numbers(flag: str, came: Sequence[str], count: int, unit: str) -> list[float]:
    """So many finite numbers, or an error that names the flag."""
    expected = {1: "one finite number", 3: "three finite numbers"}[count]
    try:
        values = [float(value) for value in came]
    except ValueError:
        values = []
    if len(values) != count or not all(map(math.isfinite, values)):
        raise InputError(f"{flag}: got {' '.join(came)!r}, expected {expected} [{unit}]")
    return values


def optional(flag: str, came: Sequence[str] | None, unit: str) -> list[float] | None:
    """Three finite numbers, or None where the flag was not given."""
    return None if came is None else numbers(flag, came, 3, unit)


def check_writable(flag: str, file: Path, suffixes: tuple[str, ...] = _VTK_SUFFIXES) -> None:
    """Refuse a file of another kind, or one that cannot be written, before the work begins."""
    if file.suffix not in suffixes or file.is_dir() or not os.access(file.parent, os.W_OK):
        kinds = ", ".join(suffixes[:-1]) + f" or {suffixes[-1]}"
        raise InputError(
            f"{flag}: got {str(file)!r}, expected a {kinds} file in a directory that can be written to"
        )


@contextlib.contextmanager
def writing(flag: str, file: str) -> Iterator[None]:
    """Refuse a file that turns out not to be written: the disk may be full by then."""
    try:
        yield
    except OSError as error:
        raise InputError(
            f"{flag}: got {file!r} ({error.strerror or error}), expected a file that can be written"
        ) from error


def with_flags(message: str) -> str:
    """A library error in the words of the command line: arguments by their flags."""
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
    name, _, rest = message.partition(":")
    return f"{flags.get(name, name)}:{rest}"
