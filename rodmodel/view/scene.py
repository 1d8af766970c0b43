"""Solid bodies in an orthographic picture: shaded front faces, drawn from the farthest (painter's algorithm).

One collection holds the faces of all bodies, so that they hide each other correctly. This needs small faces
and bodies that do not intersect. Lengths in mm.
"""

from collections.abc import Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from matplotlib.colors import to_rgb

# Faces around a bar, an arrow or a disc.
_AROUND = 16
# Brightness of a face that the light does not reach.
_AMBIENT = 0.62


class Camera(NamedTuple):
    """Orthographic view: unit vectors to the right, up, and towards the eye."""

    right: np.ndarray
    up: np.ndarray
    eye: np.ndarray

    @staticmethod
    def towards(eye: Sequence[float] | np.ndarray, up: Sequence[float] | np.ndarray) -> "Camera":
        """Return the camera that looks from `eye`, with `up` upright in the picture."""
        back = np.asarray(eye, float) / np.linalg.norm(eye)
        right = np.cross(np.asarray(up, float), back)
        right /= np.linalg.norm(right)
        return Camera(right, np.cross(back, right), back)

    def project(self, points: np.ndarray) -> np.ndarray:
        """Return coordinates in the picture, (..., 2), of points, (..., 3)."""
        return np.stack([points @ self.right, points @ self.up], axis=-1)


class Faces(NamedTuple):
    """Quadrilaterals (n, 4, 3), counter-clockwise from outside, and their colours (n, 3)."""

    corners: np.ndarray
    colours: np.ndarray

    @staticmethod
    def joined(parts: list["Faces"]) -> "Faces":
        """Return the faces of several bodies together."""
        return Faces(np.concatenate([p.corners for p in parts]), np.concatenate([p.colours for p in parts]))


def tube(centre: np.ndarray, frames: np.ndarray, radius: float | np.ndarray, colours: np.ndarray) -> Faces:
    """Return a tube along a curve, and the disc at its end.

    Parameters
    ----------
    centre, frames : stations (n, 3), and frames (n, 3, 3), directors as columns, the third along the tube.
    radius : radius of the tube, one or one per station [mm].
    colours : colours of the faces between stations and around, (n − 1, around, 3).
    """
    around = colours.shape[1]
    azimuth = np.linspace(0.0, 2.0 * np.pi, around + 1)
    ring = np.stack([np.cos(azimuth), np.sin(azimuth)], axis=1)
    outward = np.einsum("nij,kj->nki", frames[:, :, :2], ring)
    skin = centre[:, None] + np.broadcast_to(radius, len(centre))[:, None, None] * outward
    sides = np.stack([skin[:-1, :-1], skin[:-1, 1:], skin[1:, 1:], skin[1:, :-1]], axis=2)
    middle = np.repeat(centre[-1:], around, axis=0)
    end = np.stack([skin[-1, :-1], skin[-1, 1:], middle, middle], axis=1)
    return Faces(
        np.concatenate([sides.reshape(-1, 4, 3), end]),
        np.concatenate([np.reshape(colours, (-1, 3)), colours[-1]]),
    )


def rod(points: np.ndarray, radius: float, colour: str) -> Faces:
    """Return a thin round bar along a curve, (n, 3)."""
    frames = np.stack([frame_along(tangent) for tangent in np.gradient(points, axis=0)])
    return tube(points, frames, radius, _plain(len(points), colour))


def arrow(tail: np.ndarray, head: np.ndarray, radius: float, colour: str, heads: int = 1) -> Faces:
    """Return an arrow with a round shaft and one or two heads, one behind the other."""
    axis = head - tail
    length = float(np.linalg.norm(axis))
    point = min(5.0 * radius, 0.45 * length / heads)
    shaft = np.linspace(0.0, length - heads * point, 8)
    stations, radii = [*shaft], [radius] * len(shaft)
    for cone in range(heads):
        start = length - (heads - cone) * point
        stations += [*np.linspace(start, start + point, 5)]
        radii += [*np.linspace(2.6 * radius, 0.02 * radius, 5)]
    centre = tail + np.array(stations)[:, None] * axis / length
    frames = np.repeat(frame_along(axis)[None], len(centre), axis=0)
    sides = tube(centre, frames, np.array(radii), _plain(len(centre), colour))
    return Faces.joined([sides, disc(tail, -axis, radius, colour)])


def disc(centre: np.ndarray, normal: np.ndarray, radius: float, colour: str) -> Faces:
    """Return a round disc that faces along its normal."""
    azimuth = np.linspace(0.0, 2.0 * np.pi, _AROUND + 1)
    frame = frame_along(normal)
    ring = centre + radius * (np.cos(azimuth)[:, None] * frame[:, 0] + np.sin(azimuth)[:, None] * frame[:, 1])
    middle = np.repeat(centre[None], _AROUND, axis=0)
    return Faces(
        np.stack([ring[:-1], ring[1:], middle, middle], axis=1), np.tile(to_rgb(colour), (_AROUND, 1))
    )


def plate(centre: np.ndarray, frame: np.ndarray, radii: tuple[float, float], colour: str) -> Faces:
    """Return a ring-shaped plate behind `centre`, normal to the frame's third director, as a clamp."""
    inner, outer = radii
    depth = 0.3 * outer * frame[:, 2]
    azimuth = np.linspace(0.0, 2.0 * np.pi, 4 * _AROUND + 1)
    ring = np.cos(azimuth)[:, None] * frame[:, 0] + np.sin(azimuth)[:, None] * frame[:, 1]
    loops = [centre + radius * ring for radius in np.linspace(inner, outer, 5)]
    loops.append(loops[-1] - depth)
    loops += [centre - depth + radius * ring for radius in np.linspace(outer, 0.0, 7)[1:]]
    quads = [
        np.stack([after[1:], after[:-1], before[:-1], before[1:]], axis=1)[:, ::-1]
        for before, after in pairwise(loops)
    ]
    corners = np.concatenate(quads)
    return Faces(corners, np.tile(to_rgb(colour), (len(corners), 1)))


def paint(axes: Axes, camera: Camera, faces: Faces, light: np.ndarray, zorder: float = 2.0) -> None:
    """Draw the faces that the camera sees."""
    corners, colours = faces
    normal = np.cross(corners[:, 2] - corners[:, 0], corners[:, 3] - corners[:, 1])
    size = np.linalg.norm(normal, axis=1)
    good = size > 0.0
    normal = normal[good] / size[good, None]
    front = normal @ camera.eye > 0.0
    corners, colours, normal = corners[good][front], colours[good][front], normal[front]
    towards = light / np.linalg.norm(light)
    shaded = colours * (_AMBIENT + (1.0 - _AMBIENT) * np.clip(normal @ towards, 0.0, 1.0))[:, None]
    order = np.argsort(corners.mean(axis=1) @ camera.eye, kind="stable")
    # Edges of the faces' own colour close the seams that antialiasing leaves.
    axes.add_collection(
        PolyCollection(
            list(camera.project(corners)[order]),
            facecolors=shaded[order],
            edgecolors="face",
            linewidths=0.3,
            zorder=zorder,
        )
    )


def frame_along(axis: np.ndarray) -> np.ndarray:
    """Return a frame, directors as columns, whose third director is along `axis`."""
    third = axis / np.linalg.norm(axis)
    first = np.cross(np.eye(3)[np.argmin(np.abs(third))], third)
    first /= np.linalg.norm(first)
    return np.stack([first, np.cross(third, first), third], axis=1)


def _plain(stations: int, colour: str) -> np.ndarray:
    return np.tile(to_rgb(colour), (stations - 1, _AROUND, 1))
