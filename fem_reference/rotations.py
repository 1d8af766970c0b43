"""Cross products and rotations."""

import numpy as np
from jaxtyping import Float

#: Levi-Civita symbol ε_ijk: a·(b × c) = ε_ijk a_i b_j c_k.
LEVI_CIVITA = np.zeros((3, 3, 3))
LEVI_CIVITA[[0, 1, 2], [1, 2, 0], [2, 0, 1]] = 1.0
LEVI_CIVITA[[1, 2, 0], [0, 1, 2], [2, 0, 1]] = -1.0


def cross_matrix(a: Float[np.ndarray, "3"]) -> Float[np.ndarray, "3 3"]:
    """Return the matrix of b ↦ a × b."""
    return np.array([[0.0, -a[2], a[1]], [a[2], 0.0, -a[0]], [-a[1], a[0], 0.0]])


def nearest_rotation(matrix: Float[np.ndarray, "3 3"]) -> Float[np.ndarray, "3 3"]:
    """Return the rotation R that maximises tr(Rᵀ A)."""
    left, _, right = np.linalg.svd(matrix)
    left[:, -1] *= np.sign(np.linalg.det(left @ right))
    rotation: Float[np.ndarray, "3 3"] = left @ right
    return rotation
