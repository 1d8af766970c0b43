"""Follow one loading path: states as records, a second try in smaller steps, and how the path ended."""

import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any, cast

import numpy as np

from calibration.design import LoadingPath
from fem_reference import (
    ActuatorGeometry,
    CellError,
    CellState,
    DoubleHelix,
    Load,
    PeriodCell,
    Winding,
    follow,
)

Trace = Callable[[Sequence[Load], CellState | None], Iterator[CellState]]

RETRY_SUBDIVISION = 4  # a path that failed is followed once more, each of its steps cut in four


@dataclass(frozen=True)
class CellTracer:
    """Builds a period cell in the process that calls it and returns the continuation along loads on it.

    The continuation ends where walls lose their balance.
    """

    geometry: ActuatorGeometry
    winding: Winding
    level: str
    end_compliance: float = 0.0

    def __call__(self) -> Trace:
        """Build the cell."""
        cell = PeriodCell(self.geometry, self.winding, self.level, end_compliance=self.end_compliance)
        return lambda loads, start: follow(cell, loads, start=start, jumps=False)

    def oriented(self, psi: float) -> "CellTracer":
        """The same with a winding of the same kind at another ψ [rad]."""
        return replace(self, winding=replace(cast(DoubleHelix, self.winding), psi=psi))


def trace_path(trace: Trace, path: LoadingPath) -> Iterator[dict[str, Any]]:
    """Records of a path's states, then one that says how it ended.

    A path that meets a loss of stability ends there: what lies behind is on another branch. After a failure
    it is followed once more from its last state, in smaller steps.
    """
    reached = 0  # loads of the path that have their state
    start: CellState | None = None
    loads: Sequence[Load] = path.loads
    for attempt in (1, 2):
        clock = time.perf_counter()
        try:
            for state in trace(loads, start):
                yield state_record(state, attempt, time.perf_counter() - clock)
                clock = time.perf_counter()
                reached += state.load == path.loads[reached]
                start = state
                if state.stable is False or state.jumped:
                    yield {"end": {"unstable": asdict(state.load), "attempts": attempt}}
                    return
            yield {"end": {"attempts": attempt}}
            return
        except CellError as error:
            failure, at = str(error), None if error.reached is None else asdict(error.reached)
            if error.unstable:
                yield {"end": {"unstable": at, "attempts": attempt}}
                return
            start = error.last_good if error.last_good is not None else start
            loads = _subdivide(start.load if start is not None else None, path.loads[reached:])
    yield {"end": {"failure": failure, "reached": at, "attempts": attempt}}


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


def _subdivide(start: Load | None, loads: Sequence[Load]) -> list[Load]:
    """The same path with each step cut in equal parts."""
    pressure = np.zeros(3) if start is None else np.asarray(start.pressure)
    moment = np.zeros(3) if start is None else np.asarray(start.moment)
    finer = []
    for load in loads:
        next_pressure, next_moment = np.asarray(load.pressure), np.asarray(load.moment)
        for share in np.arange(1, RETRY_SUBDIVISION) / RETRY_SUBDIVISION:
            finer.append(
                Load(
                    pressure=tuple((pressure + share * (next_pressure - pressure)).tolist()),
                    moment=tuple((moment + share * (next_moment - moment)).tolist()),
                )
            )
        finer.append(load)
        pressure, moment = next_pressure, next_moment
    return finer
