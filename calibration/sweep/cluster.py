"""Loading paths side by side on a dask cluster that is there already.

A scheduler runs what its clients send it, and a client runs what comes back: each side trusts the other with
its own user's rights. Keys for ``tls://`` addresses are those of dask's configuration.
"""

import contextlib
import queue
import uuid
from collections.abc import Callable, Generator, Mapping
from typing import Any

from distributed import Client, Future, KilledWorker, get_worker, wait

from calibration.sweep.design import LoadingPath
from calibration.sweep.errors import NoSchedulerError, WorkersDiedError
from calibration.sweep.tracing import Trace, records_of

_POLL = 0.2  # [s]
_CONNECT = 10.0  # [s]


def trace_on_cluster(
    make_trace: Callable[[], Trace], paths: Mapping[str, LoadingPath], scheduler: str
) -> Generator[tuple[str, dict[str, Any]], None, None]:
    """Trace paths on the workers of a cluster, whose processes are left as they are.

    Parameters
    ----------
    make_trace : see `run_sweep`.
    paths : by their names, in the order in which to begin them.
    scheduler : its address.

    Yields
    ------
    name of a path and a record of it, as soon as it is found; a record may come more than once.

    Raises
    ------
    NoSchedulerError
        If no scheduler answers there, or it asks for a certificate that dask's configuration does not name.
    WorkersDiedError
        If processes died again and again on one path.
    """
    try:
        client = Client(scheduler, timeout=_CONNECT)
    except (OSError, TypeError, ValueError) as error:  # TypeError: tls:// without keys
        raise NoSchedulerError(f"no scheduler answers at {scheduler}: {error}") from error
    topic = f"sweep-{uuid.uuid4()}"
    told: queue.SimpleQueue[tuple[str, dict[str, Any]]] = queue.SimpleQueue()
    with client:
        client.subscribe_topic(topic, lambda event: told.put(event[1]))
        futures = {
            client.submit(_trace, make_trace, path, topic, pure=False, priority=-number): name
            for number, (name, path) in enumerate(paths.items())
        }
        left = set(futures)
        while left:
            done = _done(left)
            with contextlib.suppress(queue.Empty):
                while True:
                    yield told.get_nowait()
            for future in done:
                try:
                    # All of the path: what was told of it may still be on its way.
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
