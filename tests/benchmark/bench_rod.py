"""The calibrated rod of ψ = 0 under tip force and gravity: solves in Python and in C, and before the core.

Run as ``python -m tests.benchmark.bench_rod``; ``--json`` for one object. NumPy arrays go in and out, every
result is waited for, one core, double precision; medians over single calls of the quietest of seven rounds,
and for batches the least of 200 runs. Four steps at a tolerance of 1e-5: the tip is within 4e-5 of the
length of that of 64 steps. Cold calls go through 1000 random pressures of the domain, warm ones along a walk
of steps below 0.1 %.

The limit of a solve is what no rewriting could leave out: an empty call through cffi, and, in C, the law
alone, its pressures once and the sums over its ridges at every stage of every integration.
"""

import argparse
import os
import statistics
import time
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np

import rodmodel
from rodmodel.core import INPUT, VARIANTS, CoreRod, rows_of
from rodmodel.io import find
from tests.benchmark.timing import earlier
from tests.benchmark.timing.clock import ROUNDS, least, median_call, stay_on_one_core
from tests.benchmark.timing.core_loop import CoreLoop
from tests.benchmark.timing.figures import Figure, report

CASES, RUNS, STEPS, TOLERANCE = 1000, 200, 4, 1e-5
TIP_FORCE, GRAVITY = np.array([0.0, 0.02, 0.0]), np.array([0.0, 0.0, 9.81])
LOADS: dict[str, Any] = {"tip_force": TIP_FORCE, "gravity": GRAVITY}
#: Microseconds that AVX-512 may take, and by how much more AVX2 may.
PYTHON_COLD, PYTHON_WARM, C_COLD, C_WARM, FREE, BATCH = 15.0, 8.0, 11.0, 5.0, 3.0, 8.0
SLOWER = {"avx512": 1.0, "avx2": 1.6}
JACOBIAN, ACCURATE = 1.6, 4e-5
EARLIER_COLD, EARLIER_WARM, THREADS = 6.0, 10.0, 1.9


def cases(rod: CoreRod) -> tuple[np.ndarray, np.ndarray]:
    """Pressures over the domain, and a walk about the first of them, (CASES, 3) each [Pa]."""
    domain, largest = rod.domain, np.array(rod.domain.pressure_max)
    beside = domain.beside_share * largest.sum() + (1.0 - domain.beside_share) * largest.max()
    largest = largest * min(1.0, domain.pressure_sum_max / largest.sum(), domain.beside_max / beside)
    pressures = np.random.default_rng(0).uniform(0.0, 1.0, (CASES, 3)) * largest
    return pressures, pressures[0] * (1.0 + 0.01 * np.sin(0.05 * np.arange(CASES)))[:, None]


def calls(predictor: Any, pressures: np.ndarray, walk: np.ndarray, **loads: Any) -> dict[str, float]:
    """Times of a predictor's calls [s], cold and warm, with a Jacobian and without."""

    def cold(k: int) -> None:
        predictor.reset()
        predictor(pressures[k], **loads)

    def cold_jacobian(k: int) -> None:
        predictor.reset()
        predictor.jacobian(pressures[k], **loads)

    kinds: dict[str, Callable[[int], Any]] = {
        "cold": cold,
        "cold_jacobian": cold_jacobian,
        "warm": lambda k: predictor(walk[k], **loads),
        "warm_jacobian": lambda k: predictor.jacobian(walk[k], **loads),
    }
    # Rounds of the kinds take turns, as a machine's speed changes from one second to the next.
    rounds = [{name: median_call(call, CASES, 1) for name, call in kinds.items()} for _ in range(ROUNDS)]
    return {name: min(times[name] for times in rounds) for name in kinds}


def error(rod: CoreRod, pressures: np.ndarray) -> float:
    """Largest distance of the tip from that of 64 steps, over the length."""
    fast, fine = (
        rod.solve_many(pressure=pressures, steps=steps, tolerance=tolerance, **LOADS)
        for steps, tolerance in ((STEPS, TOLERANCE), (64, 1e-10))
    )
    length = rod.actuator.body_length + rod.actuator.cap_length
    if np.any(fast["result"]) or np.any(fine["result"]):
        raise RuntimeError("solve_many: got rows without a solution, expected none")
    apart = np.linalg.norm(fast["tip_position"] - fine["tip_position"], axis=1)
    return float(apart.max() / length)


