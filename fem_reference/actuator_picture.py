"""Draw the deformed actuator: its outer skin, shaded, with the winding on it."""

from pathlib import Path

import numpy as np
from matplotlib.figure import Figure
from mpl_toolkits.mplot3d.art3d import Line3DCollection, Poly3DCollection

from fem_reference.actuator import Actuator, ActuatorState
from fem_reference.mesh import TOP, cut
from fem_reference.section import OUTER

_LIGHT = np.array([0.3, -0.8, 0.5]) / np.linalg.norm([0.3, -0.8, 0.5])
_SILICONE = np.array([0.93, 0.80, 0.62])
_THREAD = "#1f4e79"
# Height of the winding above the skin in the picture [mm]; it lies below the skin in truth.
_LIFT = 0.5


def draw_actuator(actuator: Actuator, state: ActuatorState, file: str | Path) -> None:
    """Write a picture of the deformed actuator; the suffix chooses the format. Lengths in mm."""
    equations = actuator.equations
    x = state.deformation.positions
    mesh = equations.mesh
    quads = np.concatenate([cut(mesh.oriented(name), mesh.order) for name in (OUTER, TOP)])
    corner = x[quads]
    normal = -np.cross(corner[:, 2] - corner[:, 0], corner[:, 3] - corner[:, 1])
    normal /= np.linalg.norm(normal, axis=1)[:, None]
    shade = 0.55 + 0.45 * np.clip(normal @ _LIGHT, 0.0, 1.0)
    figure = Figure(figsize=(6.0, 6.0), layout="constrained")
    axes = figure.add_subplot(projection="3d", computed_zorder=False)
    axes.add_collection3d(Poly3DCollection(corner, facecolors=shade[:, None] * _SILICONE, zorder=1))
    view = _view_direction(axes, state)
    thread = equations.thread
    points = thread.points(x)
    axis = state.shape.positions * 1e3
    lines = []
    for line in thread.polylines:
        here = points[line]
        centre = axis[np.argmin(((here[:, None] - axis[None]) ** 2).sum(axis=2), axis=1)]
        out = here - centre
        out /= np.linalg.norm(out, axis=1)[:, None]
        here = here + _LIFT * out
        # Only what faces the eye: the renderer does not hide lines behind faces.
        seen = out @ view > 0.1
        lines += [here[i : i + 2] for i in range(len(here) - 1) if seen[i] and seen[i + 1]]
    if lines:
        axes.add_collection3d(Line3DCollection(lines, colors=_THREAD, linewidths=0.6, zorder=2))
    low, high = corner.min(axis=(0, 1)), corner.max(axis=(0, 1))
    for limits, a, b in zip((axes.set_xlim, axes.set_ylim, axes.set_zlim), low, high, strict=True):
        limits(a, b)
    axes.set_box_aspect(np.maximum(high - low, 1.0))
    axes.set_xlabel("x [mm]")
    axes.set_ylabel("y [mm]")
    axes.set_zlabel("z [mm]")
    pressures = ", ".join(f"{p / 1e3:g}" for p in state.load.pressure)
    axes.set_title(f"{pressures} kPa: {np.rad2deg(state.bending_angle):.1f}°")
    figure.savefig(file, dpi=150)


def _view_direction(axes: object, state: ActuatorState) -> np.ndarray:
    """Look across the bending plane, from a little above; return the direction to the eye."""
    azimuth, elevation = np.rad2deg(state.bending_plane) - 90.0, 12.0
    axes.view_init(elev=elevation, azim=azimuth)  # type: ignore[attr-defined]
    a, e = np.deg2rad([azimuth, elevation])
    return np.array([np.cos(e) * np.cos(a), np.cos(e) * np.sin(a), np.sin(e)])
