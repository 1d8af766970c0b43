"""Follow one loading path: states as records, a second try in smaller steps, and how the path ended."""

import threading
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any, cast

import numpy as np

from calibration.sweep.design import LoadingPath, between
from fem_reference import (
    ActuatorGeometry,
    CellError,
    CellState,
    DoubleHelix,
    Load,
    MeshLevel,
    PeriodCell,
    Winding,
    follow,
)

Trace = Callable[[Sequence[Load], CellState | None], Iterator[CellState]]

RETRY_SUBDIVISION = 4  # a path that failed is followed once more, each of its steps cut in four
# Change of curvature [1/m] that two neighbouring states may leave unexplained, 3 degrees over 60 mm; and how
# often the way between is halved. Snaps of walls have been of 4 degrees and more.
UNEXPLAINED, HALVINGS = 0.9, 2


@dataclass(frozen=True)
class CellTracer:
    """Builds a period cell in the process that calls it and returns the continuation along loads on it.

    The continuation ends where walls lose their balance.
    """

    geometry: ActuatorGeometry
    winding: Winding
    level: str | MeshLevel
    end_compliance: float = 0.0

    def __call__(self) -> Trace:
        """Build the cell."""
        cell = PeriodCell(self.geometry, self.winding, self.level, end_compliance=self.end_compliance)
        return lambda loads, start: follow(cell, loads, start=start, jumps=False)

    def oriented(self, psi: float) -> "CellTracer":
        """The same with a winding of the same kind at another ψ [rad]."""
        return replace(self, winding=replace(cast(DoubleHelix, self.winding), psi=psi))


# Of each thread of a worker: a cell serves one path at a time.
_mine = threading.local()


def records_of(make_trace: Callable[[], Trace], path: LoadingPath) -> Iterator[dict[str, Any]]:
    """Records of a path (`trace_path`) in a worker, whose cell serves all paths of one winding."""
    maker = make_trace if path.psi is None else cast(CellTracer, make_trace).oriented(path.psi)
    if getattr(_mine, "made_by", None) != maker:
        _mine.trace, _mine.made_by = maker(), maker
    yield from trace_path(_mine.trace, path)


def trace_path(trace: Trace, path: LoadingPath) -> Iterator[dict[str, Any]]:
    """Records of a path's states, then one that says how it ended.

    A path that meets a loss of stability ends there: what lies behind is on another branch. So it does where
    two neighbouring states do not explain the way between them, however short: the continuation may step over
    a snap, from one stable branch to another. After a failure it is followed once more from its last state,
    in smaller steps.
    """
    start: CellState | None = None
    left = list(path.loads)
    attempt, clock = 1, time.perf_counter()
    while left:
        try:
            for reached in trace(list(left), start):
                for state in _with_states_between(trace, start, reached, HALVINGS):
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


class _SnapError(ArithmeticError):
    """Two states, however near, do not explain the way between them."""

    def __init__(self, load: Load) -> None:
        super().__init__(f"a snap on the way to {load}")
        self.load = load


def _lost(state: CellState) -> bool:
    return state.stable is False or state.jumped


def _with_states_between(
    trace: Trace, start: CellState | None, reached: CellState, halvings: int
) -> Iterator[CellState]:
    """States on the way from ``start`` that explain it, the one that was reached the last of them."""
    if start is None or _lost(reached) or unexplained(start, reached) <= UNEXPLAINED:
        yield reached
        return
    if halvings == 0:
        raise _SnapError(reached.load)
    middle = next(trace([between(start.load, reached.load, 0.5)], start))
    yield from _with_states_between(trace, start, middle, halvings - 1)
    yield from _with_states_between(trace, middle, reached, halvings - 1)


def unexplained(before: CellState, after: CellState) -> float:
    """Change of curvature between two states that the mean of their Hessians does not account for [1/m]."""
    hessian = 0.5 * (before.hessian + after.hessian)
    pressure = np.asarray(after.pressure) - np.asarray(before.pressure)
    moment = np.asarray(after.moment) - np.asarray(before.moment)
    change = np.linalg.solve(hessian[:3, :3], moment - hessian[:3, 3:] @ pressure)
    return float(np.linalg.norm(after.curvature - before.curvature - change))


def state_record(state: CellState, attempt: int, seconds: float) -> dict[str, Any]:
    """The numbers of one state, ready for JSON."""
    return {
        "pressure": np.asarray(state.pressure, dtype=float).tolist(),
        "moment": np.asarray(state.moment, dtype=float).tolist(),
        "applied_moment": [float(value) for value in state.load.moment or (0.0, 0.0, 0.0)],
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
    """The same path with each step cut in equal parts."""
    finer = []
    for load in loads:
        shares = np.arange(1, RETRY_SUBDIVISION) / RETRY_SUBDIVISION
        finer += [*(between(start, load, float(share)) for share in shares), load]
        start = load
    return finer
