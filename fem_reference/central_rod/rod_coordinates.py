"""Deformations of the actuator in rod coordinates, and their means.

Sections of a bending slender body move nearly rigidly. A mean of two deformations in Cartesian coordinates
strains thread and rod by the square of the rotation between them, and lifts walls that slide around the rod
off it. A mean in rod coordinates does not: it averages the relative rotations and distances of neighbouring
stations of the rod, and the nodes' cylindrical coordinates in the frames there.
"""

import numpy as np
from jaxtyping import Float, Int
from scipy.spatial.transform import Rotation

from fem_reference.central_rod.spline_rod import SplineBasis


class CoreCoordinates:
    """Coordinates of all points in twist-free frames along the rod.

    Parameters
    ----------
    basis : spline basis of the rod's curve.
    stations : reference z of every mesh node [mm].
    """

    def __init__(self, basis: SplineBasis, stations: Float[np.ndarray, " nodes"]) -> None:
        self._basis = basis
        both = np.round(np.concatenate([stations, basis.greville]), 9)
        levels, index = np.unique(both, return_inverse=True)
        self._level, self._greville = np.split(index, [len(stations)])
        self._stations = stations
        self._value, self._slope = basis.values(levels), basis.values(levels, 1)
        self._fit = np.linalg.inv(basis.values(basis.greville))

    def frames(
        self, controls: Float[np.ndarray, "controls 3"]
    ) -> tuple[Float[np.ndarray, "levels 3"], Float[np.ndarray, "levels 3 3"]]:
        """Return points of the curve at all levels, and the twist-free frames there."""
        centre, tangent = self._value @ controls, self._slope @ controls
        tangent /= np.linalg.norm(tangent, axis=1)[:, None]
        axis = np.cross(tangent[:-1], tangent[1:])
        sine = np.linalg.norm(axis, axis=1)
        angle = np.arctan2(sine, np.einsum("ni,ni->n", tangent[:-1], tangent[1:]))
        turns = Rotation.from_rotvec(axis * (angle / np.maximum(sine, 1e-300))[:, None]).as_matrix()
        frames = np.empty((len(centre), 3, 3))
        frames[0] = np.eye(3)
        for i, turn in enumerate(turns):
            frames[i + 1] = turn @ frames[i]
        return centre, frames

    def straightened(self, positions: Float[np.ndarray, "points 3"]) -> Float[np.ndarray, "nodes 3"]:
        """Return the nodes without the rod's bending and stretch: its curve lies on the z axis."""
        nodes = len(self._level)
        centre, frames = self.frames(positions[nodes:])
        local = np.einsum("nji,nj->ni", frames[self._level], positions[:nodes] - centre[self._level])
        local[:, 2] += self._stations
        return local

    def keep_core_apart(
        self,
        positions: Float[np.ndarray, "points 3"],
        nodes: Int[np.ndarray, " some"],
        least: Float[np.ndarray, " some"],
    ) -> Float[np.ndarray, "some 3"]:
        """Return displacements that bring nodes to at least the distance ``least`` from the rod's curve."""
        across, frames = self._across(positions, nodes)
        radius = np.linalg.norm(across, axis=1)
        outwards = np.maximum(least / radius - 1.0, 0.0)[:, None] * across
        moved: np.ndarray = np.einsum("nij,nj->ni", frames[:, :, :2], outwards)
        return moved

    def distance(
        self, positions: Float[np.ndarray, "points 3"], nodes: Int[np.ndarray, " some"]
    ) -> Float[np.ndarray, " some"]:
        """Return the nodes' distances from the rod's curve in their sections [mm]."""
        across, _ = self._across(positions, nodes)
        distance: np.ndarray = np.linalg.norm(across, axis=1)
        return distance

    def _across(
        self, positions: Float[np.ndarray, "points 3"], nodes: Int[np.ndarray, " some"]
    ) -> tuple[Float[np.ndarray, "some 2"], Float[np.ndarray, "some 3 3"]]:
        """Return nodes' coordinates across the rod in the frames of their sections, and these frames."""
        centre, frames = self.frames(positions[len(self._level) :])
        level = self._level[nodes]
        local = np.einsum("nji,nj->ni", frames[level], positions[nodes] - centre[level])
        return local[:, :2], frames[level]

    def mean(
        self, positions: list[Float[np.ndarray, "points 3"]], weights: list[float]
    ) -> Float[np.ndarray, "points 3"]:
        """Return the weighted mean of deformations; weights add up to one, negative ones extrapolate."""
        nodes = len(self._level)
        turn, distance, local = np.zeros(()), np.zeros(()), []
        for x, weight in zip(positions, weights, strict=True):
            centre, frames = self.frames(x[nodes:])
            between = np.swapaxes(frames[:-1], 1, 2) @ frames[1:]
            turn = turn + weight * Rotation.from_matrix(between).as_rotvec()
            distance = distance + weight * np.einsum("nji,nj->ni", frames[:-1], np.diff(centre, axis=0))
            arms = x[:nodes] - centre[self._level]
            local.append(np.einsum("nji,nj->ni", frames[self._level], arms))
        between = Rotation.from_rotvec(turn).as_matrix()
        frames, centre = np.empty((len(between) + 1, 3, 3)), np.zeros((len(between) + 1, 3))
        frames[0] = np.eye(3)
        for i, rotation in enumerate(between):
            centre[i + 1] = centre[i] + frames[i] @ distance[i]
            frames[i + 1] = frames[i] @ rotation
        moved = centre[self._level] + np.einsum(
            "nij,nj->ni", frames[self._level], _mean_around(local, weights)
        )
        return np.concatenate([moved, self._fit @ centre[self._greville]])


def _mean_around(
    places: list[Float[np.ndarray, "nodes 3"]], weights: list[float]
) -> Float[np.ndarray, "nodes 3"]:
    """Return the weighted mean of positions in cylindrical coordinates about the z axis.

    A wall that slides around the rod keeps its distance. A mean of Cartesian coordinates would lift it off
    the rod, or press it on, by the square of the angle: 5 µm for a slip of 0.1 mm, or 0.6 MPa of contact
    pressure.
    """
    across = [place[:, 0] + 1j * place[:, 1] for place in places]

    def mean(values: list[np.ndarray]) -> np.ndarray:
        return np.sum([weight * value for weight, value in zip(weights, values, strict=True)], axis=0)

    # Angles relative to the first position avoid the branch cut at a half turn.
    turned = mean([np.angle(other * across[0].conj()) for other in across])
    found = mean([np.abs(other) for other in across]) * np.exp(1j * (np.angle(across[0]) + turned))
    return np.column_stack([found.real, found.imag, mean([place[:, 2] for place in places])])
