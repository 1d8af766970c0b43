"""Picture of a workspace: tip positions, and the map of bending angle and plane by chamber pressures."""

from pathlib import Path

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from matplotlib.layout_engine import ConstrainedLayoutEngine
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.ticker import MaxNLocator
from matplotlib.tri import Triangulation
from mpl_toolkits.mplot3d import Axes3D
from mpl_toolkits.mplot3d.art3d import Poly3DCollection

from rodmodel.actuator import Actuator
from rodmodel.control import Workspace
from rodmodel.io import atomic_part
from rodmodel.view.rod_shape import CHAMBER_COLOURS

# Lines of equal pressure of a chamber at most, and steps between circles of equal angle.
_LINES = 7
_CIRCLE_DEG = 30.0
# Width of the lines of a chamber alone [points].
_ALONE_WIDTH = 3.0


def plot_workspace(space: Workspace, actuator: Actuator, file: str | Path) -> None:
    """Draw the tip's positions and the map of angle and plane, and write the picture.

    Raises
    ------
    OSError
        If the file cannot be written.
    """
    figure = Figure(figsize=(12.0, 6.0), layout=ConstrainedLayoutEngine(h_pad=0.08, w_pad=0.08, wspace=0.06))
    meshes = [_mesh(space, chamber) for chamber in range(3)]
    _draw_tips(figure.add_subplot(1, 2, 1, projection="3d"), space, meshes, actuator)
    _draw_map(figure.add_subplot(1, 2, 2), space, meshes)
    handles: list[Artist] = [
        Patch(facecolor=colour, label=f"chamber {number}") for number, colour in enumerate(CHAMBER_COLOURS, 1)
    ]
    alone = [1e-3 * space.pressure[rows].max() for rows, _ in _alone(space) if len(rows)]
    if alone:
        reached = ", ".join(f"{kpa:g}" for kpa in alone)
        handles.append(
            Line2D([], [], color="0.35", linewidth=_ALONE_WIDTH, label=f"one chamber alone, to {reached} kPa")
        )
    figure.legend(handles=handles, loc="outside lower center", ncols=len(handles), frameon=False)
    with atomic_part(file) as part:
        figure.savefig(part, dpi=150, format=Path(file).suffix[1:])


class _Mesh:
    """Triangulation of the samples of one face, in the plane of its two pressures."""

    def __init__(self, pressure: np.ndarray, rows: np.ndarray, without: int) -> None:
        self.rows = rows
        self.pair = [chamber for chamber in range(3) if chamber != without]
        self.plane = Triangulation(*(1e-3 * pressure[rows][:, self.pair]).T)
        self.triangles = rows[self.plane.triangles]
        middle = pressure[self.triangles].mean(axis=1)
        self.colours = _blend(middle, float(pressure.max()))


def _mesh(space: Workspace, without: int) -> _Mesh:
    return _Mesh(space.pressure, np.flatnonzero((space.face == without) & space.converged), without)


def _alone(space: Workspace) -> list[tuple[np.ndarray, str]]:
    """Return the samples of each chamber alone beyond what it has beside others, with its colour."""
    beyond = (space.face == 4) & space.converged
    rows = [np.flatnonzero(beyond & (space.pressure[:, chamber] > 0.0)) for chamber in range(3)]
    return list(zip(rows, CHAMBER_COLOURS, strict=True))


def _blend(pressure: np.ndarray, largest: float) -> np.ndarray:
    """Mix the colours of the chambers by their pressures, paler for low ones, (n, 3)."""
    share = pressure / np.maximum(pressure.sum(axis=1, keepdims=True), 1e-12)
    full = share @ np.array([to_rgb(colour) for colour in CHAMBER_COLOURS])
    depth = 0.15 + 0.7 * np.clip(pressure.sum(axis=1, keepdims=True) / largest, 0.0, 1.0)
    return np.asarray(1.0 - depth * (1.0 - full))


