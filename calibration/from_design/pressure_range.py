"""Stage 1: the range of pressures, found by a coarse cell.

The cell is bent by one chamber and by two, until it has the wanted angle, the section gives way, or the
silicone leaves the stretch at which it was tested. Where pairs end at a lower pressure than one chamber, the
domain leaves less pressure to chambers beside each other. A design that names its pressures keeps them; the
same paths then tell what happens on the way.
"""

import contextlib
import math
import time
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from calibration.from_design.stage_record import StageError, kept, on_file
from calibration.from_design.task import Task
from calibration.processes import Job, JobError, run_jobs
from calibration.progress import progress_bar
from calibration.sweep import steps_over_a_snap, usual_end_compliance, usual_moments
from fem_reference import CellError, CellState, Design, Load, PeriodCell, design_text, follow, level_record
from fem_reference.cell import stretch_beyond_tests
from fem_reference.geometry import Units
from rodmodel import Domain

Trace = Callable[[Any, CellState | None], Iterator[CellState]]

#: Why a path ends.
ANGLE, STABILITY, STRETCH, SOLVER, GIVEN = "angle", "stability", "stretch", "solver", "given"
# Step of the pressure, and the largest one, in the body's megapascals (`Units`).
_STEP, _MOST = 4e-3, 0.5
# Bisections of the step in which a path ends.
_HALVINGS = 2


@dataclass(frozen=True)
class PathEnd:
    """How far one chamber, or two alike, can be pressurised.

    Parameters
    ----------
    chambers : numbers from 1.
    pressure : of each of them at the end [Pa].
    angle : bending angle over the body's length there [rad].
    reason : `ANGLE`, `STABILITY`, `STRETCH`, `SOLVER` or `GIVEN`.
    detail : the reason in words.
    pressures, angles : of the states on the way [Pa], [rad].
    seconds : median time of a state [s].
    """

    chambers: tuple[int, ...]
    pressure: float
    angle: float
    reason: str
    detail: str
    pressures: tuple[float, ...]
    angles: tuple[float, ...]
    seconds: float

    @classmethod
    def of(cls, record: Mapping[str, Any]) -> "PathEnd":
        """Return the end of a record of JSON."""
        lists = {key: tuple(record[key]) for key in ("chambers", "pressures", "angles")}
        return cls(**{**record, **lists})

    @property
    def title(self) -> str:
        """Chambers in words."""
        return title_of(self.chambers)

    def record(self) -> dict[str, Any]:
        """Return the end for JSON."""
        return asdict(self)


def title_of(chambers: Sequence[int]) -> str:
    """Return chambers in words."""
    return f"chamber{'s' if len(chambers) > 1 else ''} {' and '.join(map(str, chambers))}"


def range_paths(design: Design) -> tuple[tuple[int, ...], ...]:
    """Return the chambers to follow: those that the section's symmetry does not make alike."""
    if design.symmetry == "full":
        return (1,), (2, 3)
    if design.symmetry == "mirror":
        return (1,), (2,), (1, 2), (2, 3)
    return (1,), (2,), (3,), (1, 2), (2, 3), (3, 1)


def find_range(task: Task) -> tuple[PathEnd, ...]:
    """Return how far the cell of a design can be pressurised, by one chamber and by two.

    Each path has a file of its own, and is followed once.

    Raises
    ------
    StageError
        If there is no mesh of the cell, or it gives way at the first step of a path.
    """
    paths, ends = range_paths(task.design), []
    missing = [chambers for chambers in paths if not _is_on_file(task, chambers)]
    with progress_bar(len(paths), "paths") as advance:
        advance(len(paths) - len(missing), "range")
        if len(missing) > 1 and task.workers > 1:
            _follow_all(task, missing, advance)
        for chambers in paths:
            known = _is_on_file(task, chambers)
            # A path that failed in a process has no file, and fails here again, with its error.
            ends.append(_follow_one(task, chambers))
            advance(0 if known else 1, title_of(chambers))
    return tuple(ends)


