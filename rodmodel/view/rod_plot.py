"""Picture of bent rods: section, view in space, and side view of the bending plane. Lengths in mm."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Circle, Polygon, Rectangle, Wedge

from rodmodel.actuator import Actuator
from rodmodel.io import atomic_part
from rodmodel.view.labels import Label, place_labels
from rodmodel.view.rod_loads import Arrow, arrows_of
from rodmodel.view.rod_shape import CAP, CHAMBER_HALF_WIDTH, SILICONE, Bent, Pose, pose_of, skin, tints
from rodmodel.view.scene import Camera, Faces, arrow, disc, paint, plate, rod

# Width and height of the figure [inches].
_SIZE = (13.0, 6.6)
# Axes: left, bottom, width and height over those of the figure.
_SECTION, _LIST = (0.015, 0.55, 0.20, 0.34), (0.015, 0.04, 0.20, 0.46)
_SPACE, _SIDE = (0.225, 0.04, 0.33, 0.85), (0.60, 0.10, 0.385, 0.79)
_AXES_COLOURS = {"x": "#d62728", "y": "#2ca02c", "z": "#1f77b4"}
_PLATE = "#b8b8b8"
_POINTS_PER_INCH = 72.0
# Space around the drawing [points], on each side, and in all for the labels of loads.
_MARGIN, _LABEL_SPACE = np.array([20.0, 26.0]), np.array([110.0, 30.0])


class _Base(NamedTuple):
    """Pose of the clamp, and the direction to which the last pose bends."""

    position: np.ndarray
    rotation: np.ndarray
    ahead: np.ndarray
    given: bool


def plot_rod(
    poses: Sequence[tuple[np.ndarray, Bent]],
    actuator: Actuator,
    file: str | Path,
    given: Mapping[str, Any] | None = None,
) -> None:
    """Draw one or several poses of a rod, the tube to scale, and write the picture.

    Parameters
    ----------
    poses : gauge pressures of the three chambers [Pa] and the solution, of `CoreRod.solve` or `Rod.solve`,
        for each pose. The side view shows the bending plane of the last pose. In space the last one is solid;
        the others are drawn as axes and caps.
    actuator : dimensions.
    file : picture to write; its suffix is the format.
    given : loads and base of all solutions, by their names in `Rod.solve`, SI; drawn as arrows.

    Raises
    ------
    OSError
        If the file cannot be written.
    ValueError
        For no poses, and for a solution of bad input, which has no shape.
    """
    if not poses:
        raise ValueError("poses: got none, expected at least one")
    loads = {} if given is None else given
    largest = max(float(np.max(pressure)) for pressure, _ in poses) or 1.0
    drawn = [pose_of(pressure, largest, solution, actuator) for pressure, solution in poses]
    base = _base(loads, drawn[-1])
    # Gravity's arrow stands on the side that the rod bends away from.
    beside = base.position + drawn[-1].radius * (4.0 * base.rotation[:, 2] - 3.4 * base.ahead)
    arrows = arrows_of(loads, drawn[-1], beside)
    figure = Figure(figsize=_SIZE)
    figure.suptitle(_title(drawn), fontsize=11, y=0.965)
    _draw_section(figure.add_axes(_SECTION), drawn)
    _write_list(figure.add_axes(_LIST), drawn)
    _draw_in_space(figure.add_axes(_SPACE), drawn, base, arrows)
    _draw_from_side(figure.add_axes(_SIDE), drawn, base, arrows)
    with atomic_part(file) as part:
        figure.savefig(part, dpi=150, format=Path(file).suffix[1:])


def _base(loads: Mapping[str, Any], last: Pose) -> _Base:
    position, rotation = loads.get("base_position"), loads.get("base_rotation")
    turn = np.eye(3) if rotation is None else np.asarray(rotation, float)
    return _Base(
        position=np.zeros(3) if position is None else 1e3 * np.asarray(position, float),
        rotation=turn,
        ahead=turn @ -np.array([np.cos(last.plane), np.sin(last.plane), 0.0]),
        given=position is not None or rotation is not None,
    )


def _title(poses: list[Pose]) -> str:
    if len(poses) > 1:
        angles = [pose.angle_deg for pose in poses]
        return f"{len(poses)} poses, θ = {min(angles):.1f}° to {max(angles):.1f}°"
    (pose,) = poses
    error = "beyond the calibration: an extrapolation"
    if np.isfinite(pose.error_deg):
        error = f"within {pose.error_deg:.2g}°"
    plane = "straight" if pose.straight else f"γ = {pose.plane_deg}"
    tip = ", ".join(f"{x:.1f}".replace("-", "−") for x in np.round(pose.tip, 1) + 0.0)
    title = f"{pose.pressures}:  θ = {pose.angle_deg:.1f}° ({error}),  {plane},  tip ({tip}) mm"
    if pose.load_fraction < 1.0:
        title += f"\nno convergence: this is at {100.0 * pose.load_fraction:.3g} % of the loads"
    return title


def _draw_section(axes: Axes, poses: list[Pose]) -> None:
    """Draw the chambers as seen from the tip, in their colours, with their pressures."""
    axes.add_patch(Circle((0.0, 0.0), 1.0, facecolor=SILICONE, edgecolor="black", linewidth=0.8))
    axes.add_patch(Circle((0.0, 0.0), 0.17, facecolor="white", edgecolor="black", linewidth=0.8))
    pressures = np.array([pose.pressure_kpa for pose in poses])
    half = np.degrees(CHAMBER_HALF_WIDTH)
    for chamber, colour in enumerate(tints(np.max([pose.shade for pose in poses], axis=0))):
        azimuth = 120.0 * chamber
        sector = Wedge((0.0, 0.0), 0.83, azimuth - half, azimuth + half, width=0.41)
        sector.set(facecolor=colour, edgecolor="black", linewidth=0.8)
        axes.add_patch(sector)
        x, y = 0.625 * np.cos(np.radians(azimuth)), 0.625 * np.sin(np.radians(azimuth))
        axes.text(x, y, str(chamber + 1), ha="center", va="center", fontsize=11)
        low, high = pressures[:, chamber].min(), pressures[:, chamber].max()
        value = f"{low:.4g}" if low == high else f"{low:.4g} to {high:.4g}"
        side = "left" if chamber == 0 else "center"
        x, y = (1.08, 0.0) if chamber == 0 else (-0.55, 1.24 * np.sign(y))
        axes.text(x, y, f"{value} kPa", ha=side, va="center", fontsize=9)
    axes.set(xlim=(-1.25, 2.35), ylim=(-1.5, 1.5), aspect="equal", title="chambers, seen from the tip")
    axes.title.set_fontsize(9)
    axes.axis("off")


def _write_list(axes: Axes, poses: list[Pose]) -> None:
    """Write the numbered list of the poses' pressures, angles and planes."""
    axes.axis("off")
    if len(poses) == 1:
        return
    size = min(9.0, 9.0 * 18 / len(poses))
    lines = [
        f"{number}:  {pose.pressures}\n     θ = {pose.angle_deg:.1f}°"
        + f", γ = {pose.plane_deg}" * (not pose.straight)
        for number, pose in enumerate(poses, 1)
    ]
    axes.text(0.05, 1.0, "\n".join(lines), ha="left", va="top", fontsize=size, transform=axes.transAxes)


