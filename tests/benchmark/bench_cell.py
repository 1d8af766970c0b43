"""The period cell's path to 70 kPa in chamber 1: time, iterations, peak memory, where the time goes.

Run as ``python -m tests.benchmark.bench_cell``; ``--elements medium`` for another mesh.
"""

import argparse
import cProfile
import pstats
import resource
import time

from fem_reference import LEVELS, Load, PeriodCell, follow

STEP_KPA = 2.5
TOP_KPA = 70.0
PARTS = {
    "element kernels": "solid.py",
    "linear solver": "pardiso_wrapper.py",
    "wall contact": "wall_contact.py",
    "rod contact": "rod_contact.py",
    "assembly": "assembly.py",
}


def main() -> None:
    """Time the path and print a table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--elements", choices=list(LEVELS), default="coarse")
    level = parser.parse_args().elements

    start = time.perf_counter()
    cell = PeriodCell(level=level)
    built = time.perf_counter() - start
    loads = [Load((1e3 * k * STEP_KPA, 0.0, 0.0)) for k in range(1, round(TOP_KPA / STEP_KPA) + 1)]
    profile = cProfile.Profile()
    start = time.perf_counter()
    profile.enable()
    states = list(follow(cell, loads))
    profile.disable()
    elapsed = time.perf_counter() - start
    iterations = sum(state.iterations for state in states)
    last = states[-1]
    crossing = any(
        cell.equations.walls.intersects(cell.equations.all_positions(s.configuration)) for s in states
    )

    print(f"mesh                {level}: {cell.elements} hexahedra, {cell.unknowns} unknowns")
    print(f"mesh and set-up     {built:.2f} s")
    print(f"path to 70 kPa      {elapsed:.1f} s, {len(states)} states, {iterations} Newton iterations")
    print(f"per state           {elapsed / len(states):.2f} s, condensed Hessian included")
    print(f"peak memory         {resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024:.0f} MiB")
    print(f"walls cross         {crossing}")
    print(f"stable up to        {max(s.pressure[0] for s in states if s.stable) / 1e3:.1f} kPa")
    for state in states:
        kpa = state.pressure[0] / 1e3
        if kpa in (5.0, 15.0, 25.0, 40.0, 60.0, 70.0):
            print(f"angle at {kpa:4.0f} kPa   {_angle_deg(cell, state.curvature[1]):.2f} deg")
    assert last.pressure[0] == 1e3 * TOP_KPA
    totals = dict.fromkeys(PARTS, 0.0)
    for (file, _, _), (_, _, own, _, _) in pstats.Stats(profile).stats.items():  # type: ignore[attr-defined]
        for part, ending in PARTS.items():
            if file.endswith(ending):
                totals[part] += own
    print("own time by file    " + ", ".join(f"{part} {value:.1f} s" for part, value in totals.items()))


def _angle_deg(cell: PeriodCell, curvature: float) -> float:
    return abs(curvature) * cell.geometry.body_length * 57.29577951308232


if __name__ == "__main__":
    main()
