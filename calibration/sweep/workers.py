"""Loading paths side by side in processes of this machine, over pipes that nobody else can reach.

Nothing listens: a pipe has two ends, and this process and its worker hold them. A worker ends when its parent
does, so that a kill of the parent leaves no process behind; pipes need no semaphores.
"""

import contextlib
import os
import pickle
import signal
import threading
import traceback
from collections import deque
from collections.abc import Callable, Generator, Iterator, Mapping
from dataclasses import dataclass
from multiprocessing import connection, get_context, parent_process
from multiprocessing.context import SpawnProcess
from typing import Any

from calibration.sweep.design import LoadingPath
from calibration.sweep.errors import WorkersDiedError
from calibration.sweep.tracing import Trace, records_of
from fem_reference import prepare_process

# Workers that may die on one path before the sweep gives up: others kill processes too.
_LIVES = 4
_END = 5.0  # [s] that a process has to end in before it is killed


@dataclass
class _Worker:
    """A process, this one's ends of its pipes, and what it is at."""

    process: SpawnProcess
    tasks: connection.Connection
    told: connection.Connection
    path: LoadingPath | None = None


def trace_in_processes(
    make_trace: Callable[[], Trace], paths: Mapping[str, LoadingPath], workers: int
) -> Generator[tuple[str, dict[str, Any]], None, None]:
    """Trace paths in processes of one thread each, which end with the iteration.

    Parameters
    ----------
    make_trace : see `run_sweep`.
    paths : by their names, in the order in which to begin them.
    workers : how many processes.

    Yields
    ------
    name of a path and a record of it, as soon as it is found; of each path the last one says how it ended.
    Paths whose process died are traced again, so that a record may come more than once.

    Raises
    ------
    WorkersDiedError
        If processes died again and again on one path.
    """
    waiting = deque(paths.values())
    deaths: dict[str, int] = {}
    team: list[_Worker] = []
    try:
        while waiting or any(worker.path is not None for worker in team):
            while waiting and (idle := _idle(team, make_trace, workers)) is not None:
                idle.path = waiting.popleft()
                # One that has just died is found out below.
                with contextlib.suppress(BrokenPipeError):
                    idle.tasks.send(idle.path)
            ready = connection.wait([worker.told for worker in team])
            for worker in [worker for worker in team if worker.told in ready]:
                try:
                    told = worker.told.recv()
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
                if isinstance(told, BaseException):
                    raise told
                assert worker.path is not None
                yield worker.path.name, told
                if "end" in told:
                    worker.path = None
    finally:
        _end(team)


def _idle(team: list[_Worker], make_trace: Callable[[], Trace], most: int) -> _Worker | None:
    """A worker without a path, a new one if there may be more."""
    for worker in team:
        if worker.path is None:
            return worker
    if len(team) == most:
        return None
    context = get_context("spawn")
    their_tasks, tasks = context.Pipe(duplex=False)
    told, their_told = context.Pipe(duplex=False)
    process = context.Process(target=_work, args=(make_trace, their_tasks, their_told), daemon=True)
    with _deaf_to_interrupts():
        process.start()
    # The worker's ends are the worker's alone, so that each side sees when the other is gone.
    their_tasks.close()
    their_told.close()
    team.append(_Worker(process, tasks, told))
    return team[-1]


def _end(team: list[_Worker]) -> None:
    for worker in team:
        worker.tasks.close()
        worker.told.close()
        worker.process.terminate()
    for worker in team:
        worker.process.join(_END)
        if worker.process.is_alive():
            worker.process.kill()
            worker.process.join()
        worker.process.close()


@contextlib.contextmanager
def _deaf_to_interrupts() -> Iterator[None]:
    """Processes begun within do not hear Ctrl-C, which a terminal sends to all: the parent ends them.

    One that comes meanwhile reaches this process afterwards.
    """
    if os.name != "posix":
        yield
        return
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def _work(make_trace: Callable[[], Trace], tasks: connection.Connection, told: connection.Connection) -> None:
    """What a worker does until its pipe ends."""
    threading.Thread(target=_end_with_parent, daemon=True).start()
    # Else the system's zeroing of new pages for matrices takes a third of a path's time, and threads get into
    # each other's way.
    prepare_process()
    with contextlib.suppress(EOFError, BrokenPipeError):
        while True:
            path = tasks.recv()
            try:
                for record in records_of(make_trace, path):
                    told.send(record)
            except BrokenPipeError:
                raise
            except Exception as error:
                told.send(_sendable(error, path))


def _sendable(error: Exception, path: LoadingPath) -> Exception:
    """The error, where it survives the way, with a note of where it is from."""
    try:
        pickle.loads(pickle.dumps(error))
    except Exception:
        error = RuntimeError(f"{type(error).__name__}: {error}")
    error.add_note(f"in a worker, on path {path.name}:\n{traceback.format_exc()}")
    return error


def _end_with_parent() -> None:
    parent = parent_process()
    assert parent is not None
    connection.wait([parent.sentinel])
    os._exit(1)