def of_variant(variant: str, pressures: np.ndarray, walk: np.ndarray) -> Iterator[Figure]:
    """Figures of one set of instructions, in Python and in C; bars where there are some for it."""
    rod = CoreRod.of(find("double-helix", 0.0, 3e-3), variant)
    slower = SLOWER.get(variant)

    def figure(what: str, seconds: float, bar: float) -> Figure:
        return Figure(f"{variant}: {what}", 1e6 * seconds, "µs", None if slower is None else slower * bar)

    taken = calls(rod.predictor(tuple(LOADS), steps=STEPS, tolerance=TOLERANCE), pressures, walk, **LOADS)
    yield figure("Python, cold", taken["cold"], PYTHON_COLD)
    yield figure("Python, warm", taken["warm"], PYTHON_WARM)
    for start in ("cold", "warm"):
        ratio = taken[f"{start}_jacobian"] / taken[start]
        what = f"{variant}: Python, {start}, with the tip's Jacobian, over the solve"
        yield Figure(what, ratio, "", JACOBIAN if start == "cold" and slower is not None else None)

    options = rod.options(STEPS, volumes=False, tolerance=TOLERANCE)
    loop = CoreLoop(rod, variant, options, STEPS)
    given = {"pressure": pressures, **LOADS}
    found = rod.solve_many(steps=STEPS, tolerance=TOLERANCE, **given)
    passes = statistics.median_high(found["shots"].tolist()) * (4 * STEPS + 1)
    inputs = rows_of(given)
    cold = loop.solve(inputs)
    yield figure("C, cold", cold, C_COLD)
    yield figure("C, warm", loop.solve(rows_of({"pressure": walk, **LOADS}), warm=True), C_WARM)
    jacobian = loop.solve(inputs, with_jacobian=True)
    yield Figure(f"{variant}: C, cold, with the tip's Jacobian, over the solve", jacobian / cold, "")
    limit = loop.sums(inputs, passes)
    yield Figure(f"{variant}: C, limit: the law alone, {passes} sums over its ridges", 1e6 * limit, "µs")
    yield Figure(f"{variant}: C, cold, over that limit", cold / limit, "")

    free = rod.predictor(steps=STEPS, tolerance=TOLERANCE)
    in_python = median_call(lambda k: free(pressures[k]))
    yield Figure(f"{variant}: free bending, Python", 1e6 * in_python, "µs")
    unloaded = np.zeros(CASES, INPUT)
    unloaded["pressure"] = pressures
    yield figure("free bending, C", loop.solve(unloaded), FREE)


def batches(rod: CoreRod, pressures: np.ndarray, cores: set[int]) -> Iterator[Figure]:
    """Figures of a batch of 1000: on one core, and on two threads."""
    single, double = (
        rod.predictor(tuple(LOADS), steps=STEPS, tolerance=TOLERANCE, threads=n) for n in (1, 2)
    )
    busy = least(lambda: single(pressures, **LOADS), RUNS, time.process_time)
    yield Figure("batch of 1000, one core, each", 1e6 * busy / CASES, "µs", BATCH)
    if len(cores) < 2:
        return
    os.sched_setaffinity(0, cores)
    one = least(lambda: single(pressures, **LOADS), RUNS)
    two = least(lambda: double(pressures, **LOADS), RUNS)
    stay_on_one_core()
    yield Figure("batch of 1000, two threads, times as fast", one / two, "", THREADS, at_least=True)


def before(python: dict[str, float], pressures: np.ndarray, walk: np.ndarray) -> Iterator[Figure]:
    """Figures of the predictor before the core, as ratios to today's: times of Python's calls [s]."""
    found = earlier.times(
        pressures=pressures, walk=walk, steps=STEPS, tolerance=TOLERANCE, rounds=ROUNDS, **LOADS
    )
    if found is None:
        print(f"{earlier.COMMIT}: this checkout lacks the commit, so its predictor is not timed")
        return
    for start, bar in (("cold", EARLIER_COLD), ("warm", EARLIER_WARM)):
        name = f"predictor of {earlier.COMMIT} (JAX), {start}"
        yield Figure(name, 1e6 * found[f"{start}_s"], "µs")
        yield Figure(f"{name}, times today's", found[f"{start}_s"] / python[start], "", bar, at_least=True)


def reference(pressures: np.ndarray) -> Figure:
    """Figure of today's differentiable rod, compiled, its whole solution."""
    import jax

    jax.config.update("jax_enable_x64", True)
    jax.config.update("jax_cpu_enable_async_dispatch", False)
    rod = rodmodel.load("double-helix")
    solve = jax.jit(lambda p: rod.solve(p, **LOADS, throw=False).tip_position)
    seconds = median_call(lambda k: jax.block_until_ready(solve(pressures[k])), 100, 3)
    return Figure("reference: Rod.solve in JAX, compiled, adaptive steps", 1e6 * seconds, "µs")


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--json", action="store_true", help="one JSON object on stdout")
    options = parser.parse_args()
    cores = os.sched_getaffinity(0)
    stay_on_one_core()
    rod = rodmodel.load_core("double-helix")
    pressures, walk = cases(rod)
    call, arguments = rod.handle.call.rm_default_options, rod.options(STEPS)
    figures = [
        Figure("tip's distance from that of 64 steps, over the length", error(rod, pressures), "", ACCURATE),
        Figure("limit: an empty call through cffi", 1e6 * median_call(lambda k: call(arguments)), "µs"),
    ]
    for variant in reversed(VARIANTS):
        figures += of_variant(variant, pressures, walk)
    python = calls(rod.predictor(tuple(LOADS), steps=STEPS, tolerance=TOLERANCE), pressures, walk, **LOADS)
    figures += batches(rod, pressures, cores)
    figures += before(python, pressures, walk)
    figures.append(reference(pressures))
    report("rod", figures, options.json, ("cffi", "numpy", "jax"))


if __name__ == "__main__":
    main()
