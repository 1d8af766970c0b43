"""``rodmodel-fem actuator``: the whole actuator with cap, tip loads and gravity."""

import argparse
import json
import math
import sys
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

from fem_reference.actuator import Actuator, ActuatorError, ActuatorLoad, ActuatorState
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
from fem_reference.cli._progress import track_actuator
from fem_reference.design import BONDS, Design
from fem_reference.geometry import SI, Core
from fem_reference.io import (
    ActuatorRun,
    ActuatorSeries,
    RunError,
    draw_actuator,
    load_record,
    state_record,
    write_actuator_vtk,
)
from fem_reference.materials import Ogden

# Load step in the body's megapascals: 5 kPa in the paper's actuator.
_STEP = 5e-3


def add_command(commands: Any) -> None:
    """Add the command to the parser."""
    actuator = commands.add_parser(
        "actuator", help="whole actuator, clamped at its base: angle, plane, tip, volumes, axis"
    )
    add = actuator.add_argument
    add_actuator(add, elements="coarse")
    add("--tip-force-n", nargs="+", metavar="F", help="FX FY FZ: on the cap's outer face [N]")
    add("--tip-moment-nmm", nargs="+", metavar="M", help="MX MY MZ: on the cap's outer face [N mm]")
    add("--follower", action="store_true", help="tip force and moment turn with the cap")
    add("--gravity", nargs="+", metavar="G", help="GX GY GZ: acceleration [m/s²], (0, 0, -9.81) if upright")
    add("--density-kg-per-m3", nargs="+", metavar="D", help="(default: 1070, or the design's)")
    add(
        "--bonded",
        help=f"cavity bonded to the rod in: {', '.join(BONDS)} (default: cap, or the design's)",
    )
    add(
        "--slack-share",
        nargs="+",
        metavar="S",
        help="thread stiffness in compression over that in tension; 1e-4 for a yarn (default: 1, or the "
        "design's)",
    )
    add(
        "--symmetric",
        action="store_true",
        help="mirror symmetry about the plane through chamber 1: half the unknowns, for symmetric loads",
    )
    add("--run", metavar="DIR", help="directory that keeps every load step; a killed run resumes from it")
    add("--json", action="store_true", help="print one JSON object and nothing else")
    add(
        "--vtk",
        metavar="FILE",
        help="write the deformed body and its winding for ParaView (.vtu, .vtk; .pvd for every load step)",
    )
    add("--plot", metavar="FILE", help="draw the deformed body (.png, .pdf, .svg)")
    actuator.set_defaults(command=_actuator)


def _actuator(options: argparse.Namespace) -> int:
    if options.vtk is not None:
        check_writable("--vtk", Path(options.vtk), (".vtu", ".vtk", ".pvd"))
    if options.plot is not None:
        check_writable("--plot", Path(options.plot), PICTURES)
    try:
        design = _design(options)
        load = _load(options)
        loads = _ramp(load, max(load.pressure) / (_STEP * design.units.megapascal))
        actuator = Actuator.of(design, options.elements, options.symmetric)
        actuator.refuse(loads[-1])
        states, start, done = actuator.follow(loads), None, 0
        if options.run is not None:
            run = ActuatorRun(options.run, _description(actuator, loads))
            start, done = run.checkpoint(actuator, loads)
            states = run.states(actuator, loads)
    except (ValueError, RunError) as error:
        raise InputError(with_flags(str(error))) from error

    series = None
    if options.vtk is not None and Path(options.vtk).suffix == ".pvd":
        series = ActuatorSeries(options.vtk)

    def keep(number: int, state: ActuatorState) -> None:
        if series is not None:
            with writing("--vtk", options.vtk):
                series.add(number, actuator, state)

    if series is not None and start is not None:
        for number, load in enumerate(loads[:done], start=1):
            series.keep(number, load)
        # The run may have been killed after it saved this state and before it wrote the VTK file.
        keep(done, start)
    last, status = None, GOOD
    # If all steps are done, the last state is yielded again.
    number = min(done + 1, len(loads))
    try:
        for last in track_actuator(states, len(loads)):
            keep(number, last)
            number += 1
    except RunError as error:
        raise InputError(with_flags(str(error))) from error
    except ActuatorError as error:
        status = NO_CONVERGENCE
        print(f"rodmodel-fem: {error}; the last converged state follows", file=sys.stderr)
        last = error.last_good or last
        if error.last_good is not None:
            keep(number, error.last_good)
    if last is None:
        return status
    record = state_record(last) | {
        "converged": status == GOOD,
        "elements": actuator.elements,
        "unknowns": actuator.unknowns,
    }
    # Print first: a full disk may stop the files, but not the result.
    print(json.dumps(record) if options.json else _text(record))
    if options.vtk is not None and series is None:
        with writing("--vtk", options.vtk):
            write_actuator_vtk(actuator, last, options.vtk)
    if options.plot is not None:
        with writing("--plot", options.plot):
            draw_actuator(actuator, last, options.plot)
    return status


