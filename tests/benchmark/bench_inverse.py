"""The inverse: time and success on random reachable targets of the shipped rod.

Run as ``python -m tests.benchmark.bench_inverse``. Targets are the poses at pressures spread over the domain;
every result is waited for; medians over single calls, and of the quietest round of fifty.
"""

import time
from collections.abc import Callable, Sequence
from typing import Any

import jax
import numpy as np

import rodmodel

TARGETS, LOADED_TARGETS, ROUND = 1000, 200, 50
GRAVITY = np.array([0.0, 0.0, -9.81])
LARGEST_FORCE = 0.01  # [N]


def report(name: str, find: Callable[..., rodmodel.Inverse], targets: Sequence[tuple[Any, ...]]) -> None:
    """Time each target once and print a line."""
    jax.block_until_ready(find(*targets[0]))
    times, reached = [], []
    for target in targets:
        begin = time.perf_counter()
        found = jax.block_until_ready(find(*target))
        times.append(time.perf_counter() - begin)
        reached.append(bool(found.reached))
    rounds = np.array(times).reshape(-1, ROUND)
    print(
        f"{name:34s} median {1e6 * np.median(times):6.0f} µs, quietest round "
        f"{1e6 * np.median(rounds, axis=1).min():6.0f} µs, reached {100.0 * np.mean(reached):.1f} %"
    )


def main() -> None:
    """Measure and print."""
    jax.config.update("jax_enable_x64", True)
    rod = rodmodel.load("double-helix")
    rng = np.random.default_rng(0)
    pressures = rng.uniform(size=(20 * TARGETS, 3)) * np.array(rod.domain.pressure_max)
    pressures = pressures[pressures.sum(axis=1) <= rod.domain.pressure_sum_max][:TARGETS]
    free = jax.jit(jax.vmap(rod.solve))(pressures)
    bends = zip(np.asarray(free.bending_angle), np.asarray(free.bending_plane), strict=True)
    report("bend", jax.jit(lambda a, g: rod.inverse(a, g, throw=False)), list(bends))
    tips = [(tip,) for tip in np.asarray(free.tip_position)]
    report("tip position", jax.jit(lambda x: rod.inverse(tip_position=x, throw=False)), tips)

    forces = rng.normal(size=(LOADED_TARGETS, 3))
    forces *= LARGEST_FORCE * rng.uniform(size=(LOADED_TARGETS, 1)) / np.linalg.norm(forces, axis=1)[:, None]
    loaded = jax.jit(jax.vmap(lambda p, f: rod.solve(p, tip_force=f, gravity=GRAVITY, throw=False)))(
        pressures[:LOADED_TARGETS], forces
    )
    report(
        "tip position, tip force and gravity",
        jax.jit(lambda x, f: rod.inverse(tip_position=x, tip_force=f, gravity=GRAVITY, throw=False)),
        list(zip(np.asarray(loaded.tip_position), forces, strict=True)),
    )


if __name__ == "__main__":
    main()
