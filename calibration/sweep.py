"""Run loading paths in parallel, every state on disk as soon as it is found.

A run directory holds one file per path, ``paths/<name>.jsonl``: a line per state, then a line that says how
the path ended. A run that was killed takes up where it stopped: finished paths are left alone; an unfinished
one is traced again from its start, for a state can only be reached by continuation, and only states not yet
on file are added. A path that meets a loss of stability ends there: what lies behind is on another branch.
"""

import contextlib
import json
import multiprocessing
import os
import queue
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

from calibration.design import LoadingPath
from calibration.progress import progress_bar
from fem_reference import ActuatorGeometry, CellError, CellState, Load, PeriodCell, Winding, follow

Trace = Callable[[Sequence[Load], CellState | None], Iterator[CellState]]

THREAD_LIMITS = ("OMP_NUM_THREADS", "MKL_NUM_THREADS", "OPENBLAS_NUM_THREADS")
RETRY_SUBDIVISION = 4  # a path that failed is followed once more, each of its steps cut in four


class SweepError(RuntimeError):
    """A worker process ended without an answer; the states found so far are on file."""


@dataclass(frozen=True)
class CellTracer:
    """Builds a period cell in the process that calls it and returns the continuation along loads on it.

    The continuation ends where walls lose their balance.
    """

    geometry: ActuatorGeometry
    winding: Winding
    level: str

    def __call__(self) -> Trace:
        """Build the cell."""
        cell = PeriodCell(geometry=self.geometry, winding=self.winding, level=self.level)
        return lambda loads, start: follow(cell, loads, start=start, jumps=False)


@dataclass(frozen=True)
class PathRecord:
    """What is on file of one path: its states, and how it ended (None while it is unfinished)."""

    states: tuple[dict[str, Any], ...]
    end: dict[str, Any] | None

    @property
    def failed(self) -> bool:
        """Whether the path ended early, for another reason than a loss of stability."""
        return self.end is not None and "failure" in self.end

    @property
    def lost_stability(self) -> bool:
        """Whether the path ended where the section loses its stability."""
        return self.end is not None and "unstable" in self.end


def run_sweep(
    make_trace: Callable[[], Trace],
    paths: Sequence[LoadingPath],
    directory: Path,
    workers: int = 2,
    show_progress: bool | None = None,
) -> dict[str, PathRecord]:
    """Trace the paths that are not yet finished in a run directory.

    Parameters
    ----------
    make_trace : called once in each worker process, so it must be picklable; returns the continuation.
    paths : in the order in which to run them.
    directory : of the run, made if missing.
    workers : processes, each kept to a single thread.
    show_progress : None shows it where stderr is a terminal.

    Returns
    -------
    records by the path's name.

    Raises
    ------
    SweepError
        If a worker process died. Run again to take up where it stopped.
    """
    folder = directory / "paths"
    folder.mkdir(parents=True, exist_ok=True)
    files = {path.name: folder / f"{path.name}.jsonl" for path in paths}
    pending = [path for path in paths if read_path(files[path.name]).end is None]
    context = multiprocessing.get_context("spawn")
    found = context.Queue()
    total = sum(len(path.loads) for path in pending)
    finished = 0
    with (
        _single_threaded_children(),
        ProcessPoolExecutor(
            min(workers, max(len(pending), 1)), context, _start_worker, (make_trace, found)
        ) as pool,
        progress_bar(total, "states", show_progress) as advance,
    ):
        jobs = [pool.submit(_run_path, path, files[path.name]) for path in pending]
        try:
            while left := [job for job in jobs if not job.done()]:
                wait(left, timeout=0.2)
                events = _drain(found)
                finished += events.count("path")
                advance(events.count("load"), f"path {finished}/{len(pending)}")
            for job in jobs:
                job.result()
        except BrokenProcessPool as error:
            raise SweepError(
                f"sweep: a worker process died; finished states are in {folder}, run again to go on"
            ) from error
        except BaseException:
            pool.shutdown(wait=False, cancel_futures=True)
            raise
    return {name: read_path(file) for name, file in files.items()}


