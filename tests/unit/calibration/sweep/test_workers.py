"""Processes that trace paths: nobody else reaches them, they end with the sweep, and tell their errors."""

import contextlib
import socket
from dataclasses import dataclass

import psutil
import pytest
from manufactured_cell import ManufacturedTracer

from calibration.sweep import LoadingPath
from calibration.sweep.workers import trace_in_processes
from fem_reference import Load

PATHS = {
    name: LoadingPath(name, "train", tuple(Load((p * k, 0.0, 0.0), (0.0, 0.0, 0.0)) for k in range(1, 5)))
    for name, p in (("a", 1e3), ("b", 2e3), ("c", 3e3))
}


def test_nothing_listens_while_paths_are_traced_and_no_process_is_left():
    own = psutil.Process()
    before, children = own.net_connections("all"), set(own.children(recursive=True))
    with contextlib.closing(trace_in_processes(ManufacturedTracer(), PATHS, 2)) as records:
        next(records)
        workers = set(own.children(recursive=True)) - children
        assert len(workers) >= 2
        assert own.net_connections("all") == before
        for worker in workers:
            assert worker.net_connections("all") == []
            assert not [file for file in worker.memory_maps() if "/dev/shm/sem." in file.path]
    spawned = [
        worker for worker in workers if worker.is_running() and "spawn_main" in " ".join(worker.cmdline())
    ]
    assert spawned == []


def test_a_listener_would_be_found():
    with socket.create_server(("127.0.0.1", 0)) as server:
        ports = [connection.laddr.port for connection in psutil.Process().net_connections("inet")]
        assert server.getsockname()[1] in ports


def test_an_interrupt_ends_the_processes():
    own = psutil.Process()
    before = set(own.children(recursive=True))

    def interrupted():
        with contextlib.closing(trace_in_processes(ManufacturedTracer(), PATHS, 1)) as records:
            next(records)
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        interrupted()
    left = [
        process for process in set(own.children(recursive=True)) - before if "spawn_main" in process.cmdline()
    ]
    assert left == []


class OwnError(Exception):
    def __init__(self, first, second):
        super().__init__("two arguments, which its copy does not get")


@dataclass(frozen=True)
class Faulty:
    """Fails in a worker, with an error that can be sent or one that cannot."""

    sendable: bool

    def __call__(self):
        def trace(loads, start):
            raise ValueError("bad winding") if self.sendable else OwnError(1, 2)
            yield

        return trace


@pytest.mark.parametrize(
    ("sendable", "kind", "told"),
    [(True, ValueError, "^bad winding"), (False, RuntimeError, "^OwnError: two arguments")],
)
def test_an_error_in_a_worker_is_raised_here_with_its_origin(sendable, kind, told):
    with pytest.raises(kind, match=told) as caught:
        list(trace_in_processes(Faulty(sendable), PATHS, 1))
    (note,) = caught.value.__notes__
    assert note.startswith("in a worker, on path a:\n")
    assert "trace_path" in note
