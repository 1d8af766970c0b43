"""Trace one loading path by continuation, with a second attempt in smaller steps after a failure."""

import threading
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict, dataclass, replace
from functools import cache
from typing import Any, cast

import numpy as np

from calibration.sweep.design import LoadingPath, between
from calibration.sweep.loading_sheet import Trace, only_gives_way, states_in_plane, upright_states
from fem_reference import (
    CellError,
    CellState,
    Design,
    DoubleHelix,
    Load,
    MeshLevel,
    PeriodCell,
    follow,
)
from fem_reference.geometry import SI, Units

RETRY_SUBDIVISION = 4  # steps of the second attempt for each step of the first
# Change of curvature between neighbouring states that their Hessians need not explain, in one over the body's
# millimetre: 3 degrees over five diameters. Snaps of walls change the angle by 4 degrees and more.
UNEXPLAINED = 0.9e-3
# Bisections of a step before an unexplained change counts as a snap.
HALVINGS = 2


@dataclass(frozen=True)
class CellTracer:
    """Picklable factory of a period cell's continuation, which ends where the walls become unstable."""

    actuator: Design
    level: str | MeshLevel
    end_compliance: float = 0.0

    def __call__(self) -> Trace:
        """Build the cell in the calling process and return its continuation."""
        cell = PeriodCell.of(self.actuator, self.level, self.end_compliance)
        return lambda loads, start: follow(cell, loads, start=start, jumps=False)

    @property
    def units(self) -> Units:
        """Units of the body."""
        return self.actuator.units

    def in_plane(self) -> Trace | None:
        """Build a cell that keeps its plane of symmetry; None if the body has none."""
        if not self.actuator.mirror_in_place:
            return None
        cell = PeriodCell.of(self.actuator, self.level, self.end_compliance, symmetric=True)
        return lambda loads, start: follow(cell, loads, start=start, jumps=False)

    def oriented(self, psi: float) -> "CellTracer":
        """Return the same factory for a winding at another ψ [rad]."""
        winding = replace(cast(DoubleHelix, self.actuator.winding), psi=psi)
        return replace(self, actuator=replace(self.actuator, winding=winding))


# Thread-local, because a cell traces one path at a time.
_mine = threading.local()


def records_of(make_trace: Callable[[], Trace], path: LoadingPath) -> Iterator[dict[str, Any]]:
    """Yield a path's records (`trace_path`) in a worker, with one cell for all paths of a winding."""
    maker = make_trace if path.psi is None else cast(CellTracer, make_trace).oriented(path.psi)
    if getattr(_mine, "made_by", None) != maker:
        in_plane = maker.in_plane if isinstance(maker, CellTracer) else None
        _mine.trace, _mine.in_plane, _mine.made_by = maker(), in_plane and cache(in_plane), maker
    units = maker.units if isinstance(maker, CellTracer) else SI
    yield from trace_path(_mine.trace, path, units, _mine.in_plane)


def trace_path(
    trace: Trace,
    path: LoadingPath,
    units: Units = SI,
    in_plane: Callable[[], Trace | None] | None = None,
) -> Iterator[dict[str, Any]]:
    """Yield records of a path's states, then one that says how it ended.

    Where the section loses its lateral stability, the path goes on: in the plane of symmetry if its loads
    lie there (`states_in_plane`), else at imposed curvature (`upright_states`). It ends where the walls lose
    their balance. States beyond that are on another branch. It also ends where the Hessians of two
    neighbouring states do not explain their difference after bisection, because the continuation may have
    stepped over a snap to another stable branch. After a failure the path is traced once more from its last
    state, in smaller steps.

    Parameters
    ----------
    trace, path : continuation of the cell, and the path.
    units : of the body.
    in_plane : factory of the continuation of a cell that keeps its plane of symmetry, if there is one.
    """
    start: CellState | None = None
    left = list(path.loads)
    attempt, clock, most = 1, time.perf_counter(), UNEXPLAINED * units.metre
    while left:
        try:
            for reached in trace(list(left), start):
                for state in _with_states_between(trace, start, reached, most, HALVINGS):
                    if only_gives_way(state) and start is not None:
                        upright = _sheet(trace, in_plane, start, left)
                        yield from _upright(upright, left, attempt, asdict(state.load))
                        return
                    yield state_record(state, attempt, time.perf_counter() - clock)
                    if _lost(state):
                        yield {"end": {"unstable": asdict(state.load), "attempts": attempt}}
                        return
                    clock, start = time.perf_counter(), state
                del left[0]
        except _SnapError as snap:
            yield {"end": {"unstable": asdict(snap.load), "attempts": attempt}}
            return
        except CellError as error:
            at = None if error.reached is None else asdict(error.reached)
            if error.unstable and start is not None:
                yield from _upright(_sheet(trace, in_plane, start, left), left, attempt, at)
                return
            if error.unstable:
                yield {"end": {"unstable": at, "attempts": attempt}}
                return
            if attempt == 2:
                yield {"end": {"failure": str(error), "reached": at, "attempts": attempt}}
                return
            attempt = 2
            start = error.last_good if error.last_good is not None else start
            left = _subdivide(start.load if start is not None else Load((0.0, 0.0, 0.0)), left)
    yield {"end": {"attempts": attempt}}


