"""Bending at 10, 20, ..., 50 kPa in chamber 1 of the actuator: a table, and the poses in one picture.

Run as ``python examples/01_predict.py [PICTURE]``; the picture goes to build/bent_rod.png unless told
otherwise.
"""

import sys
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.markup import escape
from rich.table import Table

import rodmodel
from rodmodel.view import plot_rod

PICTURE = Path(__file__).parents[1] / "build" / "bent_rod.png"


def main(picture: Path) -> None:
    """Print the table and draw the picture."""
    rod = rodmodel.load_core("double-helix", psi=0.0, pitch=3e-3)
    pressures = [np.array([1e3 * kpa, 0.0, 0.0]) for kpa in (10, 20, 30, 40, 50)]
    solutions = [rod.solve(pressure) for pressure in pressures]

    table = Table(title="Double helix, psi 0 deg, pitch 3 mm: pressure in chamber 1 alone")
    for heading in (
        "p1 [kPa]",
        "θ [deg]",
        "γ [deg]",
        "tip x, y, z [mm]",
        "chamber volumes 1, 2, 3 [mm³]",
        "θ ± [deg]",
    ):
        table.add_column(escape(heading), justify="right")
    for pressure, solution in zip(pressures, solutions, strict=True):
        table.add_row(
            f"{1e-3 * pressure[0]:.0f}",
            f"{np.degrees(solution.bending_angle):.2f}",
            f"{np.degrees(solution.bending_plane):.2f}",
            "  ".join(f"{1e3 * x:6.2f}" for x in solution.tip_position),
            "  ".join(f"{1e9 * volume:7.1f}" for volume in solution.chamber_volume),
            f"{np.degrees(solution.error_estimate):.2f}",
        )
    # As wide as the table, whatever the terminal: it is to be read from a file too.
    Console(width=110).print(table)
    print("θ ±: 90 % of states of the full finite-element actuator are closer.")

    picture.parent.mkdir(parents=True, exist_ok=True)
    plot_rod(list(zip(pressures, solutions, strict=True)), rod.actuator, picture)
    print(f"wrote {picture}")


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else PICTURE)
