"""`rodmodel workspace`: reachable tip positions and bends."""

import argparse
import json
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

from rodmodel.cli._arguments import InputError, whole_number
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
from rodmodel.view import workspace_record, workspace_text

# Fewest and most samples.
_SAMPLES = (100, 1_000_000)


def add_to(commands: "argparse._SubParsersAction[argparse.ArgumentParser]") -> None:
    """Add the command."""
    parser = commands.add_parser(
        "workspace", help="sample the calibrated pressures: reachable tip positions and bends"
    )
    add_layout(parser)
    parser.add_argument(
        "--samples", default="4000", metavar="N", help="approximate number, 100 to 1000000 (default: 4000)"
    )
    add_loads(parser)
    add_output(parser, plot="tip positions and the map of angle and plane")
    parser.set_defaults(command=_run)


def _run(options: argparse.Namespace) -> int:
    samples = whole_number("--samples", options.samples, *_SAMPLES)
    loads = loads_of(options)
    check_plot_file(options)
    rod = load_rod(options)
    from rodmodel.control import workspace

    with _progress() as advance:
        space = workspace(rod, samples, loads, advance)
    record = workspace_record(space)
    failed = int((~space.converged).sum())
    if failed == len(space.converged):
        raise InputError(
            "--tip-force-n, --tip-moment-nmm, --gravity: got loads that the rod cannot carry, "
            "expected smaller ones"
        )

    def draw(file: Path) -> None:
        # Imported late: importing matplotlib takes as long as the samples.
        from rodmodel.view import plot_workspace

        plot_workspace(space, rod.actuator, file)

    plot(options, draw)
    print(json.dumps(record) if options.json else workspace_text(record))
    if failed:
        print(
            f"rodmodel: no convergence at {failed} of {len(space.converged)} pressures, which are left out "
            "above",
            file=sys.stderr,
        )
        return NO_CONVERGENCE
    return GOOD


@contextmanager
def _progress() -> Iterator[Callable[[int, int], None]]:
    """Show a progress bar if standard error is a terminal."""
    if not sys.stderr.isatty():
        yield lambda done, total: None
        return
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

    columns = (TextColumn("poses"), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn())
    with Progress(*columns, console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task("poses", total=None)
        yield lambda done, total: bar.update(task, completed=done, total=total)
