"""Progress of a path of loads on a terminal, with its rate and the time left."""

import sys
from collections.abc import Iterable, Iterator

from rich.console import Console
from rich.progress import (
    BarColumn,
    MofNCompleteColumn,
    Progress,
    TextColumn,
    TimeElapsedColumn,
    TimeRemainingColumn,
)

from fem_reference.cell import CellState


def track(states: Iterable[CellState], total: int) -> Iterator[CellState]:
    """Pass the states through, and show each on standard error where that is a terminal."""
    bar = Progress(
        TextColumn("{task.description}"),
        BarColumn(),
        MofNCompleteColumn(),
        TextColumn("{task.fields[rate]}"),
        TimeElapsedColumn(),
        TextColumn("left"),
        TimeRemainingColumn(),
        console=Console(stderr=True),
        disable=not sys.stderr.isatty(),
    )
    with bar:
        task = bar.add_task("load steps", total=total, rate="")
        for state in states:
            pressures = " ".join(f"{p / 1e3:.1f}" for p in state.pressure)
            speed = bar.tasks[task].speed
            rate = "" if speed is None else f"{speed:.2f} steps/s"
            bar.update(
                task, advance=1, description=f"{pressures} kPa, {state.iterations} iterations", rate=rate
            )
            yield state
