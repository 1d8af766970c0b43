"""Does every solve end well? Random pressures and loads all over the domain of each shipped law.

Run as ``python -m tests.benchmark.bench_loads [--cases 10000]``; ``--json`` for one object. By law, sheet and
kind of load: the share of cases that converge, the failures by result, and how many rows that converged hold
a number that is not finite. The sheets of a law are its domain, in which pressures are spread evenly;
chambers alone, where they go beyond it; and its snapped branches. Loads have random directions and sizes up
to the largest below. A rod that has no stable equilibrium under its load counts as a failure too, though it
is rightly told. A law of all orientations is taken at one.
"""

import argparse
import collections
import json
import math
from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np

from rodmodel import Domain
from rodmodel.core import SOLUTION, CoreRod, Result
from rodmodel.io import Calibration, branches_of, find_among, shipped_calibrations
from tests.benchmark.timing.figures import keep, where

CASES, SEED, STEPS, THREADS = 10_000, 7, 32, 2
ORIENTATION = 0.37  # of a law of all [rad]
#: Largest force [N], moment [N m] and force per length [N/m].
FORCE, MOMENT, LINE_FORCE, GRAVITY = 0.05, 2e-3, 0.05 / 0.06, 9.81


def sheets_of(calibration: Calibration) -> Iterator[tuple[str, CoreRod, Domain]]:
    """Name, rod and domain of each sheet of one calibration, whatever others serve its layout."""
    layout = calibration.layout
    psi = ORIENTATION if layout.psi is None else layout.psi
    branches = branches_of(find_among([calibration], layout.name, psi, layout.pitch))
    domain = branches.loading.domain
    yield "all over", branches.loading, replace(domain, single_max=(0.0, 0.0, 0.0))
    for chamber, most in enumerate(domain.single_max):
        if most > 0.0:
            beside = [domain.single_beside] * 3
            beside[chamber] = most
            first, second, third = beside
            alone = Domain((first, second, third), sum(beside), domain.moment_max, domain.torque_max)
            yield f"chamber {chamber + 1} alone", branches.loading, alone
    for branch, rod in branches.snapped.items():
        yield str(branch), rod, rod.domain


def name_of(calibration: Calibration) -> str:
    """Layout, orientation and pitch, for people."""
    layout = calibration.layout
    psi = "all ψ" if layout.psi is None else f"ψ = {math.degrees(layout.psi):.0f}°"
    return f"{layout.name}, {psi}, {1e3 * layout.pitch:g} mm"


def pressures_of(domain: Domain, cases: int, rng: np.random.Generator) -> np.ndarray:
    """Pressures spread evenly over a domain, (cases, 3) [Pa]."""
    found, least = np.empty((0, 3)), np.array(domain.pressure_min)
    while len(found) < cases:
        drawn = least + rng.uniform(0.0, 1.0, (cases, 3)) * (np.array(domain.pressure_max) - least)
        found = np.concatenate([found, drawn[domain.covers_pressure(drawn.T)]])
    return found[:cases]


def kinds_of_load(cases: int, rng: np.random.Generator) -> dict[str, dict[str, Any]]:
    """Loads of each kind, (cases, 3)."""
    ways = rng.standard_normal((2, cases, 3))
    ways /= np.linalg.norm(ways, axis=2, keepdims=True)
    size = rng.uniform(0.0, 1.0, (cases, 1))
    return {
        "none": {},
        "tip force and gravity": {"tip_force": FORCE * size * ways[0], "gravity": GRAVITY * ways[1]},
        "tip moment": {"tip_moment": MOMENT * size * ways[0]},
        "distributed force": {"distributed_force": LINE_FORCE * size * ways[0]},
        "follower force": {"follower_force": FORCE * size * ways[0]},
        "follower moment": {"follower_moment": MOMENT * size * ways[0]},
    }


def rows(calibration: Calibration, cases: int) -> Iterator[dict[str, Any]]:
    """What became of the cases of one law, by sheet and kind of load."""
    rng = np.random.default_rng(SEED)
    for sheet, rod, domain in sheets_of(calibration):
        pressures = pressures_of(domain, cases, rng)
        for kind, loads in kinds_of_load(cases, rng).items():
            found = rod.solve_many(pressure=pressures, steps=STEPS, threads=THREADS, **loads)
            good = found["result"] == Result.successful
            failures = collections.Counter(Result(int(result)).name for result in found["result"][~good])
            yield {
                "law": name_of(calibration),
                "sheet": sheet,
                "kind": kind,
                "converged_percent": 100.0 * float(np.mean(good)),
                "not_finite": int(np.sum(not_finite(found[good]))),
                "failures": dict(failures.most_common()),
            }


def not_finite(found: np.ndarray) -> np.ndarray:
    """Whether a solution holds a number that is not finite, beside what it has by design."""
    # Volumes are not asked for, and outside the domain there is no bound.
    by_design = ("chamber_volume", "angle_error", "tip_error")
    names = [name for name in SOLUTION.names or () if name not in by_design]
    bad = [~np.isfinite(found[name].reshape(len(found), -1)).all(axis=1) for name in names]
    return np.any(bad, axis=0)


def main() -> None:
    """Solve and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument(
        "--cases", type=int, default=CASES, help="of each law and kind (default: %(default)s)"
    )
    parser.add_argument("--json", action="store_true", help="one JSON object on stdout")
    options = parser.parse_args()
    found = []
    for calibration in shipped_calibrations():
        for row in rows(calibration, options.cases):
            found.append(row)
            failures = ", ".join(f"{count} {name}" for name, count in row["failures"].items())
            if not options.json:
                print(
                    f"{row['law']:32s} {row['sheet']:16s} {row['kind']:22s} "
                    f"{row['converged_percent']:7.2f} % converged, "
                    f"{row['not_finite']} not finite  {failures}",
                    flush=True,
                )
    record = {"rows": found, "cases": options.cases, "where": where(("cffi", "numpy"))}
    keep("loads", record)
    if options.json:
        print(json.dumps(record))


if __name__ == "__main__":
    main()
