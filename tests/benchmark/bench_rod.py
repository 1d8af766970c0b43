"""The rod: the common problem of linear law, the calibrated actuator, batches, derivatives, a cold start.

Run as ``python -m tests.benchmark.bench_rod``; ``--json`` for one object. Inputs and outputs are NumPy
arrays, every result is waited for, one core, double precision; medians over single calls, and for batches the
least of the processor's time, which other processes on the machine do not add to.

The common problem: L = 60 mm, EI = 2e-4 N m², GJ = EI/1.5, hanging under its weight of 73 mN, free curvature
of moment 5.24e-3 N m, out-of-plane tip force 0.02 N.
"""

import argparse
import json
import os
import statistics
import subprocess
import sys
import time
from collections.abc import Callable
from typing import Any

os.environ.setdefault("XLA_FLAGS", "--xla_cpu_multi_thread_eigen=false")

import jax
import jax.numpy as jnp
import numpy as np

import rodmodel
from rodmodel import Adaptive, FixedStep

COLD_RUNS, WARM_RUNS, BATCH_RUNS, BATCH = 3, 2000, 20, 1000
LENGTH, STIFFNESS, MOMENT, WEIGHT = 0.06, 2e-4, 5.24e-3, 0.073
GRAVITY = np.array([0.0, 0.0, 9.81])  # a rod along +z that hangs down
FORCE = np.array([0.0, 0.02, 0.0])
COMMAND = "import sys; from rodmodel.cli import main; sys.exit(main())"


def common_rod() -> rodmodel.Rod:
    """Rod of the common problem: a pressure of 1 Pa in chamber 1 stands for the whole intrinsic moment."""
    law = rodmodel.LinearLaw(
        jnp.diag(jnp.array([STIFFNESS, STIFFNESS, STIFFNESS / 1.5])),
        jnp.zeros((3, 3)).at[1, 0].set(-MOMENT / STIFFNESS),
    )
    actuator = rodmodel.Actuator(LENGTH, 0.0, 0.012, WEIGHT / 9.81 / LENGTH, 0.0)
    return rodmodel.Rod(law, actuator, rodmodel.Domain((2.0, 2.0, 2.0), 6.0, 1.0), 0.0)


def warm(call: Callable[[int], Any], runs: int = WARM_RUNS) -> float:
    """Median time of a call that has been compiled [s]."""
    jax.block_until_ready(call(0))
    times = []
    for k in range(runs):
        start = time.perf_counter()
        jax.block_until_ready(call(k))
        times.append(time.perf_counter() - start)
    return statistics.median(times)


def processor(call: Callable[[], Any]) -> float:
    """Least processor time of a call that has been compiled [s]."""
    jax.block_until_ready(call())
    times = []
    for _ in range(BATCH_RUNS):
        start = time.process_time()
        jax.block_until_ready(call())
        times.append(time.process_time() - start)
    return min(times)


def cold(*loads: str) -> float:
    """Median wall time of `rodmodel predict`, in a fresh process [s]."""
    arguments = ["predict", "--pressure-kpa", "30", "0", "0", *loads]
    times = []
    for _ in range(COLD_RUNS):
        start = time.perf_counter()
        subprocess.run([sys.executable, "-c", COMMAND, *arguments], check=True, capture_output=True)
        times.append(time.perf_counter() - start)
    return statistics.median(times)


def measure(name: str, rod: rodmodel.Rod, pressures: np.ndarray, steps: int) -> dict[str, float]:
    """Times of one rod, and the error at the tip against the reference, relative to the length."""
    loads: dict[str, Any] = {"tip_force": FORCE, "gravity": GRAVITY}
    predictor = rod.predictor(tuple(loads), solver=FixedStep(steps, 1e-5))
    several = pressures[:20]
    exact = jax.vmap(lambda p: rod.solve(p, **loads, throw=False, solver=Adaptive(1e-12)).tip_position)(
        several
    )
    error = np.abs(np.linalg.norm(predictor(several, **loads).tip_position - exact, axis=1)).max()

    def from_cold(k: int) -> Any:
        predictor.reset()
        return predictor(pressures[k % BATCH], **loads)

    reference = jax.jit(lambda p: rod.solve(p, **loads, throw=False).tip_position)

    def with_jacobian(k: int) -> Any:
        predictor.reset()
        return predictor.jacobian(pressures[k % BATCH], **loads)

    walk = pressures[0] * (1.0 + 0.01 * np.sin(0.05 * np.arange(BATCH)))[:, None]
    return {
        f"{name}_tip_error_over_length": float(error / LENGTH),
        f"{name}_cold_start_us": 1e6 * warm(from_cold),
        f"{name}_warm_start_us": 1e6 * warm(lambda k: predictor(walk[k % BATCH], **loads)),
        f"{name}_batch_us_per_solve": 1e6 / BATCH * processor(lambda: predictor(pressures, **loads)),
        f"{name}_reference_us": 1e6 * warm(lambda k: reference(pressures[k % BATCH]), 300),
        f"{name}_solve_and_jacobian_us": 1e6 * warm(with_jacobian),
    }


def main() -> None:
    """Measure and print."""
    jax.config.update("jax_enable_x64", True)
    # The next call comes when this one is done: a handover to another thread only costs.
    jax.config.update("jax_cpu_enable_async_dispatch", False)
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--json", action="store_true")
    parser.add_argument("--calibration")
    options = parser.parse_args()
    random = np.random.default_rng(0)
    calibrated = rodmodel.load("double-helix", path=options.calibration)
    largest = np.array(calibrated.domain.pressure_max)
    largest = largest * min(1.0, calibrated.domain.pressure_sum_max / largest.sum())
    empty = jax.jit(lambda x: x + 1.0)
    pressures = random.uniform(0.0, 1.0, (BATCH, 3)) * largest
    free = jax.jit(calibrated.solve)
    common = np.array([1.0, 0.0, 0.0]) * random.uniform(0.9, 1.1, (BATCH, 1))
    results = {
        "empty_call_us": 1e6 * warm(lambda k: empty(FORCE)),
        **measure("common", common_rod(), common, steps=4),
        **measure("calibrated", calibrated, pressures, steps=3),
        "free_jitted_us": 1e6 * warm(lambda k: free(pressures[k % BATCH])),
        "free_unjitted_us": 1e6 * warm(lambda k: calibrated.solve(pressures[k % BATCH])),
        "cold_process_s": cold(),
        "cold_process_tip_force_s": cold("--tip-force-n", "0", "0.01", "0"),
    }
    if options.json:
        print(json.dumps(results))
        return
    for key, value in results.items():
        print(f"{key:36s} {value:12.6g}")


if __name__ == "__main__":
    main()
