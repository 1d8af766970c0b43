"""How the figures draw cell, full actuator and rod in one panel, and the rod's errors underneath."""

from collections.abc import Sequence
from pathlib import Path
from typing import Literal

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from figures.comparison import Series

IMAGES = Path(__file__).parents[2] / "docs" / "images"
COLOURS = ("#0072b2", "#e69f00", "#009e73")
LOADING = {"lw": 1.5}
SNAPPED = {"lw": 3.0, "alpha": 0.5, "solid_capstyle": "butt"}
# Circles are the cell's, squares with an edge the full actuator's; both are open after a snap.
CELL = {"marker": "o", "ms": 4.0, "ls": ""}
ACTUATOR = {"marker": "s", "ms": 4.5, "ls": ""}
EDGE, OPEN = {"mec": "black", "mew": 0.7}, {"mfc": "white"}


def angle_figure(columns: int) -> tuple[Figure, list[tuple[Axes, Axes]]]:
    """Return a figure of columns of two panels, angle and error."""
    figure = Figure(figsize=(2.6 * columns + 1.2, 5.4), layout="constrained")
    axes = figure.subplots(2, columns, sharex=True, sharey="row", height_ratios=(3, 1), squeeze=False)
    axes[0, 0].set_ylabel("bending angle [deg]")
    axes[1, 0].set_ylabel("rod − FEM [deg]")
    return figure, [(axes[0, k], axes[1, k]) for k in range(columns)]


def draw_angles(panels: tuple[Axes, Axes], drawn: Sequence[Series], title: str) -> None:
    """Draw angles against pressure, and the rod's errors underneath."""
    above, below = panels
    for colour, one in zip(COLOURS, drawn, strict=False):
        draw(above, one, colour, "angle")
        draw_errors(below, one, colour)
    above.set_title(title, fontsize=10)
    above.grid(alpha=0.3)
    above.legend(fontsize=7, loc="upper left")
    below.grid(alpha=0.3)
    below.set_xticks(range(0, 71, 10))
    below.set_xlabel("pressure [kPa]")


def draw(panel: Axes, one: Series, colour: str, quantity: Literal["angle", "plane"]) -> None:
    """Draw angle or plane against pressure; the series' label is the curve's."""
    panel.plot([], [], color=colour, lw=1.5, label=one.label)
    for curve in one.curves:
        style = SNAPPED if curve.snapped else LOADING
        panel.plot(curve.pressure, _continuous(getattr(curve, quantity), quantity), color=colour, **style)
    for points, style, edge in ((one.cell, CELL, {}), (one.actuator, ACTUATOR, EDGE)):
        values = _continuous(getattr(points, quantity), quantity)
        for rows, upright in ((~points.snapped, edge), (points.snapped, OPEN)):
            panel.plot(points.pressure[rows], values[rows], color=colour, **style, **upright)


def draw_errors(panel: Axes, one: Series, colour: str) -> None:
    """Draw the rod's errors against pressure."""
    panel.axhline(0.0, color="0.5", lw=0.8)
    panel.plot(one.cell.pressure, one.cell_error, "o-", color=colour, ms=3, lw=0.8)
    panel.plot(one.actuator.pressure, one.actuator_error, "s-", color=colour, ms=3.5, lw=0.8, **EDGE)


def _continuous(values: np.ndarray, quantity: str) -> np.ndarray:
    """Planes near 360° drawn near 0°."""
    return np.where(values > 350.0, values - 360.0, values) if quantity == "plane" else values


def add_legend(figure: Figure) -> None:
    """Say below the panels what lines and marks are."""
    grey = "0.35"
    handles = [
        Line2D([], [], color=grey, label="rod, loading", **LOADING),
        Line2D([], [], color=grey, label="rod, a wall snapped", **SNAPPED),
        Line2D([], [], color=grey, label="cell, 60 mm without ends", **CELL),
        Line2D([], [], color=grey, label="full actuator", **ACTUATOR, **EDGE),
        Line2D([], [], color=grey, label="cell, snapped", **CELL, **OPEN),
        Line2D([], [], color=grey, label="actuator, snapped", **ACTUATOR, **OPEN),
    ]
    figure.legend(handles=handles, loc="outside lower center", ncols=6, fontsize=8, frameon=False)


def save(figure: Figure, file: Path) -> None:
    """Write a figure and say so."""
    file.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(file, dpi=130)
    print(f"wrote {file}")
