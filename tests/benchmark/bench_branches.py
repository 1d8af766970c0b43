"""What a memory of branches costs: single solves of all branches of ψ = 0 beside those of one rod.

Run as ``python -m tests.benchmark.bench_branches``; ``--json`` for one object. NumPy in and out, one core;
medians of single calls, both in turn in one run.
"""

import argparse
from collections.abc import Iterator
from typing import Any

import numpy as np

import rodmodel
from rodmodel.control import LOADING, Branch, Branches
from tests.benchmark.bench_loads import pressures_of
from tests.benchmark.timing.clock import median_call, stay_on_one_core
from tests.benchmark.timing.figures import Figure, report

PRESSURES = 500
#: Most that the time of a solve with branches may be of that without.
RATIO = 1.15
LOADS = {"tip_force": np.array([0.02, 0.0, 0.0]), "gravity": np.array([0.0, 0.0, -9.81])}


def figures_of(name: str, branches: Branches, branch: Branch, **loads: Any) -> Iterator[Figure]:
    """Figures of random pressures on one branch, under the same loads."""
    rod = branches.rod(branch)
    pressures = pressures_of(rod.domain, PRESSURES, np.random.default_rng(0))
    alone = median_call(lambda k: rod.solve(pressures[k], **loads), len(pressures))
    both = median_call(lambda k: branches.solve(pressures[k], before=branch, **loads), len(pressures))
    yield Figure(f"{name}: one rod", 1e6 * alone, "µs")
    yield Figure(f"{name}: with branches", 1e6 * both, "µs")
    yield Figure(f"{name}: ratio", both / alone, "", RATIO)


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--json", action="store_true", help="one JSON object on stdout")
    options = parser.parse_args()
    stay_on_one_core()
    branches = rodmodel.load_branches("double-helix")
    snapped = next(iter(branches.snapped))
    figures = [
        *figures_of("loading, free bending", branches, LOADING),
        *figures_of("loading, tip force and gravity", branches, LOADING, **LOADS),
        *figures_of("snapped, free bending", branches, snapped),
        *figures_of("snapped, tip force and gravity", branches, snapped, **LOADS),
    ]
    report("branches", figures, options.json)


if __name__ == "__main__":
    main()