def _draw_in_space(axes: Axes, poses: list[Pose], base: _Base, arrows: list[Arrow]) -> None:
    # The camera looks from a fixed angle to the bending plane.
    x, y, _ = -base.ahead
    azimuth = np.arctan2(y, x) - np.radians(40.0)
    elevation = np.radians(20.0)
    eye = [np.cos(elevation) * np.cos(azimuth), np.cos(elevation) * np.sin(azimuth), np.sin(elevation)]
    camera = Camera.towards(eye, (0.0, 0.0, 1.0))
    last = poses[-1]
    parts = [skin(last), plate(base.position, base.rotation, (1.0 * last.radius, 1.6 * last.radius), _PLATE)]
    for pose in poses[:-1]:
        parts.append(rod(pose.centre, 0.12 * pose.radius, "#6b6b6b"))
        body = int(np.count_nonzero(~pose.in_cap))
        if body < len(pose.in_cap):
            parts.append(skin(pose.behind(body)))
            parts.append(disc(pose.centre[body], -pose.frames[body, :, 2], pose.radius, CAP))
    for load in arrows:
        parts.append(arrow(load.tail, load.head, 0.1 * last.radius, load.colour, load.heads))
    faces = Faces.joined(parts)
    points = camera.project(faces.corners).reshape(-1, 2)
    per_point = _fit(axes, points, _SPACE, bool(arrows))
    paint(axes, camera, faces, 0.35 * camera.right + 0.72 * camera.up + 0.6 * camera.eye)
    axes.axis("off")
    corner = _draw_triad(axes, camera, base, per_point)
    tips = _tip_labels(poses, camera)
    place_labels(axes, [*tips, *_load_labels(arrows, camera)], np.concatenate([points, corner]), per_point)


