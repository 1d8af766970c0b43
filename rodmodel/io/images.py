"""Images of a section's state under its symmetry, in NumPy."""

import math

import numpy as np

_THIRD = 2.0 * math.pi / 3.0
_MIRROR = np.diag([-1.0, 1.0, -1.0])  # of curvatures, y → −y
_SWAPPED = np.array([0, 2, 1])  # chambers in the mirror

#: Of the images of the full symmetry, whose ψ is sign · (ψ − turn): sign and turn [rad].
SIGNS, TURNS = np.repeat([1.0, -1.0], 3), np.tile(np.arange(3), 2) * _THIRD


def turn_matrix(turns: int) -> np.ndarray:
    """Components in axes turned by 120° · `turns` from those in the given axes, R_z(−120° turns)."""
    angle = turns * _THIRD
    c, s = math.cos(angle), math.sin(angle)
    return np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]])


def images_of(symmetry: str) -> list[tuple[np.ndarray, np.ndarray]]:
    """Images (U u, p[order]) of a state at which the potential is the same: each U and order."""
    turned = [(turn_matrix(turns), np.roll(np.arange(3), -turns)) for turns in range(3)]
    if symmetry == "none":
        return turned[:1]
    if symmetry == "mirror":
        return [turned[0], (_MIRROR, _SWAPPED)]
    return [*turned, *((_MIRROR @ turn, order[_SWAPPED]) for turn, order in turned)]


def placed_images(symmetry: str, turns: int, mirrored: bool) -> list[tuple[np.ndarray, np.ndarray]]:
    """Images of a state of the section that is that of a law in a mirror, y → −y, and then turned.

    Parameters
    ----------
    symmetry : of the law.
    turns : by how many times 120° the section's winding lies further round than the law's.
    mirrored : whether it is the mirror image of the law's, before that turn.
    """
    # What comes before the law: Q u, and the order in which it sees the pressures.
    seen, order = np.eye(3), np.arange(3)
    if mirrored:
        seen, order = _MIRROR, _SWAPPED
    seen, order = seen @ turn_matrix(turns), (order + turns) % 3
    return [(axes @ seen, order[chambers]) for axes, chambers in images_of(symmetry)]


def biases_at(biases: np.ndarray, orientation_weights: np.ndarray, psi: float) -> np.ndarray:
    """Biases w of each of six images, (6, features), of a law of all orientations at one, ψ [rad]."""
    twice = 2.0 * SIGNS * (psi - TURNS)
    return np.asarray(biases + np.stack([np.cos(twice), np.sin(twice)], axis=1) @ orientation_weights.T)


def symmetric(triangle: np.ndarray) -> np.ndarray:
    """Symmetric matrix of its lower triangle by rows."""
    lower = np.zeros((3, 3))
    lower[np.tril_indices(3)] = triangle
    return lower + np.tril(lower, -1).T
