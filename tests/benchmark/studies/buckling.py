"""Chamber 2 of the coarse cell, loaded to 70 kPa and unloaded: the table of docs/notes/cell.md on buckling.

Run as ``python -m tests.benchmark.studies.buckling``; some minutes.
"""

import numpy as np

from fem_reference import Load, PeriodCell, follow

STEP_KPA, TOP_KPA, LOW_KPA = 2.5, 70.0, 40.0


def main() -> None:
    """Print angle, plane, softest stiffness and stability at every load."""
    up = np.arange(STEP_KPA, TOP_KPA + 0.1, STEP_KPA)
    down = np.arange(TOP_KPA - STEP_KPA, LOW_KPA - 0.1, -STEP_KPA)
    cell = PeriodCell(level="coarse")
    for state in follow(cell, [Load((0.0, 1e3 * p, 0.0)) for p in (*up, *down)]):
        angle, plane = np.degrees(state.bending(cell.geometry.body_length))
        softest = np.linalg.eigvalsh(state.hessian[:3, :3]).min()
        print(
            f"{state.pressure[1] / 1e3:5.1f} kPa  {angle:7.2f} deg  plane "
            f"{plane % 360.0:6.1f} deg  softest {1e4 * softest:6.3f}e-4 N m2  "
            f"{'stable' if state.stable else 'unstable'}",
            flush=True,
        )


if __name__ == "__main__":
    main()
