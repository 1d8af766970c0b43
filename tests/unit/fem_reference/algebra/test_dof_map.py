"""Numbers of unknowns: what is held has none, and images move as mirror images."""

import numpy as np
import pytest
import scipy.sparse as sparse

from fem_reference.algebra import DofMap
from fem_reference.mesh import mirror_images

# One point in the plane y = 0, a pair of images, and one more in the plane, which is clamped.
POINTS = np.array([[0.0, 0.0, 1.0], [1.0, 2.0, 0.5], [1.0, -2.0, 0.5], [2.0, 0.0, 0.0]])
IMAGE = np.array([0, 2, 1, 3])


@pytest.fixture
def held() -> np.ndarray:
    held = np.zeros((4, 3), bool)
    held[3] = True
    return held


def test_what_is_held_has_no_unknown(held):
    unknowns = DofMap.but_for(held)
    assert unknowns.size == 9
    np.testing.assert_array_equal(unknowns.held, held)
    moved = (unknowns.fold.T @ np.arange(1.0, 10.0)).reshape(-1, 3)
    np.testing.assert_array_equal(moved[:3].ravel(), np.arange(1.0, 10.0))
    np.testing.assert_array_equal(moved[3], 0.0)


def test_unknowns_move_their_points_of_images_the_first(held):
    np.testing.assert_array_equal(DofMap.but_for(held).points, [0, 0, 0, 1, 1, 1, 2, 2, 2])
    np.testing.assert_array_equal(DofMap.mirrored(held, IMAGE).points, [0, 0, 1, 1, 1])


def test_each_point_has_its_image():
    np.testing.assert_array_equal(mirror_images(POINTS), IMAGE)


def test_images_move_as_mirror_images_and_the_plane_stays_plane(held):
    unknowns = DofMap.mirrored(held, IMAGE)
    # Two of the point in the plane, and three that the pair shares.
    assert unknowns.size == 5
    moved = (unknowns.fold.T @ np.arange(1.0, 6.0)).reshape(-1, 3)
    assert moved[0, 1] == 0.0
    np.testing.assert_array_equal(moved[2], moved[1] * [1.0, -1.0, 1.0])


@pytest.mark.parametrize("mirrored", [False, True])
def test_entries_are_the_matrix_along_what_the_unknowns_move(held, mirrored):
    unknowns = DofMap.mirrored(held, IMAGE) if mirrored else DofMap.but_for(held)
    square = np.random.default_rng(0).normal(size=(12, 12))
    matrix = sparse.csr_matrix(square + square.T)
    rows, columns, values = unknowns.entries(matrix)
    assert (rows <= columns).all()
    upper = sparse.coo_matrix((values, (rows, columns)), shape=(unknowns.size,) * 2).toarray()
    whole = (unknowns.fold @ matrix @ unknowns.fold.T).toarray()
    np.testing.assert_allclose(upper, np.triu(whole), atol=1e-12)


def test_blocks_get_unknowns_and_signs_of_all_their_components(held):
    unknowns = DofMap.mirrored(held, IMAGE)
    dofs, signs = unknowns.of(np.array([[1, 2], [3, 0]]))
    np.testing.assert_array_equal(dofs[0, :3], dofs[0, 3:])
    np.testing.assert_array_equal(signs[0], [1.0, 1.0, 1.0, 1.0, -1.0, 1.0])
    assert (dofs[1, :3] == -1).all()
    none, _ = unknowns.of(np.empty((0, 2), int))
    assert none.shape == (0, 6)