def read_path(file: Path) -> PathRecord:
    """Read a path's file; a last line cut short by a kill does not count."""
    states: list[dict[str, Any]] = []
    if not file.exists():
        return PathRecord((), None)
    for line in file.read_text().splitlines(keepends=True):
        if not line.endswith("\n"):
            break
        record = json.loads(line)
        if "end" in record:
            return PathRecord(tuple(states), record["end"])
        states.append(record)
    return PathRecord(tuple(states), None)


_worker: dict[str, Any] = {}


def _start_worker(make_trace: Callable[[], Trace], found: Any) -> None:
    # Were the parent killed, a worker left behind would write to files that the next run takes up.
    threading.Thread(target=_end_with_parent, daemon=True).start()
    _worker.update(trace=make_trace(), found=found)


def _end_with_parent() -> None:
    parent = multiprocessing.parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)


def _run_path(path: LoadingPath, file: Path) -> None:
    trace_path(_worker["trace"], path, file, on_load=lambda: _worker["found"].put("load"))
    _worker["found"].put("path")


def trace_path(
    trace: Trace, path: LoadingPath, file: Path, on_load: Callable[[], None] = lambda: None
) -> None:
    """Follow one path, appending to its file; after a failure, from its last state in smaller steps."""
    known = read_path(file).states
    recorded = {_load_key(state) for state in known}
    _drop_cut_line(file)
    reached = 0  # loads of the path that have their state
    start: CellState | None = None
    loads: Sequence[Load] = path.loads
    with file.open("a") as lines:

        def append(record: dict[str, Any]) -> None:
            lines.write(json.dumps(record) + "\n")
            lines.flush()

        for attempt in (1, 2):
            clock = time.perf_counter()
            try:
                for state in trace(loads, start):
                    record = state_record(state, attempt, time.perf_counter() - clock)
                    clock = time.perf_counter()
                    if _load_key(record) not in recorded:
                        append(record)
                        recorded.add(_load_key(record))
                    if state.load == path.loads[reached]:
                        reached += 1
                        on_load()
                    start = state
                    if state.stable is False or state.jumped:
                        break
                else:
                    append({"end": {"attempts": attempt}})
                    return
                append({"end": {"unstable": asdict(state.load), "attempts": attempt}})
                return
            except CellError as error:
                failure, at = error, error.reached
                if error.unstable:
                    append({"end": {"unstable": None if at is None else asdict(at), "attempts": attempt}})
                    return
                start = error.last_good if error.last_good is not None else start
                loads = _subdivide(start.load if start is not None else None, path.loads[reached:])
        append(
            {
                "end": {
                    "failure": str(failure),
                    "reached": None if at is None else asdict(at),
                    "attempts": attempt,
                }
            }
        )


def _drop_cut_line(file: Path) -> None:
    """Cut off what a kill left of a line, so that the next line starts a line."""
    if file.exists():
        with file.open("rb+") as content:
            content.truncate(content.read().rfind(b"\n") + 1)


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


def _load_key(record: dict[str, Any]) -> tuple[float, ...]:
    return (*record["pressure"], *record["applied_moment"])


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


def _drain(found: Any) -> list[str]:
    events = []
    with contextlib.suppress(queue.Empty):
        while True:
            events.append(found.get_nowait())
    return events


@contextlib.contextmanager
def _single_threaded_children() -> Iterator[None]:
    """Linear algebra reads these as a worker loads it; more threads than cores slow each other down."""
    before = {name: os.environ.get(name) for name in THREAD_LIMITS}
    os.environ.update(dict.fromkeys(THREAD_LIMITS, "1"))
    try:
        yield
    finally:
        for name, value in before.items():
            if value is None:
                os.environ.pop(name, None)
            else:
                os.environ[name] = value
