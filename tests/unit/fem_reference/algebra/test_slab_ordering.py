"""Elimination of a slender body by slabs: cuts are the fewest points, and the work grows with the length."""

import itertools

import numpy as np
import pytest
import scipy.sparse as sparse

from fem_reference.algebra import SlabOrdering
from fem_reference.algebra.factorisation import PardisoSolver, nested_dissection_order
from fem_reference.algebra.slab_ordering import _cover

SIDE = 4


def bar(levels: int, reach: tuple[float, float] | None = None) -> tuple[sparse.csr_matrix, np.ndarray]:
    """Couplings of neighbours in a slender grid, diagonals among them; and the points' heights, shuffled.

    ``reach``: one more point, coupled to the outermost corners of levels between these heights.
    """
    line = [sparse.diags([np.ones(n - abs(k)) for k in (-1, 0, 1)], [-1, 0, 1]) for n in (SIDE, levels)]
    coupled = sparse.kron(line[1], sparse.kron(line[0], line[0]))
    height = np.repeat(np.arange(levels, dtype=float), SIDE**2)
    if reach is not None:
        corners = np.zeros((1, len(height)))
        corners[0, :: SIDE**2] = (height[:: SIDE**2] >= reach[0]) & (height[:: SIDE**2] <= reach[1])
        coupled = sparse.bmat([[coupled, corners.T], [corners, np.ones((1, 1))]])
        height = np.append(height, reach[0])
    order = np.random.default_rng(5).permutation(len(height))
    return coupled.tocsr()[order][:, order], height[order]


def with_components(coupled: sparse.csr_matrix) -> tuple[sparse.csr_matrix, np.ndarray]:
    """Upper triangle over two unknowns of each point, a third of the points with one alone; their points."""
    points = np.repeat(np.arange(coupled.shape[0]), 2)
    kept = (np.arange(len(points)) % 6) != 5
    upper = sparse.triu(sparse.kron(coupled, np.ones((2, 2))).tocsr()[kept][:, kept]).tocsr()
    upper.sort_indices()
    return upper, points[kept]


def operations(coupled: sparse.csr_matrix, order: np.ndarray) -> int:
    """Of the factors: squares of what is coupled to each unknown as it is eliminated, fill and all."""
    near = [set(coupled[i].indices) - {i} for i in range(coupled.shape[0])]
    total = 0
    for i in order:
        total += (len(near[i]) + 1) ** 2
        for j in near[i]:
            near[j] |= near[i]
            near[j] -= {i, j}
    return total


@pytest.mark.parametrize("seed", range(8))
def test_a_cover_touches_all_edges_and_is_the_smallest(seed):
    edges = (np.random.default_rng(seed).uniform(size=(5, 6)) < 0.3).astype(float)
    rows, columns = _cover(sparse.csr_matrix(edges))
    assert not edges[~rows][:, ~columns].any()
    sizes = [
        np.sum(chosen)
        for chosen in itertools.product([False, True], repeat=11)
        if not edges[~np.array(chosen[:5])][:, ~np.array(chosen[5:])].any()
    ]
    assert rows.sum() + columns.sum() == min(sizes)


@pytest.mark.parametrize("thickness", [3.0, 7.0, 500.0])
def test_every_unknown_is_eliminated_once_and_points_as_a_whole(thickness):
    coupled, height = bar(31)
    upper, points = with_components(coupled)
    order = SlabOrdering(points, height, thickness)(upper)
    np.testing.assert_array_equal(np.sort(order), np.arange(len(points)))
    turns = points[order]
    assert np.sum(np.diff(turns) != 0) + 1 == len(height)


def test_last_is_the_middle_and_before_it_cuts_from_both_ends():
    coupled, height = bar(41)
    order = SlabOrdering(np.arange(len(height)), height, 8.0)(sparse.triu(coupled).tocsr())
    # Five slabs: four cuts, each of a level's points next to the planes at 8, 16, 24 and 32.
    cuts = height[order][-4 * SIDE**2 :].reshape(4, -1)
    np.testing.assert_array_equal(cuts, cuts[:, :1].repeat(SIDE**2, axis=1))
    assert np.all(np.abs(cuts[:, 0] - [8.0, 16.0, 32.0, 24.0]) <= 1.0)


def test_a_point_that_reaches_over_cuts_belongs_to_the_last_of_them():
    coupled, height = bar(41, reach=(5.0, 21.0))
    order = SlabOrdering(np.arange(len(height)), height, 8.0)(sparse.triu(coupled).tocsr())
    (long,) = np.flatnonzero(np.diff(coupled.indptr) == 18)
    # It goes over the planes at 8 and 16: it is one point more of the second cut, before those of 32 and 24.
    place = int(np.flatnonzero(order == long)[0])
    last = len(order) - 2 * SIDE**2
    assert last - SIDE**2 - 1 <= place < last


def test_the_work_grows_with_the_length_and_is_less_than_nested_dissections():
    """Bars twice and four times as long: each further slab costs the same, as its cuts do."""
    work, nested = [], []
    for levels in (33, 65, 129):
        coupled, height = bar(levels)
        upper = sparse.triu(coupled).tocsr()
        work.append(operations(coupled, SlabOrdering(np.arange(len(height)), height, 4.0)(upper)))
        nested.append(operations(coupled, nested_dissection_order(upper)))
    # Nested dissection of a slab depends on how its points are numbered, shuffled here: a few percent.
    assert (work[2] - work[1]) / (work[1] - work[0]) == pytest.approx(2.0, rel=0.05)
    assert work[2] < 0.95 * nested[2]


@pytest.mark.parametrize("single", [False, True])
def test_solutions_and_inertia_are_those_of_pardisos_own_order(single):
    coupled, height = bar(21)
    upper, points = with_components(coupled)
    rng = np.random.default_rng(6)
    calls = []

    def elimination(pattern):
        calls.append(pattern.shape)
        return SlabOrdering(points, height, 4.0)(pattern)

    own, ours = PardisoSolver(single=single), PardisoSolver(single=single, elimination=elimination)
    for revision in (0, 0, 1):
        values = upper.copy()
        values.data = rng.uniform(-1.0, 1.0, upper.nnz)
        # Diagonally dominant: 53 others in a row at most.
        values.setdiag(rng.choice([-1.0, 1.0], len(points)) * 60.0)
        right = rng.uniform(-1.0, 1.0, (len(points), 2))
        assert own.factorise(values, revision) == ours.factorise(values, revision)
        # A residual of 1e-7 in single precision, round-off in double, by a condition number below 20.
        left = 2e-6 if single else 1e-14
        np.testing.assert_allclose(ours.solve(right), own.solve(right), rtol=0, atol=left)
    assert len(calls) == 2
