"""Run loading paths side by side on a dask cluster, every state on disk as soon as it is found.

Workers trace paths and tell of each state; the process that started the sweep writes the files, one for each
path. A run that was killed takes up where it stopped: finished paths are left alone; an unfinished one is
traced again from its start, for a state can only be reached by continuation, and only states not yet on file
are added.
"""

import contextlib
import logging
import queue
import threading
import uuid
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any, cast

from distributed import Client, Future, KilledWorker, LocalCluster, get_worker, wait

from calibration.design import LoadingPath
from calibration.path_file import PathRecord, PathWriter, path_file, read_path
from calibration.progress import progress_bar
from calibration.tracing import CellTracer, Trace, trace_path
from fem_reference import prepare_process

_POLL = 0.2  # [s]
_CONNECT = 10.0  # [s]
_OWN_PORT = "127.0.0.1:0"  # any that is free, on this machine alone


class SweepError(RuntimeError):
    """The cluster is out of reach, or worker processes died; the states found so far are on file."""


def run_sweep(
    make_trace: Callable[[], Trace],
    paths: Sequence[LoadingPath],
    directory: Path,
    workers: int = 2,
    scheduler: str | None = None,
    show_progress: bool | None = None,
) -> dict[str, PathRecord]:
    """Trace the paths that are not yet finished in a run directory.

    Parameters
    ----------
    make_trace : called once in each worker, so it must be picklable; returns the continuation.
    paths : in the order in which to run them.
    directory : of the run, made if missing; workers need not see it.
    workers : processes of one thread each, of a cluster on this machine that ends with the sweep.
    scheduler : address of the scheduler of a cluster that runs already, whose workers are taken instead.
    show_progress : None shows it where stderr is a terminal.

    Returns
    -------
    records by the path's name.

    Raises
    ------
    SweepError
        If the scheduler does not answer, or a worker process died again and again on one path. Run again to
        take up where it stopped.
    """
    files = {path.name: path_file(directory, path.name) for path in paths}
    pending = {path.name: path for path in paths if read_path(files[path.name]).end is None}
    if pending:
        writers = {name: PathWriter(files[name]) for name in pending}
        with _connected(min(workers, len(pending)), scheduler) as client:
            _trace_on(client, make_trace, pending, writers, directory, show_progress)
    return {name: read_path(file) for name, file in files.items()}


def _trace_on(
    client: Client,
    make_trace: Callable[[], Trace],
    pending: dict[str, LoadingPath],
    writers: dict[str, PathWriter],
    directory: Path,
    show_progress: bool | None,
) -> None:
    topic = f"sweep-{uuid.uuid4()}"
    told: queue.SimpleQueue[tuple[str, dict[str, Any]]] = queue.SimpleQueue()
    client.subscribe_topic(topic, lambda event: told.put(event[1]))
    loads = {
        name: {(load.pressure, load.moment or (0.0, 0.0, 0.0)) for load in path.loads}
        for name, path in pending.items()
    }
    futures = {
        client.submit(_run_path, make_trace, path, topic, pure=False, priority=-number): name
        for number, (name, path) in enumerate(pending.items())
    }
    finished, left = 0, set(futures)
    with progress_bar(sum(map(len, loads.values())), "states", show_progress) as advance:
        while left:
            done = _done(left)
            with contextlib.suppress(queue.Empty):
                while True:
                    name, record = told.get_nowait()
                    writers[name].add([record])
                    if "end" not in record:
                        load = tuple(record["pressure"]), tuple(record["applied_moment"])
                        advance(load in loads[name], f"path {finished}/{len(pending)}")
            for future in done:
                finished += 1
                try:
                    # All of the path: what was told of it may still be on its way.
                    writers[futures[future]].add(future.result())
                except KilledWorker as error:
                    raise SweepError(
                        f"sweep: worker processes died on path {futures[future]}; finished states are in "
                        f"{directory / 'paths'}, run again to go on"
                    ) from error
            left -= done


def _done(left: set[Future]) -> set[Future]:
    try:
        return set(wait(left, timeout=_POLL, return_when="FIRST_COMPLETED").done)
    except TimeoutError:
        return set()


@contextlib.contextmanager
def _connected(workers: int, scheduler: str | None) -> Iterator[Client]:
    if scheduler is not None:
        try:
            client = Client(scheduler, timeout=_CONNECT)
        except (OSError, ValueError) as error:
            raise SweepError(f"sweep: no scheduler answers at {scheduler}: {error}") from error
        with client:
            yield client
        return
    # Their memory is the user's to watch; each runs linear algebra on one thread.
    with (
        LocalCluster(
            n_workers=workers,
            threads_per_worker=1,
            memory_limit=0,
            host="127.0.0.1",
            dashboard_address=_OWN_PORT,
            worker_dashboard_address=_OWN_PORT,
            silence_logs=logging.ERROR,
        ) as cluster,
        Client(cluster) as client,
    ):
        # Else the system's zeroing of new pages for matrices takes a third of a path's time, and threads get
        # into each other's way. Settings of the whole process: workers of somebody else's cluster are left as
        # they are.
        client.run(prepare_process)
        yield client


# Of each thread of a worker: a cell serves one path at a time.
_mine = threading.local()


def _run_path(make_trace: Callable[[], Trace], path: LoadingPath, topic: str) -> list[dict[str, Any]]:
    maker = make_trace if path.psi is None else cast(CellTracer, make_trace).oriented(path.psi)
    if getattr(_mine, "made_by", None) != maker:
        _mine.trace, _mine.made_by = maker(), maker
    worker, records = get_worker(), []
    for record in trace_path(_mine.trace, path):
        worker.log_event(topic, (path.name, record))
        records.append(record)
    return records
