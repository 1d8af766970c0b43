"""Linear against quadratic hexahedra in the period cell: bending angle, its error and the time it takes.

Run as ``python -m tests.benchmark.bench_elements``; ``--json`` for one object. Chamber 1 alone, free bending.
The paper's linear element with mean dilatation stands beside the quadratic one with linear discontinuous
pressure, each on several meshes. Errors are against the finest mesh of quadratic elements, which differs from
the next finer by less than 0.5 %. Times are of whole paths from rest to 40 kPa, one after the other.
"""

import argparse
import json
import math
import time

from fem_reference import Load, MeshLevel, PeriodCell, follow

PRESSURES_KPA = (5.0, 15.0, 25.0, 40.0)
MESHES = {
    "linear": [
        MeshLevel(4, 12, 4, 4, 2, 2, 1, 0.5),
        MeshLevel(6, 18, 6, 6, 3, 3, 2, 1.0 / 3.0),
        MeshLevel(8, 24, 8, 8, 4, 4, 2, 0.25),
    ],
    "quadratic": [
        MeshLevel(2, 6, 2, 2, 1, 1, 1, 1.0, order=2),
        MeshLevel(2, 8, 2, 2, 1, 1, 1, 0.75, order=2),
        MeshLevel(3, 9, 3, 3, 2, 2, 1, 0.75, order=2),
        MeshLevel(3, 9, 3, 3, 2, 2, 1, 0.5, order=2),
    ],
}


def path(level: MeshLevel) -> dict[str, float | int | list[float]]:
    """Angles of 60 mm of uniform bending [deg], the size of the mesh, and the seconds that the path took."""
    start = time.perf_counter()
    cell = PeriodCell(level=level)
    states = list(follow(cell, [Load((1e3 * p, 0.0, 0.0)) for p in PRESSURES_KPA]))
    length = cell.geometry.body_length
    return {
        "elements": cell.elements,
        "unknowns": cell.unknowns,
        "angle_deg": [math.degrees(s.bending(length)[0]) for s in states],
        "seconds": time.perf_counter() - start,
    }


def main() -> None:
    """Solve and print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("--json", action="store_true", help="one JSON object on stdout")
    options = parser.parse_args()
    found = {kind: [path(level) for level in levels] for kind, levels in MESHES.items()}
    if options.json:
        print(json.dumps({"pressure_kpa": PRESSURES_KPA, **found}))
        return
    finest = found["quadratic"][-1]["angle_deg"]
    assert isinstance(finest, list)
    print(
        "| element | elements | unknowns | " + " | ".join(f"{p:g} kPa" for p in PRESSURES_KPA) + " | time |"
    )
    print("|---|---|---|" + "---|" * (len(PRESSURES_KPA) + 1))
    for kind, rows in found.items():
        for row in rows:
            angles = row["angle_deg"]
            assert isinstance(angles, list)
            cells = [
                f"{a:.3f}° ({100.0 * (a / b - 1.0):+.1f} %)" for a, b in zip(angles, finest, strict=True)
            ]
            print(
                f"| {kind} | {row['elements']} | {row['unknowns']} | "
                + " | ".join(cells)
                + f" | {row['seconds']:.0f} s |"
            )


if __name__ == "__main__":
    main()
