"""Times of calls and of processes, as the benchmarks of the core take them.

What else the machine does only ever adds: the quietest of some rounds counts, and of it the median.
"""

import os
import statistics
import subprocess
import sys
import time
from collections.abc import Callable, Sequence
from typing import Any

from tests.benchmark.timing.figures import KEPT

ONE_THREAD = {
    "OMP_NUM_THREADS": "1",
    "MKL_NUM_THREADS": "1",
    "OPENBLAS_NUM_THREADS": "1",
    "NUMBA_NUM_THREADS": "1",
    "XLA_FLAGS": "--xla_cpu_multi_thread_eigen=false intra_op_parallelism_threads=1",
    "JAX_PLATFORMS": "cpu",
    "JAX_ENABLE_X64": "1",
}
"""Environment of a process that times."""

ROUNDS, CALLS = 7, 1000


def stay_on_one_core() -> None:
    """Keep this process on the machine's last core."""
    if hasattr(os, "sched_setaffinity"):
        os.sched_setaffinity(0, {max(os.sched_getaffinity(0))})


def median_call(call: Callable[[int], Any], calls: int = CALLS, rounds: int = ROUNDS) -> float:
    """Median time of a call in the quietest round [s]; it is given the call's number."""
    call(0)
    medians = []
    for _ in range(rounds):
        times = []
        for k in range(calls):
            begin = time.perf_counter()
            call(k)
            times.append(time.perf_counter() - begin)
        medians.append(statistics.median(times))
    return min(medians)


def least(call: Callable[[], Any], runs: int, clock: Callable[[], float] = time.perf_counter) -> float:
    """Least time of so many runs [s], by a clock."""
    call()
    times = []
    for _ in range(runs):
        begin = clock()
        call()
        times.append(clock() - begin)
    return min(times)


def fresh_processes(code: str, arguments: Sequence[str], runs: int) -> list[tuple[float, str]]:
    """Run code in that many processes, one after the other: how long each took [s], and what it printed.

    One more goes before them, so that Python's bytecode lies there as an installation has it.
    """
    command = [sys.executable, "-c", code, *arguments]
    environment = os.environ | {"OMP_NUM_THREADS": "1", "PYTHONPYCACHEPREFIX": str(KEPT / "bytecode")}
    environment.pop("PYTHONDONTWRITEBYTECODE", None)
    found = []
    for _ in range(runs + 1):
        begin = time.perf_counter()
        done = subprocess.run(command, check=True, capture_output=True, text=True, env=environment)
        found.append((time.perf_counter() - begin, done.stdout))
    return found[1:]
