"""Picture of bent rods: in space, and from the side in the bending plane. Lengths in mm."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple, Protocol, runtime_checkable

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from matplotlib.layout_engine import ConstrainedLayoutEngine
from matplotlib.patches import Patch, Polygon, Rectangle
from mpl_toolkits.mplot3d import Axes3D
from mpl_toolkits.mplot3d.art3d import Poly3DCollection

from rodmodel.actuator import Actuator
from rodmodel.view.text import STRAIGHT

_SILICONE, _CAP = "#dcd8cf", "#8f8b84"
CHAMBER_COLOURS = ("#0072b2", "#e69f00", "#009e73")
# A chamber reaches this far from its middle: 60 degrees less half a partition wall.
_CHAMBER_HALF_WIDTH = np.radians(50.0)
_RINGS, _FACETS = 67, 48
# Towards the light, for bending towards -x.
_LIGHT = np.array([0.35, -0.6, 0.72])
# Half of a label's extent [mm], generously.
_LABEL_SIZE = np.array([8.0, 3.0])


@runtime_checkable
class Bent(Protocol):
    """What is drawn of a solution, of the compiled rod or of the differentiable one."""

    @property
    def bending_angle(self) -> Any:
        """θ [rad]."""

    @property
    def bending_plane(self) -> Any:
        """γ [rad]."""

    def centreline(self, arc_length: Any) -> Any:
        """Positions at arc lengths [m], (n, 3)."""

    def frames(self, arc_length: Any) -> Any:
        """Frames at arc lengths, directors as columns, (n, 3, 3)."""


class _Pose(NamedTuple):
    """Rod in millimetres, with the pressures as fractions of the largest in the picture."""

    centre: np.ndarray
    frames: np.ndarray
    in_cap: np.ndarray
    radius: float
    pressure_kpa: np.ndarray
    shade: np.ndarray
    angle_deg: float
    plane: float
    """γ [rad]; zero for a straight rod, which has none."""
    straight: bool


def plot_rod(poses: Sequence[tuple[np.ndarray, Bent]], actuator: Actuator, file: str | Path) -> None:
    """Draw one or several poses of a rod, the tube with its true diameter, and write the picture.

    Parameters
    ----------
    poses : gauge pressures of the three chambers [Pa] and the solution, of `CoreRod.solve` or of `Rod.solve`,
        for each pose. The side view is in the bending plane of the last one.
    actuator : dimensions.
    file : picture to write; its suffix is the format.

    Raises
    ------
    OSError
        Where the file cannot be written.
    """
    largest = max(float(np.max(pressure)) for pressure, _ in poses) or 1.0
    drawn = [_pose(pressure, largest, solution, actuator) for pressure, solution in poses]
    figure = Figure(figsize=(11.0, 6.0), layout=ConstrainedLayoutEngine(h_pad=0.08, w_pad=0.08, wspace=0.1))
    _draw_in_space(figure.add_subplot(1, 2, 1, projection="3d"), drawn)
    _draw_from_side(figure.add_subplot(1, 2, 2), drawn)
    figure.legend(handles=_legend(drawn), loc="outside lower center", ncols=4, frameon=False)
    figure.savefig(file, dpi=150)


def _pose(pressure: np.ndarray, largest: float, solution: Bent, actuator: Actuator) -> _Pose:
    arc_length = np.linspace(0.0, float(actuator.body_length + actuator.cap_length), _RINGS)
    straight = abs(float(solution.bending_angle)) < STRAIGHT
    return _Pose(
        centre=1e3 * np.asarray(solution.centreline(arc_length)),
        frames=np.asarray(solution.frames(arc_length)),
        in_cap=arc_length[:-1] > actuator.body_length - 1e-9,
        radius=float(0.5e3 * actuator.body_diameter),
        pressure_kpa=1e-3 * pressure,
        shade=pressure / largest,
        angle_deg=float(np.degrees(solution.bending_angle)),
        plane=0.0 if straight else float(solution.bending_plane),
        straight=straight,
    )


def _draw_in_space(axes: Axes3D, poses: list[_Pose]) -> None:
    # The light and the eye stand to the same side of the bending plane, wherever that is.
    plane = poses[-1].plane
    c, s = np.cos(plane), np.sin(plane)
    turn = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    surfaces = [_surface(pose, turn @ _LIGHT) for pose in poses]
    facets = np.concatenate([facets for facets, _ in surfaces])
    colours = np.concatenate([colours for _, colours in surfaces])
    axes.add_collection3d(Poly3DCollection(facets, facecolors=colours, edgecolors=colours, linewidths=0.3))
    points = facets.reshape(-1, 3)
    low, high = points.min(axis=0), points.max(axis=0)
    middle, half = 0.5 * (low + high), 0.5 * np.max(high - low)
    axes.set(
        xlim=(middle[0] - half, middle[0] + half),
        ylim=(middle[1] - half, middle[1] + half),
        zlim=(low[2], low[2] + 2.0 * half),
        xlabel="x [mm]",
        ylabel="y [mm]",
        zlabel="z [mm]",
    )
    axes.set_box_aspect((1.0, 1.0, 1.0))
    axes.view_init(elev=20.0, azim=float(np.degrees(plane)) - 40.0)


def _surface(pose: _Pose, light: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Quadrilaterals (n, 4, 3) of the tube and their colours (n, 3)."""
    azimuth = np.linspace(0.0, 2.0 * np.pi, _FACETS + 1)
    ring = np.stack([np.cos(azimuth), np.sin(azimuth)], axis=1)
    outward = np.einsum("nij,kj->nki", pose.frames[:, :, :2], ring)
    skin = pose.centre[:, None] + pose.radius * outward
    facets = np.stack([skin[:-1, :-1], skin[:-1, 1:], skin[1:, 1:], skin[1:, :-1]], axis=2)

    around = np.tile(to_rgb(_SILICONE), (_FACETS, 1))
    middle = 0.5 * (azimuth[:-1] + azimuth[1:])
    for chamber, (colour, shade) in enumerate(zip(CHAMBER_COLOURS, pose.shade, strict=True)):
        away = np.angle(np.exp(1j * (middle - 2.0 * np.pi / 3.0 * chamber)))
        around[np.abs(away) < _CHAMBER_HALF_WIDTH] = _tint(colour, shade)
    colours = np.repeat(around[None], len(facets), axis=0)
    colours[pose.in_cap] = to_rgb(_CAP)
    colours = colours * _lit(outward[:-1, :-1], light)[:, :, None]

    face = np.stack(
        [skin[-1, :-1], skin[-1, 1:], *2 * [np.repeat(pose.centre[-1:], _FACETS, axis=0)]], axis=1
    )
    face_colours = np.tile(to_rgb(_CAP), (_FACETS, 1)) * _lit(pose.frames[-1:, :, 2], light)[:, None]
    return np.concatenate([facets.reshape(-1, 4, 3), face]), np.concatenate(
        [colours.reshape(-1, 3), face_colours]
    )