def _draw_from_side(axes: Axes, poses: list[Pose], base: _Base, arrows: list[Arrow]) -> None:
    up = base.rotation[:, 2]
    camera = Camera(base.ahead, up, np.cross(base.ahead, up))
    drawn = []
    for pose in poses:
        left, right = _outline(pose, base, camera)
        body = np.count_nonzero(~pose.in_cap) + 1
        for part, colour in ((slice(0, body), SILICONE), (slice(body - 1, None), CAP)):
            corners = np.concatenate([left[part], right[part][::-1]])
            axes.add_patch(Polygon(corners, facecolor=colour, alpha=0.5, linewidth=0.0))
            axes.add_patch(Polygon(corners, fill=False, edgecolor="black", linewidth=0.7))
        centre = camera.project(pose.centre - base.position)
        axes.plot(*centre.T, color="black", linewidth=0.7, linestyle=(0, (8, 3, 2, 3)))
        across = np.linspace(0.0, 1.0, 12)[:, None, None]
        drawn.append(((1.0 - across) * left + across * right).reshape(-1, 2))
    last = poses[-1]
    solids = [arrow(a.tail, a.head, 0.09 * last.radius, a.colour, a.heads) for a in arrows]
    if solids:
        faces = Faces.joined(solids)
        faces = faces._replace(corners=faces.corners - base.position)
        paint(axes, camera, faces, camera.up + 0.8 * camera.eye, zorder=3.0)
        drawn.append(camera.project(faces.corners).reshape(-1, 2))
    low = 1.6 * last.radius
    axes.add_patch(
        Rectangle(
            (-low, -0.3 * low), 2.0 * low, 0.3 * low, facecolor="white", edgecolor="black", hatch="////"
        )
    )
    across = np.linspace(-low, low, 24)
    drawn += [np.stack([across, np.full(24, height)], axis=1) for height in (-0.3 * low, -0.15 * low)]
    points = np.concatenate(drawn)
    per_point = _fit(axes, points, _SIDE, bool(arrows))
    shifted = [a._replace(tail=a.tail - base.position, head=a.head - base.position) for a in arrows]
    tips = _tip_labels([pose.moved(-base.position) for pose in poses], camera)
    place_labels(axes, [*tips, *_load_labels(shifted, camera)], points, per_point)
    name = "−x" if last.straight and not base.given else f"in the bending plane, γ = {last.plane_deg}"
    if last.straight and base.given:
        name = "along the base's −x"
    axes.set(xlabel=f"{name} [mm]", ylabel=f"{'along the axis of the base' if base.given else 'z'} [mm]")
    axes.grid(alpha=0.3)
    axes.set_axisbelow(True)


