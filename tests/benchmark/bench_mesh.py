"""The period cell under mesh refinement: angle against element size, with a picture.

Run as ``python -m tests.benchmark.bench_mesh [FILE.png]``. The meshes are the coarse one with every count
multiplied by 1, 4/3, 5/3 and 2, threads included (one segment per host element around): 6, 8, 10 and 12
layers in a pitch, even numbers all of them. The two finest tell a limit, by Richardson's extrapolation at
second order.
"""

import sys
import time
from dataclasses import replace

import matplotlib
import numpy as np

matplotlib.use("Agg")

import matplotlib.pyplot as plt

from fem_reference import LEVELS, Load, MeshLevel, PeriodCell, follow

FACTORS = (1.0, 4.0 / 3.0, 5.0 / 3.0, 2.0)
PRESSURES_KPA = (2.5, 5.0, 10.0, 15.0, 20.0, 25.0, 30.0, 35.0, 40.0, 45.0, 50.0)
SHOWN_KPA = (5.0, 20.0, 40.0, 50.0)
ORDER = 2


def refined(level: MeshLevel, factor: float) -> MeshLevel:
    """Every count of a level multiplied by a factor, the axial size divided by it."""
    counts = {
        name: round(getattr(level, name) * factor)
        for name in level.__dataclass_fields__
        if name not in ("axial_size", "order")
    }
    return replace(level, **counts, axial_size=level.axial_size / factor)


def main() -> None:
    """Solve, print the table and draw it."""
    file = sys.argv[1] if len(sys.argv) > 1 else "docs/images/mesh_refinement.png"
    angles, sizes = [], []
    for factor in FACTORS:
        start = time.perf_counter()
        cell = PeriodCell(level=refined(LEVELS["coarse"], factor))
        loads = [Load((1e3 * p, 0.0, 0.0)) for p in PRESSURES_KPA]
        states = list(follow(cell, loads))
        row = [np.degrees(cell.geometry.body_length * abs(s.curvature[1])) for s in states]
        angles.append(row)
        sizes.append(cell.elements)
        shown = "  ".join(f"{row[PRESSURES_KPA.index(p)]:7.3f}" for p in SHOWN_KPA)
        print(f"x{factor:.2f} {cell.elements:6d} hexahedra  {shown}  ({time.perf_counter() - start:.0f} s)")
    found = np.array(angles)
    grown = (FACTORS[-1] / FACTORS[-2]) ** ORDER
    limit = found[-1] + (found[-1] - found[-2]) / (grown - 1.0)
    for p in SHOWN_KPA:
        k = PRESSURES_KPA.index(p)
        errors = ", ".join(f"{100 * (row[k] / limit[k] - 1):+.2f} %" for row in found)
        print(f"{p:4.0f} kPa: limit {limit[k]:.3f} deg, the meshes' errors {errors}")

    figure, axes = plt.subplots(1, 2, figsize=(9, 3.6), layout="constrained")
    for row, count in zip(found, sizes, strict=True):
        axes[0].plot(PRESSURES_KPA, row, "o-", ms=3, label=f"{count} hexahedra")
    axes[0].set(xlabel="pressure in chamber 1 [kPa]", ylabel="bending angle of 60 mm [deg]")
    axes[0].legend(frameon=False)
    for p in SHOWN_KPA:
        k = PRESSURES_KPA.index(p)
        axes[1].plot(1.0 / np.array(FACTORS), 100 * (found[:, k] / limit[k] - 1), "o-", label=f"{p:g} kPa")
    axes[1].set(xlabel="element size / coarse", ylabel="angle relative to the limit [%]")
    axes[1].legend(frameon=False)
    figure.savefig(file, dpi=150)
    print(f"drawn in {file}")


if __name__ == "__main__":
    main()