def _lit(normal: np.ndarray, light: np.ndarray) -> np.ndarray:
    """Brightness of a surface with these outward normals."""
    return 0.65 + 0.35 * np.clip(normal @ light, 0.0, 1.0)


def _tint(colour: str, shade: float) -> np.ndarray:
    """Colour of a chamber: the silicone's without pressure, deeper with more."""
    depth = 0.25 + 0.75 * shade if shade > 0.0 else 0.0
    return (1.0 - depth) * np.array(to_rgb(_SILICONE)) + depth * np.array(to_rgb(colour))


def _draw_from_side(axes: Axes, poses: list[_Pose]) -> None:
    plane = poses[-1].plane
    ahead = -np.array([np.cos(plane), np.sin(plane), 0.0])
    for pose in poses:
        left, right = _outline(pose, ahead)
        body = np.count_nonzero(~pose.in_cap) + 1
        for part, colour in ((slice(0, body), _SILICONE), (slice(body - 1, None), _CAP)):
            corners = np.concatenate([left[part], right[part][::-1]])
            axes.add_patch(Polygon(corners, facecolor=colour, alpha=0.5, linewidth=0.0))
            axes.add_patch(Polygon(corners, fill=False, edgecolor="black", linewidth=0.7))
        centre = _seen(pose.centre, ahead)
        axes.plot(*centre.T, color="black", linewidth=0.7, linestyle=(0, (8, 3, 2, 3)))
        towards = _seen(pose.frames[-1, :, 2], ahead)
        label = f"{' / '.join(f'{p:g}' for p in pose.pressure_kpa)} kPa\nθ = {pose.angle_deg:.1f}°"
        place = centre[-1] + np.array([9.0, 5.0]) * towards
        axes.text(place[0], place[1], label, ha="center", va="center", fontsize=8)
        axes.update_datalim([place - _LABEL_SIZE, place + _LABEL_SIZE])
    low = 1.6 * poses[0].radius
    axes.add_patch(
        Rectangle((-low, -3.0), 2.0 * low, 3.0, facecolor="white", edgecolor="black", hatch="////")
    )
    axes.set_aspect("equal")
    axes.margins(0.04)
    axes.autoscale_view()
    name = "−x" if poses[-1].straight else f"in the bending plane, γ = {np.degrees(plane):.1f}°"
    axes.set(xlabel=f"{name} [mm]", ylabel="z [mm]")
    axes.grid(alpha=0.3)
    axes.set_axisbelow(True)


def _outline(pose: _Pose, ahead: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Both sides of the tube as seen at right angles to the plane of `ahead` and z: (n, 2) each."""
    tangent = _seen(pose.frames[:, :, 2], ahead)
    normal = np.stack([-tangent[:, 1], tangent[:, 0]], axis=1)
    normal *= pose.radius / np.linalg.norm(normal, axis=1, keepdims=True)
    centre = _seen(pose.centre, ahead)
    return centre + normal, centre - normal


def _seen(points: np.ndarray, ahead: np.ndarray) -> np.ndarray:
    """Components (..., 2) along `ahead` and z."""
    return np.stack([points @ ahead, points[..., 2]], axis=-1)


def _legend(poses: list[_Pose]) -> list[Patch]:
    pressures = np.array([pose.pressure_kpa for pose in poses])
    patches = []
    for chamber, colour in enumerate(CHAMBER_COLOURS):
        values = ", ".join(f"{value:g}" for value in dict.fromkeys(np.round(pressures[:, chamber], 6)))
        face = colour if np.any(pressures[:, chamber] > 0.0) else _SILICONE
        patches.append(Patch(facecolor=face, edgecolor="black", label=f"chamber {chamber + 1}: {values} kPa"))
    return patches
