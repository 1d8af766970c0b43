"""Solve the finite-element period cell and draw its section, and 60 mm of it with the winding.

python examples/02_period_cell.py [picture.png] [--elements coarse|medium|paper] [--pressures-kpa P ...]
"""

import argparse
from pathlib import Path

import matplotlib

matplotlib.use("Agg")

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection

from fem_reference import LEVELS, CellState, Load, PeriodCell, follow, prepare_process

STEP_KPA = 2.5


def main(arguments: list[str] | None = None) -> None:
    """Print the angles and write the picture."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("picture", nargs="?", default="docs/images/period_cell.png")
    parser.add_argument("--elements", choices=list(LEVELS), default="coarse")
    parser.add_argument("--pressures-kpa", nargs="+", type=float, default=[20.0, 40.0, 60.0])
    options = parser.parse_args(arguments)
    prepare_process()

    cell = PeriodCell(level=options.elements)
    shown = sorted(options.pressures_kpa)
    steps = sorted({*np.arange(STEP_KPA, shown[-1], STEP_KPA).tolist(), *shown})
    path = follow(cell, [Load((1e3 * p, 0.0, 0.0)) for p in steps])
    states = [state for p, state in zip(steps, path, strict=True) if p in shown]
    for state in states:
        length = cell.geometry.body_length
        angle, _ = np.degrees(state.bending(length))
        volumes = "  ".join(f"{v:.0f}" for v in 1e9 * length * state.volume)
        over = f"over {1e3 * length:g} mm"
        print(f"{state.pressure[0] / 1e3:5.1f} kPa: {angle:6.2f} deg {over}, chambers {volumes} mm³")
    draw(cell, states, Path(options.picture))
    print(f"drawn in {options.picture}")


def draw(cell: PeriodCell, states: list[CellState], file: Path) -> None:
    """Sections at the cell's bottom face, and stacked periods from the side."""
    panels = len(states) + 1
    figure, axes = plt.subplots(1, panels, figsize=(3.2 * panels, 3.4), layout="constrained")
    colours = plt.get_cmap("viridis")(np.linspace(0.15, 0.8, len(states)))
    faces = cell.equations.mesh.quads("bottom")
    radius = 1e3 * cell.geometry.cavity_diameter / 2
    for ax, state, colour in zip(axes, states, colours, strict=False):
        nodes = cell.equations.all_positions(state.configuration)
        section = PolyCollection(outlines(nodes[faces]), facecolor=colour, edgecolor="white", lw=0.4)
        ax.add_collection(section)
        ax.add_patch(plt.Circle((0.0, 0.0), radius, color="0.4"))
        ax.set(xlim=(-7, 9), ylim=(-8, 8), aspect="equal", xlabel="x [mm]")
        ax.set_title(f"{state.pressure[0] / 1e3:g} kPa in chamber 1")
        side_view(axes[-1], cell, state, colour)
    axes[0].set_ylabel("y [mm]")
    axes[-1].set(aspect="equal", adjustable="datalim", xlabel="x [mm]", ylabel="z [mm]")
    axes[-1].set_title("60 mm of winding")
    figure.savefig(file, dpi=150)


def outlines(quads: np.ndarray) -> np.ndarray:
    """Corners of each quadrilateral in order around its centre, (faces, 4, 2)."""
    flat = quads[:, :, :2]
    arm = flat - flat.mean(axis=1, keepdims=True)
    order = np.argsort(np.arctan2(arm[..., 1], arm[..., 0]), axis=1)
    return np.take_along_axis(flat, order[:, :, None], axis=1)


def side_view(ax: Axes, cell: PeriodCell, state: CellState, colour: np.ndarray) -> None:
    """Draw the threads of as many periods as the body holds, each the image of the one before."""
    equations = cell.equations
    points = equations.thread.points(equations.all_positions(state.configuration))
    turn, shift = equations.period_motion(state.configuration)
    for _ in range(round(cell.geometry.body_length / cell.winding.period)):
        for line in equations.thread.polylines:
            ax.plot(points[line, 0], points[line, 2], color=tuple(colour), lw=0.7)
        points = points @ turn.T + shift


if __name__ == "__main__":
    main()
