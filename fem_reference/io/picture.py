"""Orthographic drawing of a deformed skin with the thread, normal to a bending plane; see `Units` for mm."""

from typing import NamedTuple

import numpy as np
from jaxtyping import Float, Int
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from matplotlib.colors import to_rgb
from scipy.spatial import cKDTree

SILICONE, THREAD = "#edcc9e", "#1f4e79"
# The thread lies below the skin; the picture lifts it above the skin by this distance [mm].
_LIFT = 0.4
# Width of the drawn thread [mm].
_WIDTH = 0.22
# The thread is moved towards the eye by this distance, because the skin bulges between two turns [mm].
_NEARER = 1.5
# Brightness of faces without light.
_AMBIENT = 0.55


class View(NamedTuple):
    """Orthographic view: unit vectors to the right, up, and towards the eye."""

    right: Float[np.ndarray, "3"]
    up: Float[np.ndarray, "3"]
    eye: Float[np.ndarray, "3"]

    def project(self, points: Float[np.ndarray, "*n 3"]) -> Float[np.ndarray, "*n 2"]:
        """Return points in the picture's coordinates."""
        return np.stack([points @ self.right, points @ self.up], axis=-1)


def across(bending_plane: float) -> View:
    """Return the view normal to the bending plane γ [rad]; the body bends to the right."""
    c, s = np.cos(bending_plane), np.sin(bending_plane)
    return View(np.array([-c, -s, 0.0]), np.array([0.0, 0.0, 1.0]), np.array([-s, c, 0.0]))


def thread_faces(
    points: Float[np.ndarray, "points 3"],
    polylines: list[Int[np.ndarray, " _"]],
    skin: Float[np.ndarray, "faces 4 3"],
    view: View,
) -> Float[np.ndarray, "segments 4 3"]:
    """Return ribbons along the thread that face the eye, just above the skin (normals outward).

    They are also moved towards the eye, which an orthographic view does not show.
    """
    tree, normals = cKDTree(skin.mean(axis=1)), _normals(skin)
    ribbons = [np.empty((0, 4, 3))]
    for line in polylines:
        outward = normals[tree.query(points[line])[1]]
        lifted = points[line] + _LIFT * outward + _NEARER * view.eye
        start, end = lifted[:-1], lifted[1:]
        side = np.cross(view.eye, end - start)
        length = np.linalg.norm(side, axis=1, keepdims=True)
        side = 0.5 * _WIDTH * side / np.maximum(length, 1e-12)
        ribbons.append(np.stack([start - side, end - side, end + side, start + side], axis=1))
    return np.concatenate(ribbons)


def paint(axes: Axes, view: View, bodies: list[tuple[Float[np.ndarray, "_ 4 3"], str]]) -> None:
    """Draw the faces of all bodies that point to the eye, the farthest first.

    Parameters
    ----------
    axes, view : axes to draw on, and the view.
    bodies : faces (counter-clockwise from outside) and colour of each body.
    """
    corners = np.concatenate([faces for faces, _ in bodies])
    colours = np.concatenate([np.tile(to_rgb(colour), (len(faces), 1)) for faces, colour in bodies])
    normals = _normals(corners)
    front = normals @ view.eye > 0.0
    corners, colours, normals = corners[front], colours[front], normals[front]
    light = 0.8 * view.eye + 0.5 * view.up - 0.3 * view.right
    shade = _AMBIENT + (1.0 - _AMBIENT) * np.clip(normals @ light / np.linalg.norm(light), 0.0, 1.0)
    order = np.argsort(corners.mean(axis=1) @ view.eye, kind="stable")
    # Edges in the colour of the faces close the seams that antialiasing leaves.
    axes.add_collection(
        PolyCollection(
            list(view.project(corners)[order]),
            facecolors=(shade[:, None] * colours)[order],
            edgecolors="face",
            linewidths=0.2,
        )
    )


def _normals(faces: Float[np.ndarray, "n 4 3"]) -> Float[np.ndarray, "n 3"]:
    normals = np.cross(faces[:, 2] - faces[:, 0], faces[:, 3] - faces[:, 1])
    return np.asarray(normals / np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-300))
