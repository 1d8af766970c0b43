"""Picture of a cell's path: its section, the bent body, and curves over the load."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from jaxtyping import Float
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from matplotlib.figure import Figure
from matplotlib.patches import Circle

from fem_reference.cell import CellState, PeriodCell
from fem_reference.io.atomic import atomic_part
from fem_reference.io.picture import SILICONE, THREAD, across, paint, thread_faces
from fem_reference.mesh import BOTTOM, OUTER, cut

_COLOURS = ("#0072b2", "#e69f00", "#009e73")
_STYLES = ("o-", "s--", "^:")
# Margin for a label beside the section, in the body's millimetres.
_MARGIN = 2.4
# Moments below this are the solver's residual, in the body's N mm.
_FREE = 1e-4
# A cell with less curvature is straight, in one over the body's millimetre.
_STRAIGHT = 1e-8


def draw_cell(cell: PeriodCell, states: Sequence[CellState], file: str | Path) -> None:
    """Write a picture of the last state and of the path to it; the suffix selects the format.

    Parameters
    ----------
    cell : cell of the states.
    states : states along the path, at least one; section and bent body show the last one.
    file : path of the file.

    Raises
    ------
    ValueError
        If there are no states.
    """
    if not states:
        raise ValueError("states: got none, expected at least one")
    figure = Figure(figsize=(13.0, 6.2), layout="constrained")
    grid = figure.add_gridspec(3, 3, width_ratios=(1.0, 1.1, 1.0))
    _draw_section(figure.add_subplot(grid[:, 0]), cell, states[-1])
    _draw_body(figure.add_subplot(grid[:, 1]), cell, states[-1])
    _draw_curves([figure.add_subplot(grid[row, 2]) for row in range(3)], cell, states)
    with atomic_part(file) as part:
        figure.savefig(part, dpi=150, format=Path(file).suffix[1:])


def _draw_section(axes: Axes, cell: PeriodCell, state: CellState) -> None:
    """Draw the bottom face, over its shape at rest."""
    equations = cell.equations
    mesh = equations.mesh
    millimetre = 1e3 * equations.units.millimetre
    at_rest, nodes = millimetre * mesh.points, millimetre * equations.all_positions(state.configuration)
    quads = mesh.quads(BOTTOM)
    margin = millimetre * _MARGIN
    rest = PolyCollection(list(at_rest[quads][:, :, :2]), facecolor="0.88", edgecolor="0.88", linewidth=0.3)
    moved = PolyCollection(
        list(nodes[quads][:, :, :2]), facecolor=SILICONE, edgecolor="#b08d57", linewidth=0.3, alpha=0.9
    )
    axes.add_collection(rest)
    axes.add_collection(moved)
    axes.add_patch(Circle((0.0, 0.0), 0.5e3 * cell.geometry.cavity_diameter, color="0.45"))
    outside = np.abs(nodes[np.unique(quads), :2]).max() + margin
    for chamber, colour in enumerate(_COLOURS):
        azimuth = 2.0 * np.pi / 3.0 * chamber
        text = f"chamber {chamber + 1}\n{1e-3 * state.pressure[chamber]:.4g} kPa"
        x, y = outside * np.cos(azimuth), outside * np.sin(azimuth)
        axes.text(x, y, text, ha="center", va="center", fontsize=9, color=colour)
        axes.update_datalim([(x - margin, y - margin), (x + margin, y + margin)])
    axes.autoscale_view()
    axes.set(aspect="equal", xlabel="x [mm]", ylabel="y [mm]", title="section, at rest in grey")


def _draw_body(axes: Axes, cell: PeriodCell, state: CellState) -> None:
    """Draw the periods of the body's length, each the image of the one before, across the bending plane."""
    equations = cell.equations
    mesh = equations.mesh
    u1, u2, _ = state.curvature
    straight = np.hypot(u1, u2) * equations.units.millimetre < _STRAIGHT
    plane = 0.0 if straight else float(np.arctan2(u1, -u2))
    view = across(plane)
    nodes = equations.all_positions(state.configuration)
    turn, shift = equations.period_motion(state.configuration)
    # The faces' normals point into the elements.
    quads = cut(mesh.oriented(OUTER), mesh.order)[:, ::-1]
    skins, threads, thread = [], [], equations.thread.points(nodes)
    cells = cell.geometry.body_length / cell.winding.cell_length(cell.geometry.body_diameter)
    for _ in range(max(1, round(cells))):
        skins.append(nodes[quads])
        threads.append(thread_faces(thread, equations.thread.polylines, skins[-1], view))
        nodes, thread = nodes @ turn.T + shift, thread @ turn.T + shift
    millimetre = 1e3 * equations.units.millimetre
    bodies = [(np.concatenate(skins), SILICONE), (np.concatenate(threads), THREAD)]
    paint(axes, view, [(millimetre * faces, colour) for faces, colour in bodies])
    axes.autoscale_view()
    length = 1e3 * cell.geometry.body_length
    angle = np.rad2deg(cell.geometry.body_length * np.hypot(u1, u2))
    gamma = "" if straight else f", γ = {np.rad2deg(plane) % 360.0:.1f}°"
    axes.set(
        aspect="equal",
        xlabel="−x [mm]" if straight else "in the bending plane [mm]",
        ylabel="z [mm]",
        title=f"{length:g} mm, uniformly bent: θ = {angle:.1f}°{gamma}",
    )
    axes.grid(alpha=0.3)
    axes.set_axisbelow(True)


