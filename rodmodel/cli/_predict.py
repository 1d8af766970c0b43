"""`rodmodel predict`: the pose under given pressures and loads."""

import argparse
import json
import sys
from pathlib import Path

import numpy as np

from rodmodel._arguments import InputError, numbers
from rodmodel._equilibria import FixedStep
from rodmodel._report import prediction_record, prediction_text
from rodmodel._rod import Rod
from rodmodel.cli._options import (
    GOOD,
    NO_CONVERGENCE,
    add_layout,
    add_loads,
    add_output,
    check_plot_file,
    load_rod,
    loads_of,
    plot,
)

# Compiles in a third of the reference solver's time. Of random loads over the domain 99.9 % agree with it to
# 2e-6 of the length, the worst, where the section has hardly any stiffness, to 4e-4.
_SOLVER = FixedStep(32)
_PRESSURES = "three gauge pressures, one for each chamber, each 0 or more [kPa]"


def add_to(commands: "argparse._SubParsersAction[argparse.ArgumentParser]") -> None:
    """Add the command."""
    parser = commands.add_parser(
        "predict", help="predict pose and chamber volumes under pressures and dead loads"
    )
    add_layout(parser)
    parser.add_argument("--pressure-kpa", nargs="+", default=[], metavar="P", help=f"P1 P2 P3: {_PRESSURES}")
    add_loads(parser)
    add_output(parser, plot="the bent rod")
    parser.set_defaults(command=_run)


def _run(options: argparse.Namespace) -> int:
    pressure_kpa = numbers("--pressure-kpa", options.pressure_kpa, 3, _PRESSURES, negative=False)
    loads = loads_of(options)
    check_plot_file(options)
    rod = load_rod(options)
    pressure = 1e3 * np.array(pressure_kpa)
    _check_domain(rod, pressure, options.pressure_kpa)
    solution = rod.solve(pressure, **loads, throw=False, solver=_SOLVER)

    def draw(file: Path) -> None:
        # Imported late: matplotlib takes as long to import as a prediction takes.
        from rodmodel.plot import plot_rod

        plot_rod([(pressure, solution)], rod.actuator, file)

    plot(options, draw)
    record = prediction_record(solution)
    print(json.dumps(record) if options.json else prediction_text(record))
    if not record["converged"]:
        reached = 100.0 * float(solution.stats["load_fraction"])
        print(
            f"rodmodel: no convergence, the above is the equilibrium at {reached:.3g} % of the loads",
            file=sys.stderr,
        )
        return NO_CONVERGENCE
    return GOOD


def _check_domain(rod: Rod, pressure: np.ndarray, came: list[str]) -> None:
    domain = rod.domain
    if not domain.covers_pressure(pressure):
        first, second, third = (1e-3 * maximum for maximum in domain.pressure_max)
        raise InputError(
            f"--pressure-kpa: got {' '.join(came)!r}, expected what the calibration covers: "
            f"at most {first:g}, {second:g}, {third:g} kPa in chambers 1, 2, 3 "
            f"and {1e-3 * domain.pressure_sum_max:g} kPa in sum"
        )
