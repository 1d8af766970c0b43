"""The command ``rodmodel-fem``: the finite-element reference, for people and for programs."""

import argparse
import json
import math
import os
import re
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any, NoReturn

from fem_reference.cell import CellError, CellState, Load, PeriodCell, follow
from fem_reference.geometry import ActuatorGeometry
from fem_reference.progress import track
from fem_reference.section import LEVELS
from fem_reference.vtk import write_vtk
from fem_reference.winding import LAYOUTS, layout

_GOOD, _BAD_INPUT, _NO_CONVERGENCE = 0, 2, 3
_STEP_KPA = 2.5
_WALLS = {
    "--outer-wall-mm": "outer_wall",
    "--inner-wall-mm": "inner_wall",
    "--partition-wall-mm": "partition_wall",
}
_VTK_SUFFIXES = (".vtu", ".vtk")


class _InputError(Exception):
    """Bad input; the message is one line."""


class _Parser(argparse.ArgumentParser):
    def __init__(self, **options: Any) -> None:
        super().__init__(allow_abbrev=False, **options)
        # argparse takes -1e-3 for an option; it is a number.
        self._negative_number_matcher = re.compile(r"-(\d+\.?\d*|\.\d+)(e[-+]?\d+)?$", re.IGNORECASE)

    def error(self, message: str) -> NoReturn:
        raise _InputError(f"{message} (see {self.prog} --help)")


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command.

    Returns
    -------
    status : 0 good; 2 bad input, told in one line on standard error; 3 no convergence, with what was reached.
    """
    try:
        options = _parser().parse_args(arguments)
        status: int = options.command(options)
    except _InputError as error:
        print(f"rodmodel-fem: {error}", file=sys.stderr)
        return _BAD_INPUT
    return status


def _parser() -> _Parser:
    parser = _Parser(prog="rodmodel-fem", description="3D finite elements of a soft pneumatic actuator.")
    commands = parser.add_subparsers(required=True, metavar="cell")
    cell = commands.add_parser(
        "cell", help="one winding period, uniformly bent: angle and volumes of the whole body's length"
    )
    add = cell.add_argument
    add("--layout", default="double-helix", help=f"winding: {', '.join(LAYOUTS)} (default: %(default)s)")
    add("--psi-deg", nargs="+", default=["0"], metavar="PSI", help="winding orientation [deg] (default: 0)")
    add("--pitch-mm", nargs="+", default=["3"], metavar="P", help="winding pitch [mm] (default: 3)")
    add("--spacing-mm", nargs="+", metavar="S", help="from ring to ring [mm] (default: half the pitch)")
    add("--pressure-kpa", nargs="+", default=[], metavar="P", help="P1 P2 P3: gauge pressures [kPa]")
    add("--moment-nmm", nargs="+", metavar="M", help="M1 M2 M3: external moment, body frame [N mm]")
    add("--curvature-per-m", nargs="+", metavar="U", help="U1 U2 U3: impose the curvature and twist [1/m]")
    add("--elements", default="coarse", help=f"mesh level: {', '.join(LEVELS)} (default: %(default)s)")
    for flag in _WALLS:
        add(flag, nargs="+", metavar="T", help=f"thickness of the {_WALLS[flag].replace('_', ' ')} [mm]")
    add("--json", action="store_true", help="print one JSON object and nothing else")
    add("--vtk", metavar="FILE", help="write the deformed cell and its winding for ParaView (.vtu, .vtk)")
    cell.set_defaults(command=_cell)
    return parser


def _cell(options: argparse.Namespace) -> int:
    pressure = _numbers("--pressure-kpa", options.pressure_kpa, 3, "kPa")
    moment = _optional("--moment-nmm", options.moment_nmm, "N mm")
    curvature = _optional("--curvature-per-m", options.curvature_per_m, "1/m")
    psi = math.radians(_numbers("--psi-deg", options.psi_deg, 1, "deg")[0])
    pitch = 1e-3 * _numbers("--pitch-mm", options.pitch_mm, 1, "mm")[0]
    spacing = None
    if options.spacing_mm is not None:
        spacing = 1e-3 * _numbers("--spacing-mm", options.spacing_mm, 1, "mm")[0]
    if options.vtk is not None:
        _check_writable("--vtk", Path(options.vtk))
    walls = {
        name: 1e-3 * _numbers(flag, getattr(options, f"{name}_mm"), 1, "mm")[0]
        for flag, name in _WALLS.items()
        if getattr(options, f"{name}_mm") is not None
    }
    try:
        loads = _ramp(pressure, moment, curvature)
        geometry = ActuatorGeometry(**walls)
        winding = layout(options.layout, psi, pitch, spacing)
        cell = PeriodCell(geometry, winding, level=options.elements)
    except ValueError as error:
        raise _InputError(_with_flags(str(error))) from error

    state, status = None, _GOOD
    try:
        *_, state = track(follow(cell, loads), len(loads))
    except CellError as error:
        state, status = error.last_good, _NO_CONVERGENCE
        print(f"rodmodel-fem: {error}; the last converged state is given", file=sys.stderr)
    if state is None:
        return status
    record = _record(cell, state, status == _GOOD)
    if options.vtk is not None:
        write_vtk(cell, state, options.vtk)
    print(json.dumps(record) if options.json else _text(record))
    return status


def _ramp(pressure: list[float], moment: list[float] | None, curvature: list[float] | None) -> list[Load]:
    """Loads from rest to the one asked for, in even steps that a progress bar can count."""
    steps = max(1, math.ceil(max(pressure) / _STEP_KPA))

    def part(vector: list[float], factor: float) -> tuple[float, float, float]:
        return factor * vector[0], factor * vector[1], factor * vector[2]

    def load(share: float) -> Load:
        return Load(
            part(pressure, 1e3 * share),
            None if moment is None else part(moment, 1e-3 * share),
            None if curvature is None else part(curvature, share),
        )

    load(1.0)  # A bad load is told in full, before its parts.
    return [load(k / steps) for k in range(1, steps + 1)]


def _record(cell: PeriodCell, state: CellState, converged: bool) -> dict[str, Any]:
    length = cell.geometry.body_length
    u1, u2, _ = state.curvature
    return {
        "bending_angle_deg": math.degrees(length * math.hypot(u1, u2)),
        "bending_plane_deg": math.degrees(math.atan2(u1, -u2)) % 360.0,
        "curvature_per_m": state.curvature.tolist(),
        "moment_nmm": (1e3 * state.moment).tolist(),
        "chamber_volume_mm3": (1e9 * length * state.volume).tolist(),
        "pressure_kpa": (1e-3 * state.pressure).tolist(),
        "converged": converged,
        "stable": state.stable,
        "residual_n": state.residual,
        "elements": cell.elements,
        "unknowns": cell.unknowns,
    }


def _text(record: dict[str, Any]) -> str:
    def row(values: list[float], form: str = "{:.4g}") -> str:
        return "  ".join(form.format(value) for value in values)

    stable = {True: "stable", False: "unstable", None: "stability not known"}[record["stable"]]
    return "\n".join(
        [
            f"pressures          {row(record['pressure_kpa'])} kPa ({stable})",
            f"bending angle      {record['bending_angle_deg']:.3f} deg over 60 mm, uniformly bent",
            f"bending plane      {record['bending_plane_deg']:.2f} deg",
            f"curvature          {row(record['curvature_per_m'])} 1/m",
            f"moment             {row(record['moment_nmm'])} N mm",
            f"chamber volumes    {row(record['chamber_volume_mm3'], '{:.1f}')} mm³ over 60 mm",
            f"mesh               {record['elements']} hexahedra, {record['unknowns']} unknowns",
        ]
    )


def _numbers(flag: str, came: Sequence[str], count: int, unit: str) -> list[float]:
    expected = {1: "one finite number", 3: "three finite numbers"}[count]
    try:
        values = [float(value) for value in came]
    except ValueError:
        values = []
    if len(values) != count or not all(map(math.isfinite, values)):
        raise _InputError(f"{flag}: got {' '.join(came)!r}, expected {expected} [{unit}]")
    return values


def _optional(flag: str, came: Sequence[str] | None, unit: str) -> list[float] | None:
    return None if came is None else _numbers(flag, came, 3, unit)


def _check_writable(flag: str, file: Path) -> None:
    directory = file.parent
    if file.suffix not in _VTK_SUFFIXES or file.is_dir() or not os.access(directory, os.W_OK):
        raise _InputError(
            f"{flag}: got {str(file)!r}, expected a .vtu or .vtk file in a directory that can be written to"
        )


def _with_flags(message: str) -> str:
    """A library error in the words of the command line: arguments by their flags."""
    flags = {
        "pressure": "--pressure-kpa",
        "pitch": "--pitch-mm",
        "psi": "--psi-deg",
        "elements": "--elements",
        "layout": "--layout",
        "spacing": "--spacing-mm",
    }
    name, _, rest = message.partition(":")
    return f"{flags.get(name, name)}:{rest}"


if __name__ == "__main__":
    sys.exit(main())
