"""Trace loading paths in parallel, with every state on disk as soon as it is computed.

Workers trace paths and send each state; the process that started the sweep writes one file for each path. A
killed run can be resumed: finished paths are skipped, and an unfinished path is traced again from its start,
because a state can only be reached by continuation; only states not yet on file are added.
"""

import contextlib
from collections.abc import Callable, Generator, Iterator, Sequence
from pathlib import Path
from typing import Any

from calibration.progress import progress_bar
from calibration.sweep.design import LoadingPath
from calibration.sweep.directory_lock import sole_sweep
from calibration.sweep.errors import NoSchedulerError, SweepError, WorkersDiedError
from calibration.sweep.loading_sheet import Trace
from calibration.sweep.path_file import PathRecord, PathWriter, path_file, read_path
from calibration.sweep.workers import trace_in_processes


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
    make_trace : picklable factory, called once in each worker, that returns the continuation.
    paths : paths in the order in which to run them.
    directory : run directory; created if missing. Workers need no access to it.
    workers : number of single-threaded processes on this machine; they end with the sweep.
    scheduler : address of a dask scheduler whose workers are used instead. It is trusted, see `cluster`.
    show_progress : whether to show progress; if None, only on a terminal.

    Returns
    -------
    records : records by path name.

    Raises
    ------
    SweepError
        If another sweep uses the directory, the scheduler does not answer, or worker processes died
        repeatedly on one path; run again to resume.
    PathFileError
        If a path's file is damaged.
    """
    with sole_sweep(directory):
        return _swept(make_trace, paths, directory, workers, scheduler, show_progress)


def _swept(
    make_trace: Callable[[], Trace],
    paths: Sequence[LoadingPath],
    directory: Path,
    workers: int,
    scheduler: str | None,
    show_progress: bool | None,
) -> dict[str, PathRecord]:
    """See `run_sweep`, whose directory is held."""
    files = {path.name: path_file(directory, path.name) for path in paths}
    pending = {path.name: path for path in paths if read_path(files[path.name]).end is None}
    if pending:
        writers = {name: PathWriter(files[name]) for name in pending}
        try:
            # Closed in any case, so that no process keeps running.
            with contextlib.closing(_traced(make_trace, pending, workers, scheduler)) as records:
                _keep(records, pending, writers, show_progress)
        except NoSchedulerError as error:
            raise SweepError(f"sweep: {error}") from error
        except WorkersDiedError as error:
            raise SweepError(
                f"sweep: worker processes died on path {error.path}; finished states are in "
                f"{directory / 'paths'}, run again to resume"
            ) from error
    return {name: read_path(file) for name, file in files.items()}


def _traced(
    make_trace: Callable[[], Trace], pending: dict[str, LoadingPath], workers: int, scheduler: str | None
) -> Generator[tuple[str, dict[str, Any]], None, None]:
    if scheduler is None:
        return trace_in_processes(make_trace, pending, min(workers, len(pending)))
    # Only this needs dask, which takes a second to import.
    from calibration.sweep.cluster import trace_on_cluster

    return trace_on_cluster(make_trace, pending, scheduler)


def _keep(
    records: Iterator[tuple[str, dict[str, Any]]],
    pending: dict[str, LoadingPath],
    writers: dict[str, PathWriter],
    show_progress: bool | None,
) -> None:
    """Write records as they arrive, and show the number of reached loads."""
    loads = {
        name: {(load.pressure, load.moment or (0.0, 0.0, 0.0)) for load in path.loads}
        for name, path in pending.items()
    }
    reached: dict[str, set[Any]] = {name: set() for name in pending}
    finished: set[str] = set()
    with progress_bar(sum(map(len, loads.values())), "states", show_progress) as advance:
        for name, record in records:
            writers[name].add([record])
            if "end" in record:
                finished.add(name)
                continue
            load = tuple(record["pressure"]), tuple(record["applied_moment"])
            new = load in loads[name] and load not in reached[name]
            reached[name].add(load)
            advance(new, f"path {len(finished)}/{len(pending)}")
