"""Loading paths in parallel processes on this machine, connected by private pipes.

No port is open: only this process and its worker hold the ends of a pipe. Pipes need no semaphores.
"""

import contextlib
import pickle
import traceback
from collections import deque
from collections.abc import Callable, Generator, Mapping
from dataclasses import dataclass
from multiprocessing import connection, get_context
from multiprocessing.context import SpawnProcess
from typing import Any

from calibration.processes import end_processes, start_process
from calibration.sweep.design import LoadingPath
from calibration.sweep.errors import WorkersDiedError
from calibration.sweep.loading_sheet import Trace
from calibration.sweep.tracing import records_of

# Workers that may die on one path before the sweep gives up: the system may kill processes too.
_LIVES = 4


@dataclass
class _Worker:
    """A process, the parent's ends of its pipes, and the path that it traces."""

    process: SpawnProcess
    tasks: connection.Connection
    results: connection.Connection
    path: LoadingPath | None = None


def trace_in_processes(
    make_trace: Callable[[], Trace], paths: Mapping[str, LoadingPath], workers: int
) -> Generator[tuple[str, dict[str, Any]], None, None]:
    """Trace paths in single-threaded processes, which end with the iteration.

    Parameters
    ----------
    make_trace : see `run_sweep`.
    paths : paths by name, in the order in which to begin them.
    workers : number of processes.

    Yields
    ------
    name of a path and a record of it, as soon as it is computed; the last one of a path says how it ended.
    A path whose process died is traced again, so that a record may come more than once.

    Raises
    ------
    WorkersDiedError
        If processes died repeatedly on one path.
    """
    waiting = deque(paths.values())
    deaths: dict[str, int] = {}
    team: list[_Worker] = []
    try:
        while waiting or any(worker.path is not None for worker in team):
            while waiting and (idle := _idle(team, make_trace, workers)) is not None:
                idle.path = waiting.popleft()
                # A worker that has just died is found below.
                with contextlib.suppress(BrokenPipeError):
                    idle.tasks.send(idle.path)
            ready = connection.wait([worker.results for worker in team])
            for worker in [worker for worker in team if worker.results in ready]:
                try:
                    result = worker.results.recv()
                except (EOFError, ConnectionResetError):
                    team.remove(worker)
                    _end([worker])
                    if worker.path is not None:
                        name = worker.path.name
                        deaths[name] = deaths.get(name, 0) + 1
                        if deaths[name] == _LIVES:
                            raise WorkersDiedError(name) from None
                        waiting.appendleft(worker.path)
                    continue
                if isinstance(result, BaseException):
                    raise result
                assert worker.path is not None
                yield worker.path.name, result
                if "end" in result:
                    worker.path = None
    finally:
        _end(team)


def _idle(team: list[_Worker], make_trace: Callable[[], Trace], most: int) -> _Worker | None:
    """Return a worker without a path, or a new one if there are fewer than ``most``."""
    for worker in team:
        if worker.path is None:
            return worker
    if len(team) == most:
        return None
    context = get_context("spawn")
    their_tasks, tasks = context.Pipe(duplex=False)
    results, their_results = context.Pipe(duplex=False)
    process = start_process(_work, (make_trace, their_tasks, their_results))
    # Only the worker keeps its ends open, so that each side notices when the other is gone.
    their_tasks.close()
    their_results.close()
    team.append(_Worker(process, tasks, results))
    return team[-1]


def _end(team: list[_Worker]) -> None:
    for worker in team:
        worker.tasks.close()
        worker.results.close()
    end_processes(worker.process for worker in team)


def _work(
    make_trace: Callable[[], Trace], tasks: connection.Connection, results: connection.Connection
) -> None:
    """Trace paths in a worker until its pipe closes."""
    with contextlib.suppress(EOFError, BrokenPipeError):
        while True:
            path = tasks.recv()
            try:
                for record in records_of(make_trace, path):
                    results.send(record)
            except BrokenPipeError:
                raise
            except Exception as error:
                results.send(_sendable(error, path))


def _sendable(error: Exception, path: LoadingPath) -> Exception:
    """Return the error in a picklable form, with a note of its origin."""
    try:
        pickle.loads(pickle.dumps(error))
    except Exception:
        error = RuntimeError(f"{type(error).__name__}: {error}")
    error.add_note(f"in a worker, on path {path.name}:\n{traceback.format_exc()}")
    return error
