"""Progress bar for long work, with rate and remaining time."""

import contextlib
import sys
from collections.abc import Callable, Iterator

from rich.console import Console
from rich.progress import (
    BarColumn,
    Progress,
    ProgressColumn,
    Task,
    TextColumn,
    TimeElapsedColumn,
    TimeRemainingColumn,
)
from rich.text import Text

Advance = Callable[[int, str], None]  # units done since the last call, description


class _Rate(ProgressColumn):
    def __init__(self, unit: str) -> None:
        super().__init__()
        self._unit = unit

    def render(self, task: Task) -> Text:
        return Text("" if not task.speed else f"{task.speed:.2f} {self._unit}/s")


@contextlib.contextmanager
def progress_bar(total: int, unit: str, show: bool | None = None) -> Iterator[Advance]:
    """Show a progress bar on standard error.

    Parameters
    ----------
    total : number of units of work.
    unit : plural name of the unit.
    show : whether to show it; if None, only on a terminal.
    """
    bar = Progress(
        TextColumn("{task.description}"),
        BarColumn(),
        TextColumn("{task.completed}/{task.total} " + unit),
        _Rate(unit),
        TimeElapsedColumn(),
        TextColumn("left"),
        TimeRemainingColumn(),
        console=Console(stderr=True),
        speed_estimate_period=120.0,
        disable=not (sys.stderr.isatty() if show is None else show),
    )
    with bar:
        task = bar.add_task("", total=total)
        yield lambda done, doing: bar.update(task, advance=done, description=doing)
