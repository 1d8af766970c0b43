"""The rod: cold start of `rodmodel predict`, warm solves one by one and in a batch.

Run as ``python -m tests.benchmark.bench_rod``; ``--json`` for one object, ``--calibration FILE`` for a file
in place of the shipped one. Pressures come as NumPy arrays and every result is waited for; medians.
"""

import argparse
import json
import statistics
import subprocess
import sys
import time
from collections.abc import Callable

import jax
import numpy as np

import rodmodel

COLD_RUNS, WARM_RUNS, LOADED_RUNS, BATCH_RUNS, BATCH = 5, 2000, 200, 5, 1000
FORCE = np.array([0.0, 0.01, 0.0])
GRAVITY = np.array([0.0, 0.0, -9.81])
COMMAND = "import sys; from rodmodel.cli import main; sys.exit(main())"


def cold(arguments: list[str]) -> float:
    """Median wall time of a fresh process [s]."""
    times = []
    for _ in range(COLD_RUNS):
        start = time.perf_counter()
        subprocess.run(
            [sys.executable, "-c", COMMAND, "predict", *arguments], check=True, capture_output=True
        )
        times.append(time.perf_counter() - start)
    return statistics.median(times)


def warm(function: Callable[..., rodmodel.Solution], inputs: list[np.ndarray], runs: int) -> float:
    """Median time of a call that has been compiled [s]."""
    jax.block_until_ready(function(inputs[0]))
    times = []
    for k in range(runs):
        start = time.perf_counter()
        jax.block_until_ready(function(inputs[k % len(inputs)]))
        times.append(time.perf_counter() - start)
    return statistics.median(times)


def main() -> None:
    """Measure and print."""
    jax.config.update("jax_enable_x64", True)
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--json", action="store_true")
    parser.add_argument("--calibration")
    options = parser.parse_args()
    rod = rodmodel.load("double-helix", path=options.calibration)
    largest = np.array(rod.domain.pressure_max)
    largest = largest * min(1.0, rod.domain.pressure_sum_max / largest.sum())
    pressures = np.random.default_rng(0).uniform(0.0, 1.0, (BATCH, 3)) * largest
    singles = list(pressures[:100])
    given = [] if options.calibration is None else ["--calibration", options.calibration]
    free = ["--pressure-kpa", "30", "0", "0", *given]
    batch = jax.jit(jax.vmap(rod.solve))
    loaded_batch = jax.jit(jax.vmap(lambda pressure: rod.solve(pressure, tip_force=FORCE)))
    results = {
        "cold_predict_s": cold(free),
        "cold_predict_loaded_s": cold([*free, "--tip-force-n", "0", "0.01", "0"]),
        "warm_free_us": 1e6 * warm(jax.jit(rod.solve), singles, WARM_RUNS),
        "warm_free_unjitted_us": 1e6 * warm(rod.solve, singles, WARM_RUNS),
        "warm_tip_force_ms": 1e3
        * warm(jax.jit(lambda pressure: rod.solve(pressure, tip_force=FORCE)), singles, LOADED_RUNS),
        "warm_gravity_ms": 1e3
        * warm(jax.jit(lambda pressure: rod.solve(pressure, gravity=GRAVITY)), singles, LOADED_RUNS),
        "batch_free_us_per_solve": 1e6 / BATCH * warm(batch, [pressures], BATCH_RUNS),
        "batch_tip_force_us_per_solve": 1e6 / BATCH * warm(loaded_batch, [pressures], BATCH_RUNS),
    }
    if options.json:
        print(json.dumps(results))
        return
    for name, value in results.items():
        print(f"{name:32s} {value:10.3f}")


if __name__ == "__main__":
    main()
