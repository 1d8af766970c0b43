"""Assembly into the upper triangle gives the same matrix as adding blocks one by one."""

import numpy as np
import pytest
from scipy import sparse

from fem_reference.algebra import SparsePattern

SIZE = 9
# Blocks that share unknowns, and one that holds the same unknown twice, as a thread within one element does.
PAIRS = np.array([[0, 1, 4], [4, 1, 7], [2, 2, 0]])
SINGLES = np.array([[3], [7]])
GROUPS = {"pairs": PAIRS, "singles": SINGLES}
ROWS, COLUMNS = np.array([0, 5, 6]), np.array([8, 6, 5])


def blocks(count: int, size: int, seed: int) -> np.ndarray:
    random = np.random.default_rng(seed).uniform(-1.0, 1.0, (count, size, size))
    return random + np.swapaxes(random, 1, 2)


@pytest.fixture
def pattern() -> SparsePattern:
    return SparsePattern(SIZE, GROUPS, (ROWS, COLUMNS))


def added_one_by_one(dofs: np.ndarray, local: np.ndarray) -> np.ndarray:
    matrix = np.zeros((SIZE, SIZE))
    for block, values in zip(dofs, local, strict=True):
        for i, a in enumerate(block):
            for j, b in enumerate(block):
                matrix[a, b] += values[i, j]
    return matrix


def test_groups_add_up(pattern):
    data = np.zeros(len(pattern))
    expected = np.zeros((SIZE, SIZE))
    for seed, (name, dofs) in enumerate(GROUPS.items()):
        local = blocks(len(dofs), dofs.shape[1], seed)
        pattern.add_group(data, name, local)
        expected += added_one_by_one(dofs, local)
    np.testing.assert_allclose(pattern.matrix(data).toarray(), np.triu(expected), rtol=0, atol=1e-15)


def test_the_matrix_is_an_upper_triangle_with_all_of_its_diagonal(pattern):
    matrix = pattern.matrix(np.ones(len(pattern)))
    assert sparse.tril(matrix, -1).nnz == 0
    np.testing.assert_array_equal(matrix.diagonal(), 1.0)
    assert matrix.has_sorted_indices
    data = np.zeros(len(pattern))
    data[pattern.diagonal] = np.arange(SIZE)
    np.testing.assert_array_equal(pattern.matrix(data).toarray(), np.diag(np.arange(SIZE)))


def test_single_entries_add_up(pattern):
    data = np.zeros(len(pattern))
    pattern.add_entries(data, np.array([0, 5, 0]), np.array([8, 6, 8]), np.array([1.0, 2.0, 0.5]))
    matrix = pattern.matrix(data).toarray()
    assert matrix[0, 8] == 1.5
    assert matrix[5, 6] == 2.0
    assert np.count_nonzero(matrix) == 2


def a_group_and_an_entry_add_up(pattern: SparsePattern, row: int, column: int) -> None:
    data = np.zeros(len(pattern))
    local = blocks(len(PAIRS), 3, 0)
    pattern.add_group(data, "pairs", local)
    pattern.add_entries(data, np.array([row]), np.array([column]), np.array([4.0]))
    expected = np.triu(added_one_by_one(PAIRS, local))
    expected[row, column] += 4.0
    np.testing.assert_allclose(pattern.matrix(data).toarray(), expected, rtol=0, atol=1e-15)


def test_the_pattern_grows_by_what_it_lacks_and_keeps_its_groups(pattern):
    before, revision = len(pattern), pattern.revision
    pattern.extend(np.array([0, 5]), np.array([8, 6]))
    assert (len(pattern), pattern.revision) == (before, revision)
    pattern.extend(np.array([0, 3, 3]), np.array([8, 8, 8]))
    assert len(pattern) == before + 1
    assert pattern.revision != revision
    a_group_and_an_entry_add_up(pattern, 3, 8)


def test_a_pattern_covers_what_is_asked_for_with_what_may_follow_and_drops_the_rest(pattern):
    own, none = len(pattern), np.zeros(0, int)
    pattern.cover(np.array([3]), np.array([8]), lambda: (np.array([1]), np.array([8])))
    assert len(pattern) == own + 2
    revision = pattern.revision
    # Both are there: nothing changes.
    pattern.cover(np.array([1]), np.array([8]), lambda: pytest.fail("nothing is lacking"))
    assert pattern.revision == revision
    pattern.cover(np.array([2]), np.array([8]), lambda: (none, none))
    assert len(pattern) == own + 1
    assert pattern.revision != revision
    a_group_and_an_entry_add_up(pattern, 2, 8)
