"""Jacobi's rotations on many matrices: round-off, whatever the eigenvalues."""

import jax
import numpy as np
import pytest

from fem_reference.materials.eigen3 import symmetric_eigen
from tests.fem_fixtures import TURN, points_first, points_last

EPS = np.finfo(float).eps


def with_eigenvalues(values: np.ndarray) -> np.ndarray:
    """Matrices Q diag(values) Qᵀ for random rotations Q."""
    Q, _ = np.linalg.qr(np.random.default_rng(0).standard_normal((*values.shape, 3)))
    return Q * values[..., None, :] @ np.swapaxes(Q, -1, -2)


def decomposed(matrix: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    values, vectors = jax.jit(symmetric_eigen)(points_last(matrix, 2))
    return points_first(values, 1), points_first(vectors, 2)


CASES = {
    "stretches of a soft body": np.random.default_rng(1).uniform(0.2, 5.0, (500, 3)),
    "two nearly equal": np.tile([1.0, 1.0 + 1e-9, 2.0], (500, 1)),
    "all nearly equal": 1.0 + 1e-9 * np.random.default_rng(2).standard_normal((500, 3)),
    "of very different size": np.tile([1e-6, 1.0, 1e6], (500, 1)),
    "all equal": np.ones((500, 3)),
}


@pytest.mark.parametrize("values", CASES.values(), ids=CASES.keys())
def test_the_decomposition_gives_the_matrix_back(values):
    matrix = with_eigenvalues(values)
    matrix = 0.5 * (matrix + np.swapaxes(matrix, -1, -2))
    found, vectors = decomposed(matrix)
    size = np.abs(values).max(axis=1)[:, None]
    # A dozen rotations, each of a few roundings.
    np.testing.assert_array_less(
        np.abs(vectors * found[:, None, :] @ np.swapaxes(vectors, 1, 2) - matrix).max(axis=(1, 2)),
        50.0 * EPS * size[:, 0],
    )
    assert np.abs(np.swapaxes(vectors, 1, 2) @ vectors - np.eye(3)).max() <= 20.0 * EPS
    # Errors of eigenvalues are those of the matrix (Weyl).
    assert (np.abs(np.sort(found, axis=1) - np.sort(values, axis=1)) / size).max() <= 50.0 * EPS


def test_diagonal_matrices_are_left_alone_and_axes_kept():
    values, vectors = decomposed(np.array([np.zeros((3, 3)), np.diag([3.0, 1.0, 2.0])]))
    np.testing.assert_array_equal(values, [[0.0, 0.0, 0.0], [3.0, 1.0, 2.0]])
    np.testing.assert_array_equal(vectors, [np.eye(3), np.eye(3)])


def test_any_batch_shape_will_do():
    matrix = TURN @ np.diag([1.0, 2.0, 3.0]) @ TURN.T
    single, _ = decomposed(matrix)
    batch, vectors = decomposed(np.broadcast_to(matrix, (2, 4, 3, 3)))
    np.testing.assert_array_equal(batch, np.broadcast_to(single, (2, 4, 3)))
    assert vectors.shape == (2, 4, 3, 3)
