"""`rodmodel predict`: pose under pressures and loads."""

import argparse
import json
import math
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from rodmodel.cli._arguments import InputError, numbers
from rodmodel.cli._options import (
    GOOD,
    NO_CONVERGENCE,
    add_layout,
    add_loads,
    add_output,
    check_plot_file,
    components,
    load_branches,
    loads_of,
    plot,
)
from rodmodel.view import prediction_record, prediction_text

if TYPE_CHECKING:
    import rodmodel.control

# Largest component of a rotation vector [deg]: of more turns, rounding decides the rest.
_MOST_TURN = 1e6
_PRESSURES = "three gauge pressures, one for each chamber, each 0 or more [kPa]"


def add_to(commands: "argparse._SubParsersAction[argparse.ArgumentParser]") -> None:
    """Add the command."""
    parser = commands.add_parser("predict", help="predict pose and chamber volumes under pressures and loads")
    add_layout(parser)
    add = parser.add_argument
    add("--pressure-kpa", nargs="+", default=[], metavar="P", help=f"P1 P2 P3: {_PRESSURES}")
    add_loads(parser)
    add(
        "--distributed-force-n-per-m",
        nargs="+",
        metavar="F",
        help="FX FY FZ: force per length along the body, world frame [N/m]",
    )
    add(
        "--follower-force-n",
        nargs="+",
        metavar="F",
        help="FX FY FZ: on the cap's outer face, turning with the cap, frame of the cap [N]",
    )
    add(
        "--follower-moment-nmm",
        nargs="+",
        metavar="M",
        help="MX MY MZ: on the cap, turning with it, frame of the cap [N mm]",
    )
    add(
        "--base-position-mm",
        nargs="+",
        metavar="X",
        help="X Y Z: position of the clamp, world frame [mm] (default: 0 0 0)",
    )
    add(
        "--base-rotation-deg",
        nargs="+",
        metavar="R",
        help="RX RY RZ: rotation vector of the clamp, world frame: axis times angle [deg]",
    )
    add(
        "--branch",
        choices=("auto", "loading", "snapped"),
        default="auto",
        help="branch of equilibria: upright, with a partition wall snapped to one side by the chamber with "
        "the largest pressure, or the one that an actuator loaded from rest is on (default)",
    )
    add_output(parser, plot="the bent rod")
    parser.set_defaults(command=_run)


def _run(options: argparse.Namespace) -> int:
    pressure_kpa = numbers("--pressure-kpa", options.pressure_kpa, 3, _PRESSURES, negative=False)
    given = {**loads_of(options), **_more_of(options)}
    check_plot_file(options)
    branches = load_branches(options)
    pressure = 1e3 * np.array(pressure_kpa)
    found = on_branch(branches, pressure, options, **given)

    def draw(file: Path) -> None:
        # Imported late: importing matplotlib takes far longer than a prediction.
        from rodmodel.view import plot_rod

        plot_rod([(pressure, found.solution)], branches.loading.actuator, file, given)

    plot(options, draw)
    record = prediction_record(found.solution, found)
    print(json.dumps(record) if options.json else prediction_text(record))
    if not record["converged"]:
        print(f"rodmodel: no convergence: {stopped(record)}", file=sys.stderr)
        return NO_CONVERGENCE
    return GOOD


def _more_of(options: argparse.Namespace) -> dict[str, Any]:
    """Return the loads and the base in SI that only a prediction takes."""
    cap, world = "the frame of the cap", "the world frame"
    moment = components("--follower-moment-nmm", options.follower_moment_nmm, "N mm", cap)
    position = components("--base-position-mm", options.base_position_mm, "mm", world)
    turn_deg = components("--base-rotation-deg", options.base_rotation_deg, "deg", world)
    if turn_deg is not None and np.abs(turn_deg).max() > _MOST_TURN:
        raise InputError(
            f"--base-rotation-deg: got {' '.join(options.base_rotation_deg)!r}, expected angles of at most "
            f"{_MOST_TURN:g} deg"
        )
    return {
        "distributed_force": components(
            "--distributed-force-n-per-m", options.distributed_force_n_per_m, "N/m"
        ),
        "follower_force": components("--follower-force-n", options.follower_force_n, "N", cap),
        "follower_moment": None if moment is None else 1e-3 * moment,
        "base_position": None if position is None else 1e-3 * position,
        "base_rotation": None if turn_deg is None else _rotation(np.radians(turn_deg)),
    }


def _rotation(turn: np.ndarray) -> np.ndarray:
    """Return the rotation matrix of a rotation vector [rad] (Rodrigues)."""
    angle = float(np.linalg.norm(turn))
    if angle == 0.0:
        return np.eye(3)
    x, y, z = turn / angle
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.eye(3) + math.sin(angle) * cross + (1.0 - math.cos(angle)) * cross @ cross


def stopped(record: dict[str, Any]) -> str:
    """Say at which part of its loads a solve ended, why, and what to do."""
    from rodmodel.core import Result

    fraction = record["load_fraction"]
    reached = "at no part of the loads" if fraction is None else f"at {100.0 * fraction:.3g} % of the loads"
    beyond = "" if record["in_domain"] else " and beyond the calibration"
    return f"the above is the equilibrium {reached}{beyond}: {Result[record['result']].message}"


def on_branch(
    branches: "rodmodel.control.Branches",
    pressure: np.ndarray,
    options: argparse.Namespace,
    **given: Any,
) -> "rodmodel.control.BranchSolution":
    """Solve on the branch that `--branch` asks for; refuse pressures that the branch does not reach."""
    from rodmodel.control import LOADING

    try:
        found = branches.solve(pressure, branch=options.branch, throw=False, **given)
    except ValueError as error:
        raise InputError(f"--{error}") from error
    domain = branches.rod(found.branch).domain
    if not domain.covers_pressure(pressure):
        where = "the calibration" if found.branch == LOADING else "the snapped branch"
        raise InputError(
            f"--pressure-kpa: got {' '.join(options.pressure_kpa)!r}, expected pressures inside {where}: "
            f"at most {domain.largest_pressures('kPa')}"
        )
    return found
