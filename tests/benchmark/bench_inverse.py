"""The inverse: time and success on 1000 reachable targets of the shipped rod of ψ = 0.

Run as ``python -m tests.benchmark.bench_inverse``; ``--json`` for one object. Targets are the poses at
random pressures of the domain: bends and tip positions of the rod without loads, tip positions under gravity
and a tip force of up to 0.01 N in a random direction. Those under whose loads the rod has no stable
equilibrium are no targets. One core; the least of twenty runs over all targets, and the median of single
calls, which return the whole solution.
"""

import argparse
from collections.abc import Iterator
from typing import Any

import numpy as np

import rodmodel
from rodmodel.control import inverse_many
from rodmodel.core import CoreRod
from tests.benchmark.timing.clock import least, median_call, stay_on_one_core
from tests.benchmark.timing.figures import Figure, report

TARGETS, RUNS, ROUNDS = 1000, 20, 5
GRAVITY = np.array([0.0, 0.0, -9.81])
LARGEST_FORCE = 0.01  # [N]
FREE, LOADED = 40.0, 150.0


def pressures_of(rod: CoreRod, rng: np.random.Generator) -> np.ndarray:
    """Random pressures over the domain, (TARGETS, 3) [Pa]."""
    drawn = rng.uniform(size=(20 * TARGETS, 3)) * np.array(rod.domain.pressure_max)
    return drawn[rod.domain.covers_pressure(drawn.T)][:TARGETS]


def figures_of(
    name: str, rod: CoreRod, bar: float, targets: dict[str, Any], **loads: Any
) -> Iterator[Figure]:
    """Figures of targets under loads, a row each or one for all."""
    count = len(next(iter(targets.values())))

    def single(k: int) -> Any:
        target = {key: rows[k] for key, rows in targets.items()}
        here = {key: rows if rows.ndim == 1 else rows[k] for key, rows in loads.items()}
        return rod.inverse(**target, **here, throw=False)

    found = inverse_many(rod, **targets, **loads)
    each = least(lambda: inverse_many(rod, **targets, **loads), RUNS) / count
    yield Figure(f"{name}: each of {count}", 1e6 * each, "µs", bar)
    yield Figure(f"{name}: a single call", 1e6 * median_call(single, count, ROUNDS), "µs")
    yield Figure(f"{name}: reached", 100.0 * float(np.mean(found["reached"] != 0)), "%", 100.0, at_least=True)
    yield Figure(f"{name}: solves a target, median", float(np.median(found["evaluations"])), "")
    yield Figure(f"{name}: solves a target, most", float(found["evaluations"].max()), "")


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--json", action="store_true", help="one JSON object on stdout")
    options = parser.parse_args()
    stay_on_one_core()
    rod = rodmodel.load_core("double-helix")
    rng = np.random.default_rng(0)
    pressures = pressures_of(rod, rng)
    free = rod.solve_many(pressure=pressures)
    bends = {"bending_angle": free["bending_angle"], "bending_plane": free["bending_plane"]}
    figures = [*figures_of("bend", rod, FREE, bends)]
    figures += figures_of("tip position", rod, FREE, {"tip_position": free["tip_position"]})
    forces = rng.normal(size=(TARGETS, 3))
    forces *= LARGEST_FORCE * rng.uniform(size=(TARGETS, 1)) / np.linalg.norm(forces, axis=1)[:, None]
    loaded = rod.solve_many(pressure=pressures, tip_force=forces, gravity=GRAVITY)
    good = loaded["result"] == 0
    figures += figures_of(
        "tip position, tip force and gravity",
        rod,
        LOADED,
        {"tip_position": loaded["tip_position"][good]},
        tip_force=forces[good],
        gravity=GRAVITY,
    )
    report("inverse", figures, options.json)


if __name__ == "__main__":
    main()
