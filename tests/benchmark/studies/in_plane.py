"""Chamber 1 of the cell in its plane of symmetry, mesh by mesh: the table of docs/explanation/branches.md.

Run as ``python -m tests.benchmark.studies.in_plane``; some ten minutes.
"""

import math

from calibration.sweep import usual_end_compliance
from fem_reference import Design, Load, MeshLevel, PeriodCell, follow

PRESSURES_KPA = (20.0, 40.0, 50.0, 56.0, 59.0, 61.0, 61.5, 62.0, 63.0, 65.0, 67.0, 70.0)
# Linear elements of half the size of those of `coarse`.
HALF = MeshLevel(8, 24, 8, 8, 4, 4, 2, 0.25)
MESHES = {name: name for name in ("coarse", "medium", "paper", "quadratic", "fine")} | {"half": HALF}


def main() -> None:
    """Print angle, stiffness in the plane and jumps at every load."""
    for name, level in MESHES.items():
        cell = PeriodCell(level=level, end_compliance=usual_end_compliance(Design()), symmetric=True)
        for state in follow(cell, [Load((1e3 * p, 0.0, 0.0)) for p in PRESSURES_KPA]):
            angle = math.degrees(state.bending(cell.geometry.body_length)[0])
            print(
                f"{name:10s} {1e-3 * state.pressure[0]:5.1f} kPa  {angle:7.2f} deg  "
                f"{1e4 * state.hessian[1, 1]:6.3f}e-4 N m2{'  snapped' if state.jumped else ''}",
                flush=True,
            )


if __name__ == "__main__":
    main()
