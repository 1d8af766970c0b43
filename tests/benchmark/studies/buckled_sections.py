"""The cell's section before and after a partition wall buckles, as a picture.

Run as ``python -m tests.benchmark.studies.buckled_sections docs/images/buckled_sections.png``; a minute.
"""

import sys

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from matplotlib.figure import Figure
from matplotlib.patches import Circle

from calibration.snapped import SnappedSheet, snapped_state
from calibration.sweep import usual_end_compliance
from fem_reference import CellState, Design, Load, PeriodCell, follow

# Chamber 2 of the coarse mesh: upright, and snapped to either side [kPa].
UPRIGHT_KPA, SNAPPED_KPA = (0.0, 40.0), 65.0
MOMENT_MAX = 6.6e-3
SHEETS = {"snapped": SnappedSheet(2, 1), "snapped to the other side": SnappedSheet(2, -1)}


def draw(axes: Axes, cell: PeriodCell, state: CellState, title: str) -> None:
    """Draw the bottom face in its frame, its largest pressure and its bend in the title."""
    equations = cell.equations
    quads = equations.mesh.quads("bottom")
    nodes = 1e3 * equations.all_positions(state.configuration) * equations.units.millimetre
    axes.add_collection(
        PolyCollection(list(nodes[quads][:, :, :2]), facecolor="#e8d5b0", edgecolor="#b08d57", linewidth=0.4)
    )
    axes.add_patch(Circle((0.0, 0.0), 0.5e3 * cell.geometry.cavity_diameter, color="0.45"))
    angle, plane = np.degrees(state.bending(cell.geometry.body_length))
    where = "" if angle < 1.0 else f"\n{angle:.0f}°, plane {plane % 360.0:.0f}°"
    axes.set_title(f"{title}{where}", fontsize=9)
    axes.set(xlim=(-8.7, 7.3), ylim=(-7.0, 9.0), aspect="equal")
    axes.axis("off")


def main() -> None:
    """Draw four sections side by side."""
    cell = PeriodCell(level="coarse", end_compliance=usual_end_compliance(Design()))
    states = list(follow(cell, [Load((0.0, 1e3 * kpa, 0.0)) for kpa in UPRIGHT_KPA]))
    titles = ["at rest", f"{UPRIGHT_KPA[1]:g} kPa, upright"]
    for title, sheet in SHEETS.items():
        states.append(
            snapped_state(
                lambda loads, start: follow(cell, loads, start), sheet, 1e3 * SNAPPED_KPA, MOMENT_MAX
            )
        )
        titles.append(f"{SNAPPED_KPA:g} kPa, {title}")
    figure = Figure(figsize=(10.5, 3.6), layout="constrained")
    for axes, state, title in zip(figure.subplots(1, 4), states, titles, strict=True):
        draw(axes, cell, state, title)
    figure.savefig(sys.argv[1], dpi=130)


if __name__ == "__main__":
    main()
