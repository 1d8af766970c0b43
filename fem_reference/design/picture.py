"""Picture of a design: its section with the mesh, its winding unrolled, and the whole body from the side."""

import math
from typing import TYPE_CHECKING

import numpy as np

from fem_reference.design.design import Design

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from fem_reference.mesh import MeshLevel

_SILICONE, _EDGE, _THREAD, _CORE = "#edcc9e", "#b08d57", "#1f4e79", "0.45"
_CHAMBERS = ("#0072b2", "#e69f00", "#009e73")
_MM = 1e3
# Points of a turn of the thread, and periods of it that are shown unrolled.
_TURN, _PERIODS = 120, 4.0


def design_figure(design: Design, level: "MeshLevel | None" = None) -> "Figure":
    """Return the picture as a figure of matplotlib, to save.

    Parameters
    ----------
    design : to draw.
    level : mesh whose edges are drawn in the section, by gmsh; None for the section alone.
    """
    from matplotlib.figure import Figure

    figure = Figure(figsize=(14.0, 6.0), layout="constrained")
    section, winding, side = figure.subplots(1, 3, width_ratios=(1.25, 1.0, 0.75))
    _draw_section(section, design, level)
    _draw_winding(winding, design)
    _draw_side(side, design)
    figure.suptitle(design.name)
    return figure


def _draw_section(axes: "Axes", design: Design, level: "MeshLevel | None") -> None:
    from matplotlib.patches import Circle, Polygon

    geometry = design.geometry
    radius = 0.5 * _MM * geometry.body_diameter
    axes.add_patch(Circle((0.0, 0.0), radius, facecolor=_SILICONE, edgecolor=_EDGE))
    for chamber, colour in enumerate(_CHAMBERS):
        outline = _MM * _chamber_outline(design, chamber)
        axes.add_patch(Polygon(outline, facecolor="white", edgecolor=_EDGE))
        middle = outline.mean(axis=0)
        axes.text(middle[0], middle[1], f"{chamber + 1}", ha="center", va="center", color=colour, fontsize=12)
    if level is not None:
        _draw_mesh(axes, design, level)
    axes.add_patch(Circle((0.0, 0.0), 0.5 * _MM * geometry.cavity_diameter, color=_CORE, zorder=3))
    if _wound(design):
        wire = 0.5 * _MM * geometry.winding_diameter
        axes.add_patch(
            Circle((0.0, 0.0), wire, fill=False, edgecolor=_THREAD, linestyle="--", linewidth=1.2, zorder=4)
        )
    axes.set(
        aspect="equal",
        xlim=(-1.08 * radius, 1.08 * radius),
        ylim=(-1.08 * radius, 1.08 * radius),
        xlabel="x [mm]",
        ylabel="y [mm]",
        title="section" if level is None else "section and its mesh",
    )


def _chamber_outline(design: Design, chamber: int) -> np.ndarray:
    """Corners of a fine polygon around a chamber [m]."""
    geometry = design.geometry
    arcs = []
    for radius, backwards in (
        (geometry.chamber_inner_radius, False),
        (geometry.chamber_outer_radii[chamber], True),
    ):
        half = geometry.chamber_half_angle(radius)
        azimuth = 2.0 * math.pi / 3.0 * chamber + np.linspace(-half, half, 40)
        arc = radius * np.column_stack([np.cos(azimuth), np.sin(azimuth)])
        arcs.append(arc[::-1] if backwards else arc)
    return np.concatenate(arcs)


def _draw_mesh(axes: "Axes", design: Design, level: "MeshLevel") -> None:
    from matplotlib.collections import PolyCollection

    from fem_reference.mesh.cross_section import mesh_section

    section = mesh_section(design.geometry, level)
    side = level.order + 1
    grid = section.quads.reshape(-1, side, side)
    around = np.concatenate(
        [grid[:, 0, :-1], grid[:, :-1, -1], grid[:, -1, :0:-1], grid[:, :0:-1, 0]], axis=1
    )
    axes.add_collection(
        PolyCollection(
            list(section.points[around]), facecolor="none", edgecolor=_EDGE, linewidth=0.5, zorder=2
        )
    )


def _wound(design: Design) -> bool:
    return bool(_polylines(design, design.geometry.body_length))


def _polylines(design: Design, length: float) -> list[np.ndarray]:
    return design.winding.polylines(design.geometry.winding_diameter / 2.0, length, _TURN)


def _draw_winding(axes: "Axes", design: Design) -> None:
    """Draw the thread over azimuth and height."""
    length = min(design.geometry.body_length, _PERIODS * design.winding.period)
    for chamber, colour in enumerate(_CHAMBERS):
        half = math.degrees(design.geometry.chamber_half_angle(design.geometry.chamber_outer_radii[chamber]))
        for middle in (120.0 * chamber, 120.0 * chamber + 360.0):
            axes.axvspan(middle - half, middle + half, color=colour, alpha=0.12, linewidth=0.0)
    for line in _polylines(design, length):
        azimuth = np.degrees(np.unwrap(np.arctan2(line[:, 1], line[:, 0])))
        least = math.floor((azimuth.min() - 360.0) / 360.0)
        for turn in range(least, math.ceil(azimuth.max() / 360.0) + 1):
            axes.plot(azimuth - 360.0 * turn, _MM * line[:, 2], color=_THREAD, linewidth=1.2)
    words = design.winding.name if _wound(design) else "no winding"
    axes.set(
        xlim=(0.0, 360.0),
        xticks=[0.0, 60.0, 120.0, 180.0, 240.0, 300.0, 360.0],
        ylim=(0.0, _MM * length),
        xlabel="azimuth from the middle of chamber 1 [deg]",
        ylabel="z [mm]",
        title=f"{words}, unrolled; chambers in colour",
    )


def _draw_side(axes: "Axes", design: Design) -> None:
    """Draw body, cap and core from the side, with the front half of the thread."""
    from matplotlib.patches import Rectangle

    geometry = design.geometry
    radius, length, cap = (
        _MM * value for value in (geometry.body_diameter / 2.0, geometry.body_length, geometry.cap_length)
    )
    axes.add_patch(Rectangle((-radius, 0.0), 2.0 * radius, length, facecolor=_SILICONE, edgecolor=_EDGE))
    axes.add_patch(
        Rectangle((-radius, length), 2.0 * radius, cap, facecolor=_SILICONE, edgecolor=_EDGE, hatch="///")
    )
    wound = geometry.body_length + (geometry.cap_length if design.cap_wound else 0.0)
    for line in _polylines(design, wound):
        front = np.where(line[:, 1:2] <= 0.0, _MM * line, np.nan)
        axes.plot(front[:, 0], front[:, 2], color=_THREAD, linewidth=0.8)
    axes.set(
        aspect="equal",
        xlim=(-1.3 * radius, 1.3 * radius),
        ylim=(-0.03 * length, 1.03 * (length + cap)),
        xlabel="x [mm]",
        ylabel="z [mm]",
        title="side, cap hatched",
    )