def _sheet(
    trace: Trace, in_plane: Callable[[], Trace | None] | None, start: CellState, left: Sequence[Load]
) -> Iterator[tuple[Load, CellState]]:
    """Yield loads and states of the upright section after ``start``; see `loading_sheet`."""
    if in_plane is not None and all(load.in_plane for load in (start.load, *left)):
        symmetric = in_plane()
        if symmetric is not None:
            yield from states_in_plane(symmetric, start, left)
            return
    yield from upright_states(trace, start, left)


def _upright(
    states: Iterator[tuple[Load, CellState]], left: Sequence[Load], attempt: int, lost: dict[str, Any] | None
) -> Iterator[dict[str, Any]]:
    """Yield records of the states of the upright section, then one of how the path ends.

    ``left`` are the path's loads, ``lost`` that at which the section gives way.
    """
    clock = time.perf_counter()
    reached: Load | None = None
    for load, state in states:
        yield state_record(state, attempt, time.perf_counter() - clock, load)
        clock, reached = time.perf_counter(), load
    if reached == left[-1]:
        yield {"end": {"attempts": attempt}}
    else:
        at = lost if reached is None else asdict(reached)
        yield {"end": {"unstable": at, "attempts": attempt}}


class _SnapError(ArithmeticError):
    """Error for a snap between two states: their Hessians do not explain the difference."""

    def __init__(self, load: Load) -> None:
        super().__init__(f"a snap on the way to {load}")
        self.load = load


def _lost(state: CellState) -> bool:
    return state.stable is False or state.jumped


def _with_states_between(
    trace: Trace, start: CellState | None, reached: CellState, most: float, halvings: int
) -> Iterator[CellState]:
    """Yield states up to ``reached`` whose Hessians explain all but ``most`` of their differences [1/m]."""
    if start is None or _lost(reached) or unexplained(start, reached) <= most:
        yield reached
        return
    if halvings == 0:
        raise _SnapError(reached.load)
    middle = next(trace([between(start.load, reached.load, 0.5)], start))
    yield from _with_states_between(trace, start, middle, most, halvings - 1)
    yield from _with_states_between(trace, middle, reached, most, halvings - 1)


def steps_over_a_snap(trace: Trace, before: CellState, after: CellState, units: Units = SI) -> bool:
    """Return whether a step of a continuation led to another branch; see `trace_path`.

    Parameters
    ----------
    trace : continuation of the cell.
    before, after : states at the step's ends.
    units : of the body.

    Raises
    ------
    fem_reference.CellError
        If a state between the two does not converge.
    """
    try:
        for _ in _with_states_between(trace, before, after, UNEXPLAINED * units.metre, HALVINGS):
            pass
    except _SnapError:
        return True
    return False


def unexplained(before: CellState, after: CellState) -> float:
    """Return the change of curvature between two states that their mean Hessian does not explain [1/m]."""
    hessian = 0.5 * (before.hessian + after.hessian)
    pressure = np.asarray(after.pressure) - np.asarray(before.pressure)
    moment = np.asarray(after.moment) - np.asarray(before.moment)
    change = np.linalg.solve(hessian[:3, :3], moment - hessian[:3, 3:] @ pressure)
    return float(np.linalg.norm(after.curvature - before.curvature - change))


def state_record(state: CellState, attempt: int, seconds: float, near: Load | None = None) -> dict[str, Any]:
    """Return the record of one state for JSON; ``near`` is the path's load if the curvature is imposed."""
    return {
        "pressure": np.asarray(state.pressure, dtype=float).tolist(),
        "moment": np.asarray(state.moment, dtype=float).tolist(),
        "applied_moment": [float(value) for value in (near or state.load).moment or (0.0, 0.0, 0.0)],
        "held": int(near is not None),
        "curvature": np.asarray(state.curvature, dtype=float).tolist(),
        "energy": float(state.energy),
        "volume": np.asarray(state.volume, dtype=float).tolist(),
        "hessian": np.asarray(state.hessian, dtype=float).tolist(),
        "iterations": int(state.iterations),
        "stable": -1 if state.stable is None else int(state.stable),
        "jumped": int(state.jumped),
        "attempt": attempt,
        "seconds": round(seconds, 3),
    }


def _subdivide(start: Load, loads: Sequence[Load]) -> list[Load]:
    """Return the same path with each step divided into equal parts."""
    finer = []
    for load in loads:
        shares = np.arange(1, RETRY_SUBDIVISION) / RETRY_SUBDIVISION
        finer += [*(between(start, load, float(share)) for share in shares), load]
        start = load
    return finer
