"""Loading paths in parallel on an existing dask cluster.

A scheduler runs code from its clients, and a client unpickles what comes back: each side has the other's
rights. Keys for ``tls://`` addresses come from dask's configuration.
"""

import contextlib
import queue
import uuid
from collections.abc import Callable, Generator, Mapping
from typing import Any

from distributed import Client, Future, KilledWorker, get_worker, wait

from calibration.sweep.design import LoadingPath
from calibration.sweep.errors import NoSchedulerError, WorkersDiedError
from calibration.sweep.loading_sheet import Trace
from calibration.sweep.tracing import records_of

_POLL = 0.2  # wait between looks for records [s]
_CONNECT = 10.0  # time to connect to the scheduler [s]


def trace_on_cluster(
    make_trace: Callable[[], Trace], paths: Mapping[str, LoadingPath], scheduler: str
) -> Generator[tuple[str, dict[str, Any]], None, None]:
    """Trace paths on the workers of a cluster, whose processes keep running.

    Parameters
    ----------
    make_trace : see `run_sweep`.
    paths : paths by name, in the order in which to begin them.
    scheduler : address of the scheduler.

    Yields
    ------
    name of a path and a record of it, as soon as it is computed; a record may come more than once.

    Raises
    ------
    NoSchedulerError
        If no scheduler answers there, or it asks for a certificate that dask's configuration does not name.
    WorkersDiedError
        If processes died repeatedly on one path.
    """
    try:
        client = Client(scheduler, timeout=_CONNECT)
    except (OSError, TypeError, ValueError) as error:  # TypeError: tls:// without keys
        raise NoSchedulerError(f"no scheduler answers at {scheduler}: {error}") from error
    topic = f"sweep-{uuid.uuid4()}"
    events: queue.SimpleQueue[tuple[str, dict[str, Any]]] = queue.SimpleQueue()
    with client:
        client.subscribe_topic(topic, lambda event: events.put(event[1]))
        futures = {
            client.submit(_trace, make_trace, path, topic, pure=False, priority=-number): name
            for number, (name, path) in enumerate(paths.items())
        }
        left = set(futures)
        while left:
            done = _done(left)
            with contextlib.suppress(queue.Empty):
                while True:
                    yield events.get_nowait()
            for future in done:
                try:
                    # All records of the path: events may still be on their way.
                    records = future.result()
                except KilledWorker as error:
                    raise WorkersDiedError(futures[future]) from error
                for record in records:
                    yield futures[future], record
            left -= done


def _done(left: set[Future]) -> set[Future]:
    try:
        return set(wait(left, timeout=_POLL, return_when="FIRST_COMPLETED").done)
    except TimeoutError:
        return set()


def _trace(make_trace: Callable[[], Trace], path: LoadingPath, topic: str) -> list[dict[str, Any]]:
    worker, records = get_worker(), []
    for record in records_of(make_trace, path):
        worker.log_event(topic, (path.name, record))
        records.append(record)
    return records
