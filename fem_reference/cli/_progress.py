"""Progress bar for a path of loads, with rate and remaining time."""

import sys
from collections.abc import Callable, Iterable, Iterator
from typing import TypeVar

from rich.console import Console
from rich.progress import (
    BarColumn,
    MofNCompleteColumn,
    Progress,
    TextColumn,
    TimeElapsedColumn,
    TimeRemainingColumn,
)

from fem_reference.actuator import ActuatorState
from fem_reference.cell import CellState

T = TypeVar("T")


def track(states: Iterable[CellState], total: int) -> Iterator[CellState]:
    """Yield the cell's states, with a progress bar on standard error if it is a terminal."""
    return _track(states, total, lambda state: (state.pressure, state.iterations))


def track_actuator(states: Iterable[ActuatorState], total: int) -> Iterator[ActuatorState]:
    """Yield the actuator's states, with a progress bar on standard error if it is a terminal."""
    return _track(states, total, lambda state: (state.load.pressure, state.settled.iterations))


def _track(
    states: Iterable[T], total: int, progress_of: Callable[[T], tuple[Iterable[float], int]]
) -> Iterator[T]:
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
            pressure, iterations = progress_of(state)
            pressures = " ".join(f"{p / 1e3:.1f}" for p in pressure)
            speed = bar.tasks[task].speed
            rate = "" if speed is None else f"{speed:.2f} steps/s"
            bar.update(task, advance=1, description=f"{pressures} kPa, {iterations} iterations", rate=rate)
            yield state
