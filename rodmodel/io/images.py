"""Images of a section's state (u, p) under its symmetry, in NumPy."""

import math

import numpy as np

#: Mirror y → −y of curvatures.
MIRROR = np.diag([-1.0, 1.0, -1.0])
#: Order of the chambers in the mirror.
SWAPPED = np.array([0, 2, 1])
#: Sign and turn [rad] of the images of the full symmetry: an image has the orientation sign · (ψ − turn).
SIGNS, TURNS = np.repeat([1.0, -1.0], 3), np.tile(np.arange(3), 2) * (2.0 * math.pi / 3.0)

# Cosines and sines of 0, 120° and 240°, exact to the last digit.
_COSINES = (1.0, -0.5, -0.5)
_SINES = (0.0, math.sqrt(0.75), -math.sqrt(0.75))


def turn_matrix(turns: int) -> np.ndarray:
    """Return R_z(−120° turns), which maps components into axes turned by 120° · `turns`."""
    c, s = _COSINES[turns], _SINES[turns]
    return np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]])


def images_of(symmetry: str) -> list[tuple[np.ndarray, np.ndarray]]:
    """Return U and order of each image (U u, p[order]) of a state at which the potential is the same."""
    turned = [(turn_matrix(turns), np.roll(np.arange(3), -turns)) for turns in range(3)]
    if symmetry == "none":
        return turned[:1]
    if symmetry == "mirror":
        return [turned[0], (MIRROR, SWAPPED)]
    return [*turned, *((MIRROR @ turn, order[SWAPPED]) for turn, order in turned)]


def placed_images(symmetry: str, turns: int, mirrored: bool) -> list[tuple[np.ndarray, np.ndarray]]:
    """Return the images, under the law's symmetry, of a state of a section mirrored and then turned.

    Parameters
    ----------
    symmetry : symmetry of the law.
    turns : turn of the section's winding from the law's, in units of 120°.
    mirrored : whether the section is the mirror image y → −y of the law's, before the turn.
    """
    # The law is evaluated at Q u and p[order].
    into_law, order = np.eye(3), np.arange(3)
    if mirrored:
        into_law, order = MIRROR, SWAPPED
    into_law, order = into_law @ turn_matrix(turns), (order + turns) % 3
    return [(axes @ into_law, order[chambers]) for axes, chambers in images_of(symmetry)]


def biases_at(biases: np.ndarray, orientation_weights: np.ndarray, psi: float) -> np.ndarray:
    """Return the biases of the six images of a law of all orientations at ψ [rad], (6, features)."""
    twice = 2.0 * SIGNS * (psi - TURNS)
    return np.asarray(biases + np.stack([np.cos(twice), np.sin(twice)], axis=1) @ orientation_weights.T)


def symmetric(triangle: np.ndarray) -> np.ndarray:
    """Return the symmetric matrix with this lower triangle, given by rows."""
    lower = np.zeros((3, 3))
    lower[np.tril_indices(3)] = triangle
    return lower + np.tril(lower, -1).T