def _draw_tips(axes: Axes3D, space: Workspace, meshes: list[_Mesh], actuator: Actuator) -> None:
    tips = 1e3 * space.tip_position
    for mesh in meshes:
        axes.add_collection3d(
            Poly3DCollection(
                tips[mesh.triangles], facecolors=mesh.colours, edgecolors=mesh.colours, linewidths=0.2
            )
        )
    for rows, colour in _alone(space):
        axes.plot(*tips[rows].T, color=colour, linewidth=_ALONE_WIDTH)
    rest = 1e3 * (actuator.body_length + actuator.cap_length)
    axes.plot([0.0, 0.0], [0.0, 0.0], [0.0, rest], color="black", linewidth=2.0)
    axes.text(0.0, 0.0, -3.0, "base", ha="center", va="top", fontsize=8)
    reach = np.nanmax(np.abs(tips[:, :2]))
    low = min(0.0, float(np.nanmin(tips[:, 2])))
    axes.set(
        xlim=(-reach, reach),
        ylim=(-reach, reach),
        zlim=(low, low + 2.0 * reach),
        xlabel="x [mm]",
        ylabel="y [mm]",
        zlabel="z [mm]",
        title="tip positions",
    )
    axes.set_box_aspect((1.0, 1.0, 1.0))
    axes.view_init(elev=22.0, azim=-40.0)


def _draw_map(axes: Axes, space: Workspace, meshes: list[_Mesh]) -> None:
    angle_deg = np.degrees(space.bending_angle)
    bend = angle_deg[:, None] * np.stack([np.cos(space.bending_plane), np.sin(space.bending_plane)], axis=1)
    axes.plot(*bend[space.face == 3].T, ".", color="0.6", markersize=1.0, zorder=0)
    levels = MaxNLocator(_LINES, steps=[1, 2, 5, 10]).tick_values(0.0, 1e-3 * float(space.pressure.max()))[1:]
    for mesh in meshes:
        axes.add_collection(
            PolyCollection(bend[mesh.triangles], facecolors=mesh.colours, edgecolors="face", linewidths=0.3)
        )
        in_map = Triangulation(bend[mesh.rows, 0], bend[mesh.rows, 1], mesh.plane.triangles)
        for chamber in mesh.pair:
            kpa = 1e-3 * space.pressure[mesh.rows, chamber]
            reached = levels[levels <= kpa.max() + 1e-6]
            if len(reached):
                axes.tricontour(in_map, kpa, levels=reached, colors=CHAMBER_COLOURS[chamber], linewidths=0.8)
    for rows, colour in _alone(space):
        axes.plot(*bend[rows].T, color=colour, linewidth=_ALONE_WIDTH, zorder=3)
    _draw_compass(axes, float(np.nanmax(angle_deg)))
    axes.set_title(f"bending angle θ and plane γ; lines of equal pressure every {levels[0]:g} kPa")


def _draw_compass(axes: Axes, largest_deg: float) -> None:
    """Draw circles of equal angle, and lines of equal plane every 60 degrees."""
    outer = _CIRCLE_DEG * np.ceil(largest_deg / _CIRCLE_DEG)
    azimuth = np.linspace(0.0, 2.0 * np.pi, 181)
    label_azimuth = np.radians(-30.0)
    for radius in np.arange(_CIRCLE_DEG, outer + 1e-6, _CIRCLE_DEG):
        axes.plot(radius * np.cos(azimuth), radius * np.sin(azimuth), color="0.75", linewidth=0.5)
        axes.text(
            radius * np.cos(label_azimuth),
            radius * np.sin(label_azimuth),
            f"θ = {radius:.0f}°",
            fontsize=7,
            color="0.35",
            ha="center",
            va="center",
            bbox={"facecolor": "white", "edgecolor": "none", "alpha": 0.7, "pad": 1.0},
        )
    for plane_deg in range(0, 360, 60):
        x, y = np.cos(np.radians(plane_deg)), np.sin(np.radians(plane_deg))
        axes.plot([0.0, outer * x], [0.0, outer * y], color="0.75", linewidth=0.5)
        axes.text(
            1.04 * outer * x,
            1.08 * outer * y,
            f"γ = {plane_deg}°",
            fontsize=8,
            ha="left" if x > 0.0 else "right",
            va="center",
        )
    axes.set_aspect("equal")
    axes.set(xlim=(-1.35 * outer, 1.35 * outer), ylim=(-1.12 * outer, 1.12 * outer))
    axes.axis("off")
