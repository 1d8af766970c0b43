"""Processes of one thread each, which ignore Ctrl-C and end with the one that began them, even killed."""

import contextlib
import math
import multiprocessing
import os
import signal
import threading
import time
from collections.abc import Callable, Collection, Iterable, Iterator, Sequence
from dataclasses import dataclass
from multiprocessing import connection, resource_tracker
from multiprocessing.context import SpawnProcess
from typing import Any

from fem_reference import prepare_process

_POLL = 0.5  # [s]
_END = 5.0  # time for a process to end before it is killed [s]


class JobError(RuntimeError):
    """Error for a process that died or raised; the message names its job."""


@dataclass(frozen=True)
class Job:
    """Work for a process.

    Parameters
    ----------
    name : of the work.
    target, args : picklable function and its arguments. Its results are the files that it writes.
    """

    name: str
    target: Callable[..., None]
    args: tuple[Any, ...]


def run_jobs(
    jobs: Sequence[Job],
    workers: int,
    watch: Callable[[Collection[str]], None],
    limit: float = math.inf,
) -> tuple[str, ...]:
    """Do work in so many processes until it is done or the time is over.

    Parameters
    ----------
    jobs : begun in this order.
    workers : largest number of processes at a time.
    watch : called with the names of the jobs at work, twice a second.
    limit : time [s].

    Returns
    -------
    names of the jobs that have not ended.

    Raises
    ------
    JobError
        If a process dies or raises.
    """
    # Names need not differ.
    waiting, team, begun = list(jobs), list[tuple[str, SpawnProcess]](), time.monotonic()
    try:
        while waiting or team:
            while waiting and len(team) < workers:
                job = waiting.pop(0)
                team.append((job.name, start_process(job.target, job.args)))
            time.sleep(_POLL)
            if time.monotonic() - begun > limit:
                return (*(name for name, _ in team), *(job.name for job in waiting))
            watch(tuple(name for name, _ in team))
            for name, process in [member for member in team if not member[1].is_alive()]:
                team.remove((name, process))
                if process.exitcode != 0:
                    raise JobError(f"the process of {name} ended with {process.exitcode}")
    finally:
        end_processes(process for _, process in team)
    return ()


def start_process(target: Callable[..., None], args: tuple[Any, ...]) -> SpawnProcess:
    """Start a process that calls a picklable function."""
    process = multiprocessing.get_context("spawn").Process(target=_work, args=(target, args), daemon=True)
    with _interrupts_blocked():
        process.start()
    return process


def end_processes(processes: Iterable[SpawnProcess]) -> None:
    """End processes, in a few seconds."""
    left = list(processes)
    for process in left:
        process.terminate()
    for process in left:
        process.join(_END)
        if process.is_alive():
            process.kill()
            process.join()
        process.close()


@contextlib.contextmanager
def _interrupts_blocked() -> Iterator[None]:
    """A process that starts here ignores Ctrl-C; an interrupt in the meantime reaches this one afterwards."""
    if os.name != "posix":
        yield
        return
    # The first start of a process begins a tracker of resources, and that unblocks the signal.
    resource_tracker.ensure_running()
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def _work(target: Callable[..., None], args: tuple[Any, ...]) -> None:
    threading.Thread(target=_end_with_parent, daemon=True).start()
    # Without this, zeroing new pages for matrices takes a third of the time, and threads compete.
    prepare_process()
    target(*args)


def _end_with_parent() -> None:
    parent = multiprocessing.parent_process()
    assert parent is not None
    connection.wait([parent.sentinel])
    os._exit(1)