def _follow_all(task: Task, paths: Sequence[tuple[int, ...]], advance: Callable[[int, str], None]) -> None:
    """Follow paths in processes; one that fails leaves no file."""
    counted = 0

    def watch(names: Collection[str]) -> None:
        nonlocal counted
        now = sum(_is_on_file(task, chambers) for chambers in paths)
        advance(now - counted, ", ".join(names))
        counted = now

    jobs = [Job(title_of(chambers), _try_one, (task, chambers)) for chambers in paths]
    try:
        run_jobs(jobs, task.workers, watch)
    except JobError as error:
        raise StageError(f"range: {error}; run again to resume") from error
    watch(())


def _try_one(task: Task, chambers: tuple[int, ...]) -> None:
    with contextlib.suppress(StageError):
        _follow_one(task, chambers)


def _follow_one(task: Task, chambers: tuple[int, ...]) -> PathEnd:
    """Follow a path to its end, or read that from its file."""

    def end() -> dict[str, Any]:
        try:
            cell = PeriodCell.of(task.design, task.levels.first, first_compliance(task.design))
        except ValueError as error:
            raise StageError(f"range: {error}") from error
        return path_end(
            lambda loads, start: follow(cell, loads, start=start, jumps=False),
            chambers,
            task.design,
            task.angle,
            lambda state: stretch_beyond_tests(cell, state),
        ).record()

    return PathEnd.of(kept(task.directory, *_stage(task, chambers), end))


def _stage(task: Task, chambers: tuple[int, ...]) -> tuple[str, dict[str, Any]]:
    """Return the name of a path's file, and what its end depends on."""
    inputs = {
        "design": design_text(task.design),
        "mesh": level_record(task.levels.first),
        "end_compliance": first_compliance(task.design),
        "angle": task.angle,
        "chambers": chambers,
    }
    return f"range-{''.join(map(str, chambers))}", inputs


def _is_on_file(task: Task, chambers: tuple[int, ...]) -> bool:
    return on_file(task.directory, *_stage(task, chambers)) is not None


def first_compliance(design: Design) -> float:
    """Return the compliance of a design's ends before any run of it [m/N]: its own, or the usual one."""
    own = design.end_compliance
    return usual_end_compliance(design) if own is None else own


def path_end(
    trace: Trace,
    chambers: Sequence[int],
    design: Design,
    wanted: float,
    beyond_tests: Callable[[CellState], str | None],
) -> PathEnd:
    """Follow a cell's free bending by some chambers to its end.

    Parameters
    ----------
    trace : continuation of the cell, which ends where walls lose their balance.
    chambers : numbers from 1; all have the same pressure.
    design : of the cell.
    wanted : angle over the body's length at which a path ends [rad]; of no matter if the design names its
        pressures.
    beyond_tests : says how a state leaves the tested range of stretch, or None.

    Raises
    ------
    StageError
        If the cell gives way at the first step.
    """
    length, unit = design.geometry.body_length, design.units.megapascal
    last = given_pressure(design, chambers)
    step = _STEP * unit if last is None else last / math.ceil(last / (_STEP * unit))
    most = _MOST * unit if last is None else last
    count = max(1, round(most / step))
    states: list[CellState] = []
    seconds: list[float] = []

    def ended(bent: float, reason: str, detail: str, pressure: float) -> PathEnd:
        pressures = [_pressure(state, chambers) for state in states]
        angles = [state.bending(length)[0] for state in states]
        pace = float(np.median(seconds or [0.0]))
        return PathEnd(tuple(chambers), pressure, bent, reason, detail, tuple(pressures), tuple(angles), pace)

    def good(state: CellState) -> tuple[str, str] | None:
        if state.jumped or state.stable is False:
            return STABILITY, "the section loses its stability"
        if (told := beyond_tests(state)) is not None:
            return STRETCH, told
        return None

    why: tuple[str, str] | None = None
    clock = time.monotonic()
    try:
        for state in trace((_load(step * n, chambers) for n in range(1, count + 1)), None):
            seconds.append(time.monotonic() - clock)
            clock = time.monotonic()
            why = good(state)
            if why is None and states and steps_over_a_snap(trace, states[-1], state, design.units):
                why = STABILITY, "the walls snap"
            if why is not None:
                break
            states.append(state)
            if last is None and state.bending(length)[0] >= wanted:
                before, at = ([0.0, *(s.bending(length)[0] for s in states)])[-2:]
                reached = step * (len(states) - 1 + (wanted - before) / (at - before))
                return ended(wanted, ANGLE, f"the wanted angle, {math.degrees(wanted):.4g} deg", reached)
    except CellError as error:
        why = (STABILITY, "the walls lose their stability") if error.unstable else (SOLVER, str(error))
    if why is None:
        reason = (GIVEN, "the design's") if last is not None else (SOLVER, "the largest pressure tried")
        return ended(states[-1].bending(length)[0], *reason, _pressure(states[-1], chambers))
    if not states:
        raise StageError(
            f"range: {title_of(chambers)}: {why[1]} below {1e-3 * step:.3g} kPa, expected a body that bends"
        )
    _approach(trace, chambers, states, step, good, design.units)
    return ended(states[-1].bending(length)[0], *why, _pressure(states[-1], chambers))


