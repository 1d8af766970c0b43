"""`rodmodel inverse`: pressures for a target bend or tip position."""

import argparse
import json
import math
import sys
from typing import Any

from rodmodel.cli._arguments import InputError, numbers
from rodmodel.cli._options import (
    GOOD,
    NO_CONVERGENCE,
    add_layout,
    add_loads,
    add_output,
    components,
    load_rod,
    loads_of,
)
from rodmodel.view import inverse_record, inverse_text

_ANGLE, _PLANE = "one angle of 0 or more [deg]", "one finite angle [deg]"


def add_to(commands: "argparse._SubParsersAction[argparse.ArgumentParser]") -> None:
    """Add the command."""
    parser = commands.add_parser("inverse", help="find the pressures for a target bend or tip position")
    add_layout(parser)
    add = parser.add_argument
    add("--bending-angle-deg", nargs="+", metavar="T", help=f"target bending angle: {_ANGLE}")
    add("--bending-plane-deg", nargs="+", metavar="G", help=f"target bending plane: {_PLANE}")
    add("--tip-position-mm", nargs="+", metavar="X", help="X Y Z: target of the cap's face centre [mm]")
    add_loads(parser)
    add_output(parser, plot=None)
    parser.set_defaults(command=_run)


def _run(options: argparse.Namespace) -> int:
    target = _target(options)
    loads = loads_of(options)
    found = load_rod(options).inverse(**target, **loads, throw=False)
    if found.solution.result.name == "bad_input":
        raise InputError(_beyond(options))
    record = inverse_record(found, is_bend="bending_angle" in target)
    print(json.dumps(record) if options.json else inverse_text(record))
    if record["reached"]:
        return GOOD
    print(f"rodmodel: {not_reached(record)}", file=sys.stderr)
    return NO_CONVERGENCE


def _beyond(options: argparse.Namespace) -> str:
    """Say which target is beyond what is searched for, or else that a load is."""
    if options.tip_position_mm is not None:
        return (
            f"--tip-position-mm: got {' '.join(options.tip_position_mm)!r}, expected a target within ten "
            "lengths of the actuator, in millimetres, and loads that can be computed with"
        )
    return (
        f"--bending-angle-deg: got {' '.join(options.bending_angle_deg)!r}, expected at most 570 deg, and "
        "loads that can be computed with"
    )


def not_reached(record: dict[str, Any]) -> str:
    """Say how far the search came, and what to do."""
    if record["result"] != "successful":
        return "no convergence: under the loads the rod has no equilibrium on its branch: take smaller loads"
    left = (
        f"{record['distance_deg']:.3g} deg away"
        if "distance_deg" in record
        else f"{record['distance_mm']:.3g} mm away"
    )
    if record["nearest"]:
        return f"out of reach: the above comes nearest and stays {left}: take a target in the workspace"
    if record["converged"]:
        return (
            f"not reached: the above stays {left}, and no small change of pressures comes nearer; others "
            "may: take a target nearer to a pose that is reached"
        )
    return f"no convergence: the search ended {left}: take a target nearer to a pose that is reached"


def _target(options: argparse.Namespace) -> dict[str, Any]:
    """Return the target in SI, as `CoreRod.inverse` takes it."""
    flags = ("--bending-angle-deg", "--bending-plane-deg", "--tip-position-mm")
    values = (options.bending_angle_deg, options.bending_plane_deg, options.tip_position_mm)
    given = [flag for flag, value in zip(flags, values, strict=True) if value is not None]
    if given == [flags[2]]:
        position = components(flags[2], options.tip_position_mm, "mm")
        assert position is not None
        return {"tip_position": 1e-3 * position}
    if given != list(flags[:2]):
        raise InputError(
            f"{', '.join(flags)}: got {' and '.join(given) or 'none of them'}, "
            "expected the first two, or the last"
        )
    (angle,) = numbers(flags[0], options.bending_angle_deg, 1, _ANGLE, negative=False)
    (plane,) = numbers(flags[1], options.bending_plane_deg, 1, _PLANE, negative=True)
    return {"bending_angle": math.radians(angle), "bending_plane": math.radians(plane)}