def _design(options: argparse.Namespace) -> Design:
    own = design_of(options)
    changed: dict[str, Any] = {}
    if options.density_kg_per_m3 is not None:
        changed["density"] = numbers("--density-kg-per-m3", options.density_kg_per_m3, 1, "kg/m³")[0]
    if options.slack_share is not None:
        (share,) = numbers("--slack-share", options.slack_share, 1, "-")
        changed["thread"] = replace(own.thread, slack_share=share)
    if options.bonded is not None:
        changed["bonded"] = options.bonded
    return replace(own, **changed)


def _load(options: argparse.Namespace) -> ActuatorLoad:
    none = (0.0, 0.0, 0.0)
    return ActuatorLoad(
        times(numbers("--pressure-kpa", options.pressure_kpa, 3, "kPa"), 1e3),
        times(optional("--tip-force-n", options.tip_force_n, "N") or none, 1.0),
        times(optional("--tip-moment-nmm", options.tip_moment_nmm, "N mm") or none, 1e-3),
        times(optional("--gravity", options.gravity, "m/s²") or none, 1.0),
        options.follower,
    )


def _ramp(load: ActuatorLoad, least: float) -> list[ActuatorLoad]:
    """Return loads in even steps from rest to the given one, for a progress bar to count."""
    steps = max(1, math.ceil(least))
    return [
        ActuatorLoad(
            times(load.pressure, k / steps),
            times(load.tip_force, k / steps),
            times(load.tip_moment, k / steps),
            times(load.gravity, k / steps),
            load.follower,
        )
        for k in range(1, steps + 1)
    ]


def _description(actuator: Actuator, loads: list[ActuatorLoad]) -> dict[str, Any]:
    """Return everything that a run's results depend on."""
    model = asdict(actuator.model)
    model["winding"] = {"name": actuator.model.winding.name, **model["winding"]}
    law = actuator.model.material
    if not isinstance(law, Ogden):
        model["material"] = {"law": type(law).__name__, **model["material"]}
    # Earlier runs have no core and no range of stretch, and are still those of these defaults.
    if actuator.model.core == Core():
        del model["core"]
    if law.stretch_range is None:
        del model["material"]["stretch_range"]
    # Checkpoints are in the body's units; those of earlier runs are in millimetres and megapascals.
    units = actuator.equations.units
    own = {} if units == SI else {"units": asdict(units)}
    return {"model": model, **own, "loads": [load_record(load) for load in loads]}


def _text(record: dict[str, Any]) -> str:
    stable = stability(record)
    if record["jumped"]:
        stable += f", after a jump at {row(record['limit_pressure_kpa'])} kPa"
    return "\n".join(
        [
            f"pressures          {row(record['pressure_kpa'])} kPa ({stable})",
            f"bending angle      {record['bending_angle_deg']:.3f} deg",
            f"bending plane      {round(record['bending_plane_deg'], 2) % 360.0:.2f} deg",
            f"tip position       {row(record['tip_position_mm'], '{:.3f}')} mm",
            f"chamber volumes    {row(record['chamber_volume_mm3'], '{:.1f}')} mm³",
            f"base force         {row(record['base_force_n'])} N",
            f"base moment        {row(record['base_moment_nmm'])} N mm",
            f"largest pressure on the rod {record['rod_pressure_kpa']:.1f} kPa, thread tension "
            f"{record['thread_tension_n']:.3f} N",
            f"mesh               {record['elements']} hexahedra, {record['unknowns']} unknowns",
        ]
    )