def _draw_curves(axes: list[Axes], cell: PeriodCell, states: Sequence[CellState]) -> None:
    """Draw angle, curvature, and moments or else volumes, over the load."""
    raised, name = _load_measure(states)
    length = cell.geometry.body_length
    curvature = np.array([state.curvature for state in states])
    moment = np.array([state.moment for state in states])
    angle = np.rad2deg(length * np.hypot(curvature[:, 0], curvature[:, 1]))
    axes[0].plot(raised, angle, "ko-", markersize=3.0)
    axes[0].set_ylabel(f"θ of {1e3 * length:g} mm [deg]")
    _plot_three(axes[1], raised, curvature, "u")
    axes[1].set_ylabel("curvature, twist [1/m]")
    units = cell.equations.units
    if np.abs(moment).max() > _FREE * units.newton * units.millimetre:
        _plot_three(axes[2], raised, 1e3 * moment, "m")
        axes[2].set_ylabel("moment [N mm]")
    else:
        volume = 1e9 * length * np.array([state.volume for state in states])
        _plot_three(axes[2], raised, volume, "V", _COLOURS)
        axes[2].set_ylabel(f"chamber volumes\nof {1e3 * length:g} mm [mm³]")
    axes[2].set_xlabel(name)
    for panel in axes:
        panel.grid(alpha=0.3)
    for panel in axes[:2]:
        panel.tick_params(labelbottom=False)


def _plot_three(
    axes: Axes,
    raised: Float[np.ndarray, " n"],
    values: Float[np.ndarray, "n 3"],
    symbol: str,
    colours: tuple[str, ...] = ("#444444", "#c0392b", "#7d3c98"),
) -> None:
    for number, (style, colour) in enumerate(zip(_STYLES, colours, strict=True)):
        label = f"{symbol}{'₁₂₃'[number]}"
        axes.plot(raised, values[:, number], style, color=colour, markersize=3.0, label=label)
    axes.legend(fontsize=8, loc="best", framealpha=0.8)


def _load_measure(states: Sequence[CellState]) -> tuple[Float[np.ndarray, " n"], str]:
    """Return values and name of the load: the largest pressure, or else the curvature or the moment."""
    last = states[-1]
    chamber = int(np.argmax(last.pressure))
    if last.pressure[chamber] > 0.0:
        kpa = 1e-3 * np.array([state.pressure[chamber] for state in states])
        return kpa, f"pressure in chamber {chamber + 1} [kPa]"
    if last.load.curvature is not None:
        return np.array([np.linalg.norm(state.curvature) for state in states]), "size of the curvature [1/m]"
    return 1e3 * np.array([np.linalg.norm(state.moment) for state in states]), "size of the moment [N mm]"
