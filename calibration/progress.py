"""Progress of long work on a terminal: bars with rate and remaining time, also over several stages."""

import contextlib
import sys
import time
from collections.abc import Callable, Iterator, Mapping

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

# Share of a stage after which its own pace tells its remaining time better than what was expected.
_TOLD = 0.1


class _Rate(ProgressColumn):
    def __init__(self, unit: str) -> None:
        super().__init__()
        self._unit = unit

    def render(self, task: Task) -> Text:
        return Text("" if not task.speed else f"{task.speed:.2f} {self._unit}/s")


class Stages:
    """Stages of a work, and the time that is left for all of them.

    Parameters
    ----------
    expected : expected duration of each stage in their order [s].
    """

    def __init__(self, expected: Mapping[str, float], clock: Callable[[], float] = time.monotonic) -> None:
        self._expected = dict(expected)
        self._clock = clock
        self._order = list(expected)
        self._stage = self._order[0]
        self._begun = clock()
        self._share = 0.0

    def expect(self, stage: str, seconds: float) -> None:
        """Correct the expected duration of a stage [s]."""
        self._expected[stage] = seconds

    def begin(self, stage: str) -> None:
        """Begin a stage; those before it are done."""
        self._stage, self._begun, self._share = stage, self._clock(), 0.0

    def reach(self, share: float) -> None:
        """Note how much of the stage is done, from 0 to 1."""
        self._share = min(max(share, 0.0), 1.0)

    @property
    def number(self) -> int:
        """Number of the stage, from 1."""
        return self._order.index(self._stage) + 1

    @property
    def title(self) -> str:
        """Number and name of the stage."""
        return f"{self.number}/{len(self._order)} {self._stage}"

    @property
    def left(self) -> float:
        """Time that is left [s]: of the stage by its own pace, once it has one, and of those after it."""
        later = sum(self._expected[name] for name in self._order[self.number :])
        gone = self._clock() - self._begun
        if self._share >= _TOLD:
            return gone * (1.0 / self._share - 1.0) + later
        return max(self._expected[self._stage] * (1.0 - self._share) - gone, 0.0) + later


_running: tuple[Progress, Stages] | None = None


@contextlib.contextmanager
def stages_bar(expected: Mapping[str, float], show: bool | None = None) -> Iterator[Stages]:
    """Show the progress of several stages on standard error; bars of their work appear below it.

    Parameters
    ----------
    expected : expected duration of each stage in their order [s].
    show : whether to show it; if None, only on a terminal.
    """
    global _running
    stages = Stages(expected)
    bar = Progress(
        TextColumn("{task.description}"),
        BarColumn(),
        TextColumn("{task.fields[told]}"),
        TimeElapsedColumn(),
        console=Console(stderr=True),
        disable=not (sys.stderr.isatty() if show is None else show),
    )
    with bar:
        _running = bar, stages
        try:
            yield stages
        finally:
            _running = None


@contextlib.contextmanager
def progress_bar(total: int, unit: str, show: bool | None = None) -> Iterator[Advance]:
    """Show a progress bar on standard error.

    Within `stages_bar` it is the bar of the present stage.

    Parameters
    ----------
    total : number of units of work.
    unit : plural name of the unit.
    show : whether to show it; if None, only on a terminal.
    """
    if _running is not None:
        with _stage_bar(*_running, total, unit) as advance:
            yield advance
        return
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


@contextlib.contextmanager
def _stage_bar(bar: Progress, stages: Stages, total: int, unit: str) -> Iterator[Advance]:
    task = bar.add_task(stages.title, total=max(total, 1), told="")
    stages.reach(0.0)
    done = 0

    def advance(more: int, doing: str) -> None:
        nonlocal done
        done += more
        stages.reach(done / max(total, 1))
        told = f"{done}/{total} {unit}, {doing}; {_in_words(stages.left)} left in all"
        bar.update(task, completed=done, told=told)

    try:
        yield advance
    finally:
        bar.remove_task(task)


def _in_words(seconds: float) -> str:
    if seconds < 90.0:
        return f"{seconds:.0f} s"
    return f"{seconds / 60.0:.0f} min" if seconds < 5400.0 else f"{seconds / 3600.0:.1f} h"