def _approach(
    trace: Trace,
    chambers: Sequence[int],
    states: list[CellState],
    step: float,
    good: Callable[[CellState], object],
    units: Units,
) -> None:
    """Add states nearer to the end of a path, by bisection of its last step."""
    for _ in range(_HALVINGS):
        step *= 0.5
        tried = _load(_pressure(states[-1], chambers) + step, chambers)
        try:
            state = next(iter(trace([tried], states[-1])))
            snaps = steps_over_a_snap(trace, states[-1], state, units)
        except CellError:
            continue
        if good(state) is None and not snaps:
            states.append(state)


def given_pressure(design: Design, chambers: Sequence[int]) -> float | None:
    """Return the largest pressure of the chambers together that the design names [Pa], or None."""
    if design.pressure_max is None or design.pressure_sum_max is None:
        return None
    each = min(design.pressure_max[k - 1] for k in chambers)
    return min(each, design.pressure_sum_max / len(chambers))


def domain_of(design: Design, ends: Sequence[PathEnd]) -> Domain:
    """Return the domain of a design's own pressures, or the one that the ends of paths leave.

    Its corners are those of one chamber and of two. Pressures found are rounded down to three digits.
    """
    moment, torque = usual_moments(design)
    if design.pressure_max is not None and design.pressure_sum_max is not None:
        return Domain(design.pressure_max, design.pressure_sum_max, moment, torque)
    single = {end.chambers[0]: end.pressure for end in ends if len(end.chambers) == 1}
    # Chambers that the symmetry makes alike.
    second = single.get(2, single[1])
    each = [rounded_down(p) for p in (single[1], second, single.get(3, second))]
    pair = rounded_down(min(end.pressure for end in ends if len(end.chambers) == 2))
    most = max(each)
    first, second, third = each
    if pair >= most:
        return Domain((first, second, third), 2.0 * pair, moment, torque)
    # A pair below half of one chamber's pressure would want a share above one. Three digits are enough.
    share = min(math.ceil(1e3 * (most / pair - 1.0) - 1e-9) / 1e3, 1.0)
    beside = rounded_down((1.0 + share) * pair)
    first, second, third = (min(p, beside) for p in each)
    return Domain((first, second, third), 2.0 * pair, moment, torque, share, beside)


def rounded_down(pressure: float) -> float:
    """Return a pressure rounded down to three digits."""
    unit = 10.0 ** (math.floor(math.log10(pressure)) - 2)
    return float(f"{math.floor(pressure / unit + 1e-9) * unit:.6g}")


def _load(pressure: float, chambers: Sequence[int]) -> Load:
    first, second, third = (pressure if k in chambers else 0.0 for k in (1, 2, 3))
    return Load((first, second, third), (0.0, 0.0, 0.0))


def _pressure(state: CellState, chambers: Sequence[int]) -> float:
    return float(state.load.pressure[chambers[0] - 1])
