"""Solid bodies in an orthographic picture: faces turned to the eye, shaded, the farthest drawn first.

One collection holds the faces of all bodies, so that they hide each other rightly. That needs small faces and
bodies that do not run through each other. Lengths in mm.
"""

from collections.abc import Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from matplotlib.colors import to_rgb

_AROUND = 16
_AMBIENT = 0.62


class Camera(NamedTuple):
    """Orthographic view: unit vectors to the right, up, and towards the eye."""

    right: np.ndarray
    up: np.ndarray
    eye: np.ndarray

    @staticmethod
    def towards(eye: Sequence[float] | np.ndarray, up: Sequence[float] | np.ndarray) -> "Camera":
        """View from a direction, with another one upright."""
        back = np.asarray(eye, float) / np.linalg.norm(eye)
        right = np.cross(np.asarray(up, float), back)
        right /= np.linalg.norm(right)
        return Camera(right, np.cross(back, right), back)

    def seen(self, points: np.ndarray) -> np.ndarray:
        """Place in the picture, (..., 2), of points (..., 3)."""
        return np.stack([points @ self.right, points @ self.up], axis=-1)


class Faces(NamedTuple):
    """Quadrilaterals (n, 4, 3), counter-clockwise from outside, and their colours (n, 3)."""

    corners: np.ndarray
    colours: np.ndarray

    @staticmethod
    def joined(parts: list["Faces"]) -> "Faces":
        """The faces of several bodies."""
        return Faces(np.concatenate([p.corners for p in parts]), np.concatenate([p.colours for p in parts]))


def tube(centre: np.ndarray, frames: np.ndarray, radius: float | np.ndarray, colours: np.ndarray) -> Faces:
    """Skin about a curve, and the disc at its end.

    Parameters
    ----------
    centre, frames : stations (n, 3), and frames (n, 3, 3), directors as columns, the third along the tube.
    radius : of the tube, or at each station [mm].
    colours : of the faces from station to station and around, (n − 1, around, 3).
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
    """Thin round bar along a curve (n, 3)."""
    frames = np.stack([frame_along(way) for way in np.gradient(points, axis=0)])
    return tube(points, frames, radius, _plain(len(points), colour))


def arrow(tail: np.ndarray, head: np.ndarray, radius: float, colour: str, heads: int = 1) -> Faces:
    """Arrow with round shaft; two heads, one behind the other, for a moment."""
    way = head - tail
    length = float(np.linalg.norm(way))
    point = min(5.0 * radius, 0.45 * length / heads)
    shaft = np.linspace(0.0, length - heads * point, 8)
    places, radii = [*shaft], [radius] * len(shaft)
    for cone in range(heads):
        start = length - (heads - cone) * point
        places += [*np.linspace(start, start + point, 5)]
        radii += [*np.linspace(2.6 * radius, 0.02 * radius, 5)]
    centre = tail + np.array(places)[:, None] * way / length
    frames = np.repeat(frame_along(way)[None], len(centre), axis=0)
    sides = tube(centre, frames, np.array(radii), _plain(len(centre), colour))
    return Faces.joined([sides, disc(tail, -way, radius, colour)])


def disc(centre: np.ndarray, normal: np.ndarray, radius: float, colour: str) -> Faces:
    """Round disc, seen from where its normal points."""
    azimuth = np.linspace(0.0, 2.0 * np.pi, _AROUND + 1)
    frame = frame_along(normal)
    ring = centre + radius * (np.cos(azimuth)[:, None] * frame[:, 0] + np.sin(azimuth)[:, None] * frame[:, 1])
    middle = np.repeat(centre[None], _AROUND, axis=0)
    return Faces(
        np.stack([ring[:-1], ring[1:], middle, middle], axis=1), np.tile(to_rgb(colour), (_AROUND, 1))
    )


def plate(centre: np.ndarray, frame: np.ndarray, radii: tuple[float, float], colour: str) -> Faces:
    """Ring-shaped plate behind `centre`, square to the frame's third director; for a clamp."""
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
    """Draw faces as the eye sees them."""
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
            list(camera.seen(corners)[order]),
            facecolors=shaded[order],
            edgecolors="face",
            linewidths=0.3,
            zorder=zorder,
        )
    )


def frame_along(way: np.ndarray) -> np.ndarray:
    """Some frame, directors as columns, whose third director is along `way`."""
    third = way / np.linalg.norm(way)
    first = np.cross(np.eye(3)[np.argmin(np.abs(third))], third)
    first /= np.linalg.norm(first)
    return np.stack([first, np.cross(third, first), third], axis=1)


def _plain(stations: int, colour: str) -> np.ndarray:
    return np.tile(to_rgb(colour), (stations - 1, _AROUND, 1))
