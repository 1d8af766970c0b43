"""Time the settings of one module on the common problem, and hold each to the reference.

Run as ``python -m tests.benchmark.timing.speed MODULE``: prints one JSON object a line and setting. It is a
process of its own so that each solver has one core, one thread, and no other's compiled code or settings
beside it.
"""

import importlib
import json
import statistics
import sys
import time
from collections.abc import Sequence
from typing import Any

from tests.benchmark.timing.clock import stay_on_one_core

AGREES = 1e-2
"""Largest error, relative to the length, at which an answer is one to this problem and its time counts."""

# Solves come in rounds, once through the cycle of forces. The quietest round counts: what else the machine
# does only ever adds.
_LEAST_SOLVES, _MOST_ROUNDS, _BUDGET = 3, 200, 2.0


def time_setting(setting: Any, references: Sequence[Any]) -> dict[str, Any]:
    """First call, median cold and warm solve of the quietest round [s], largest error relative to L."""
    from tests.benchmark.peers.common_problem import FORCES, LENGTH, distance

    begin = time.perf_counter()
    solver = setting.make()
    tip, start = solver(FORCES[0], None)
    first = time.perf_counter() - begin
    # A second function may have to be compiled for a warm start.
    tip, start = solver(FORCES[0], start)

    rounds: list[tuple[float, float]] = []
    solves = 0
    error = 0.0
    begin = time.perf_counter()
    while not rounds or (time.perf_counter() - begin < _BUDGET and len(rounds) < _MOST_ROUNDS):
        cold: list[float] = []
        warm: list[float] = []
        for k in [*range(1, len(FORCES)), 0]:
            before = time.perf_counter()
            tip, _ = solver(FORCES[k], None)
            cold.append(time.perf_counter() - before)
            error = max(error, distance(tip, references[k]) / LENGTH)
            before = time.perf_counter()
            tip, start = solver(FORCES[k], start)
            warm.append(time.perf_counter() - before)
            error = max(error, distance(tip, references[k]) / LENGTH)
            if len(cold) >= _LEAST_SOLVES and time.perf_counter() - begin > 2.0 * _BUDGET:
                break
        rounds.append((statistics.median(cold), statistics.median(warm)))
        solves += len(cold) + len(warm)
    if error > AGREES:
        raise RuntimeError(f"misses the reference by {error:.1e} of the length")
    return {
        "family": setting.family,
        "label": setting.label,
        "first_call_s": first,
        "cold_s": min(cold for cold, _ in rounds),
        "warm_s": min(warm for _, warm in rounds),
        "solves": solves,
        "error": error,
    }


def main() -> None:
    """Time every setting of the module named on the command line."""
    stay_on_one_core()
    from tests.benchmark.peers.common_problem import FORCES, reference_tip

    references = [reference_tip(force) for force in FORCES]
    module = importlib.import_module(sys.argv[1])
    for setting in module.settings():
        try:
            row = time_setting(setting, references)
        except RuntimeError as failure:
            # Solvers raise where they find no answer: that is a result too.
            row = {"family": setting.family, "label": setting.label, "failure": str(failure)}
        print(json.dumps(row), flush=True)


if __name__ == "__main__":
    main()