def _fit(axes: Axes, points: np.ndarray, bounds: tuple[float, ...], labelled: bool) -> float:
    """Set limits that hold the points, margins and labels; return the data length of a typographic point."""
    extent = _POINTS_PER_INCH * np.array([bounds[2] * _SIZE[0], bounds[3] * _SIZE[1]])
    low, high = points.min(axis=0), points.max(axis=0)
    space = 2.0 * _MARGIN + (_LABEL_SPACE if labelled else 0.0)
    per_point = float(np.max((high - low) / (extent - space)))
    middle, half = 0.5 * (low + high), 0.5 * per_point * extent
    axes.set(xlim=(middle[0] - half[0], middle[0] + half[0]), ylim=(middle[1] - half[1], middle[1] + half[1]))
    return per_point


def _draw_triad(axes: Axes, camera: Camera, base: _Base, per_point: float) -> np.ndarray:
    """Draw the axes of the base frame and a scale bar; return points that they cover."""
    corner = np.array([axes.get_xlim()[0], axes.get_ylim()[0]])
    origin, length = corner + per_point * np.array([34.0, 40.0]), 24.0 * per_point
    covered = [origin]
    for number, (name, colour) in enumerate(_AXES_COLOURS.items()):
        direction = camera.project(base.rotation[:, number])
        style = {"arrowstyle": "-|>", "color": colour, "lw": 1.3, "shrinkA": 0.0, "shrinkB": 0.0}
        axes.annotate("", xy=tuple(origin + length * direction), xytext=tuple(origin), arrowprops=style)
        end = origin + (length + 7.0 * per_point) * direction
        axes.text(end[0], end[1], name, color=colour, ha="center", va="center", fontsize=9)
        covered += [*np.linspace(origin, end, 8)]
    # 1, 2 or 5 times a power of ten, at most a hundred points long.
    decade = 10.0 ** np.floor(np.log10(100.0 * per_point))
    bar = decade * max(step for step in (1.0, 2.0, 5.0) if step * decade <= 100.0 * per_point)
    start = np.array([axes.get_xlim()[1] - bar - 12.0 * per_point, corner[1] + 14.0 * per_point])
    axes.plot([start[0], start[0] + bar], [start[1]] * 2, color="black", linewidth=2.0, solid_capstyle="butt")
    axes.text(
        start[0] + 0.5 * bar, start[1] + 4.0 * per_point, f"{bar:g} mm", ha="center", va="bottom", fontsize=8
    )
    covered += [*np.linspace(start, start + np.array([bar, 10.0 * per_point]), 12)]
    return np.array(covered)


def _load_labels(arrows: list[Arrow], camera: Camera) -> list[Label]:
    labels = []
    for load in arrows:
        if load.text:
            labels.append(
                Label(camera.project(load.free_end), camera.project(load.outward), load.text, load.colour)
            )
    return labels


def _tip_labels(poses: list[Pose], camera: Camera) -> list[Label]:
    """Return the numbers of several poses as labels; none for a single pose."""
    if len(poses) == 1:
        return []
    return [
        Label(camera.project(pose.centre[-1]), camera.project(pose.frames[-1, :, 2]), str(number), size=10.0)
        for number, pose in enumerate(poses, 1)
    ]


def _outline(pose: Pose, base: _Base, camera: Camera) -> tuple[np.ndarray, np.ndarray]:
    """Return both sides of the tube in the picture, (n, 2) each."""
    centre = camera.project(pose.centre - base.position)
    tangent = np.gradient(centre, axis=0)
    # A tangent towards the eye has length zero in the picture.
    normal = np.stack([-tangent[:, 1], tangent[:, 0]], axis=1)
    normal *= pose.radius / np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-9)
    return centre + normal, centre - normal
