"""``rodmodel-fem cell``: one winding period, uniformly bent."""

import argparse
import json
import math
import sys
from pathlib import Path
from typing import Any

from fem_reference.cell import CellError, CellState, Load, PeriodCell, follow, stretch_beyond_tests
from fem_reference.cli._arguments import (
    GOOD,
    NO_CONVERGENCE,
    PICTURES,
    InputError,
    add_actuator,
    check_writable,
    design_of,
    numbers,
    optional,
    row,
    stability,
    times,
    with_flags,
    writing,
)
from fem_reference.cli._progress import track
from fem_reference.io import draw_cell, write_vtk

# Load step in the body's megapascals: 2.5 kPa in the paper's actuator.
_STEP = 2.5e-3
# Load steps at least if a curve is plotted.
_PLOTTED_STEPS = 8


def add_command(commands: Any) -> None:
    """Add the command to the parser."""
    cell = commands.add_parser(
        "cell", help="one winding period, uniformly bent: angle and volumes of the whole body's length"
    )
    add = cell.add_argument
    add_actuator(add, elements=None)
    add("--moment-nmm", nargs="+", metavar="M", help="M1 M2 M3: external moment, body frame [N mm]")
    add("--curvature-per-m", nargs="+", metavar="U", help="U1 U2 U3: impose the curvature and twist [1/m]")
    add(
        "--end-compliance-mm-per-n",
        nargs="+",
        metavar="C",
        help="compliance of the actuator's ends against sliding of the silicone along the rod (default: 0, "
        "or the design's)",
    )
    add("--json", action="store_true", help="print one JSON object and nothing else")
    add("--vtk", metavar="FILE", help="write the deformed cell and its winding for ParaView (.vtu, .vtk)")
    add(
        "--plot",
        metavar="FILE",
        help="draw section, bent body, and curves over the load (.png, .pdf, .svg)",
    )
    cell.set_defaults(command=_cell)


def _cell(options: argparse.Namespace) -> int:
    pressure = numbers("--pressure-kpa", options.pressure_kpa, 3, "kPa")
    moment = optional("--moment-nmm", options.moment_nmm, "N mm")
    curvature = optional("--curvature-per-m", options.curvature_per_m, "1/m")
    compliance = None
    if options.end_compliance_mm_per_n is not None:
        given = numbers("--end-compliance-mm-per-n", options.end_compliance_mm_per_n, 1, "mm/N")
        compliance = 1e-3 * given[0]
    if options.vtk is not None:
        check_writable("--vtk", Path(options.vtk))
    if options.plot is not None:
        check_writable("--plot", Path(options.plot), PICTURES)
    try:
        design = design_of(options)
        least = 1 if options.plot is None else _PLOTTED_STEPS
        steps = max(least, math.ceil(1e3 * max(pressure) / (_STEP * design.units.megapascal)))
        loads = _ramp(pressure, moment, curvature, steps)
        cell = PeriodCell.of(design, options.elements, compliance)
        cell.refuse(loads[-1])
    except ValueError as error:
        raise InputError(with_flags(str(error))) from error

    found: list[CellState] = []
    status = GOOD
    try:
        for state in track(follow(cell, loads), len(loads)):
            # Only a picture needs more than the last state.
            found = [state] if options.plot is None else [*found, state]
    except CellError as error:
        status = NO_CONVERGENCE
        print(f"rodmodel-fem: {error}; the last converged state follows", file=sys.stderr)
        found += [] if error.last_good is None else [error.last_good]
    if not found:
        return status
    state = found[-1]
    record = _record(cell, state, status == GOOD)
    length = 1e3 * cell.geometry.body_length
    print(json.dumps(record) if options.json else _text(record, length))
    beyond = stretch_beyond_tests(cell, state)
    if beyond is not None:
        print(f"rodmodel-fem: the state has {beyond}", file=sys.stderr)
    if options.vtk is not None:
        with writing("--vtk", options.vtk):
            write_vtk(cell, state, options.vtk)
    if options.plot is not None:
        with writing("--plot", options.plot):
            draw_cell(cell, found, options.plot)
    return status


def _ramp(
    pressure: list[float], moment: list[float] | None, curvature: list[float] | None, steps: int
) -> list[Load]:
    """Return loads in even steps from rest to the given one, for a progress bar to count."""

    def load(share: float) -> Load:
        return Load(
            times(pressure, 1e3 * share),
            None if moment is None else times(moment, 1e-3 * share),
            None if curvature is None else times(curvature, share),
        )

    load(1.0)  # An error names the full load, not the first step.
    return [load(k / steps) for k in range(1, steps + 1)]


def _record(cell: PeriodCell, state: CellState, converged: bool) -> dict[str, Any]:
    length = cell.geometry.body_length
    angle, plane = state.bending(length)
    return {
        "bending_angle_deg": math.degrees(angle),
        "bending_plane_deg": math.degrees(plane) % 360.0,
        "curvature_per_m": state.curvature.tolist(),
        "moment_nmm": (1e3 * state.moment).tolist(),
        "stretch": state.stretch,
        "chamber_volume_mm3": (1e9 * length * state.volume).tolist(),
        "pressure_kpa": (1e-3 * state.pressure).tolist(),
        "converged": converged,
        "stable": state.stable,
        "jumped": state.jumped,
        "residual_n": state.residual,
        "elements": cell.elements,
        "unknowns": cell.unknowns,
    }


def _text(record: dict[str, Any], length: float) -> str:
    """Return the record for people; ``length`` is the body's [mm]."""
    stable = stability(record)
    if record["jumped"]:
        stable += ", after a snap of walls"
    return "\n".join(
        [
            f"pressures          {row(record['pressure_kpa'])} kPa ({stable})",
            f"bending angle      {record['bending_angle_deg']:.3f} deg over {length:g} mm, uniformly bent",
            f"bending plane      {round(record['bending_plane_deg'], 2) % 360.0:.2f} deg",
            f"curvature          {row(record['curvature_per_m'])} 1/m",
            f"moment             {row(record['moment_nmm'])} N mm",
            f"stretch            {record['stretch']:.5f} along the rod",
            f"chamber volumes    {row(record['chamber_volume_mm3'], '{:.1f}')} mm³ over {length:g} mm",
            f"mesh               {record['elements']} hexahedra, {record['unknowns']} unknowns",
        ]
    )
