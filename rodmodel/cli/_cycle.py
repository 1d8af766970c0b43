"""`rodmodel cycle`: pressures up from rest and down again, with the jumps between branches."""

import argparse
import json
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from rodmodel.cli._arguments import InputError, numbers, whole_number
from rodmodel.cli._options import (
    GOOD,
    NO_CONVERGENCE,
    add_layout,
    add_loads,
    add_output,
    check_plot_file,
    load_branches,
    loads_of,
    plot,
)
from rodmodel.view import cycle_record, cycle_text

if TYPE_CHECKING:
    import rodmodel.control

_PRESSURES = "the three gauge pressures at the top of the cycle, each 0 or more [kPa]"
# Fewest and most steps each way.
_STEPS = (2, 1000)


def add_to(commands: "argparse._SubParsersAction[argparse.ArgumentParser]") -> None:
    """Add the command."""
    parser = commands.add_parser("cycle", help="pressures up from rest and down again: jumps and hysteresis")
    add_layout(parser)
    parser.add_argument("--pressure-kpa", nargs="+", default=[], metavar="P", help=f"P1 P2 P3: {_PRESSURES}")
    parser.add_argument(
        "--steps", default="28", metavar="N", help="number of steps each way, 2 to 1000 (default: 28)"
    )
    add_loads(parser)
    add_output(parser, plot="bending angle and plane, up and down")
    parser.set_defaults(command=_run)


def _run(options: argparse.Namespace) -> int:
    top = 1e3 * np.array(numbers("--pressure-kpa", options.pressure_kpa, 3, _PRESSURES, negative=False))
    steps = whole_number("--steps", options.steps, *_STEPS)
    if not top.any():
        raise InputError(f"--pressure-kpa: got {' '.join(options.pressure_kpa)!r}, expected one above 0")
    loads = loads_of(options)
    check_plot_file(options)
    branches = load_branches(options)
    shares = np.concatenate([np.arange(steps + 1), np.arange(steps)[::-1]]) / steps
    found: list[rodmodel.control.BranchSolution] = []
    before = _rest()
    for share in shares:
        found.append(branches.solve(share * top, before, throw=False, **loads))
        before = found[-1].branch
        # Between branches there may be pressures that none is calibrated for: the cycle goes on, and says so.
        if share == 1.0 and not branches.rod(before).domain.covers_pressure(top):
            raise InputError(
                f"--pressure-kpa: got {' '.join(options.pressure_kpa)!r}, expected the top of the cycle "
                "inside the calibration: no branch is known there"
            )
    record = cycle_record(shares[:, None] * top, found)

    def draw(file: Path) -> None:
        from rodmodel.view import plot_cycle

        plot_cycle(record, file)

    plot(options, draw)
    print(json.dumps(record) if options.json else cycle_text(record))
    calibrated = (state for state in record["states"] if state["in_domain"])
    return GOOD if all(state["converged"] for state in calibrated) else NO_CONVERGENCE


def _rest() -> "rodmodel.control.Branch":
    from rodmodel.control import LOADING

    return LOADING
