"""Elimination order for a slender body: slabs first, then the separators between them.

Nested dissection halves a body recursively, and each separator fills in with up to two others. Across a
slender body all separators are small and similar: they are eliminated here one after another from both ends
to the middle, so that each fills in with only one other. This takes a third of the operations for the
separators, and the work grows linearly with the length. Slabs are ordered by nested dissection (George, Liu
1981, Computer Solution of Large Sparse Positive Definite Systems, §8).
"""

import numpy as np
import scipy.sparse as sparse
from jaxtyping import Bool, Float, Int
from scipy.sparse.csgraph import breadth_first_order, maximum_flow

from fem_reference.algebra.factorisation import nested_dissection_order


class SlabOrdering:
    """Elimination order of a slender body along z.

    Parameters
    ----------
    points : point of each unknown; a point's unknowns are eliminated together.
    heights : z of every point.
    thickness : approximate thickness of a slab, in the unit of ``heights``.
    """

    def __init__(
        self,
        points: Int[np.ndarray, " unknowns"],
        heights: Float[np.ndarray, " points"],
        thickness: float,
    ) -> None:
        used, self._point = np.unique(points, return_inverse=True)
        self._height = heights[used]
        size = len(points)
        self._sum = sparse.csr_matrix(
            (np.ones(size, dtype=np.float32), (self._point, np.arange(size))), shape=(len(used), size)
        )
        low, high = self._height.min(), self._height.max()
        slabs = max(1, round((high - low) / thickness))
        cuts = low + (high - low) * np.arange(1, slabs) / slabs
        half = len(cuts) // 2
        self._cuts = np.concatenate([cuts[:half], cuts[:half:-1], cuts[half : half + 1]])

    def __call__(self, upper: sparse.csr_matrix) -> Int[np.ndarray, " unknowns"]:
        """Return the unknowns in the order in which they are eliminated."""
        # Ones in place of the values, whose sums may vanish.
        ones = np.ones(upper.nnz, dtype=np.float32)
        pattern = sparse.csr_matrix((ones, upper.indices, upper.indptr), shape=upper.shape)
        coupled = self._sum @ pattern @ self._sum.T
        coupled = (coupled + coupled.T).tocsr()
        cut = self._cut_of(coupled)
        within = np.flatnonzero(cut < 0)
        slabs = sparse.triu(coupled[within][:, within]).tocsr()
        slabs.sort_indices()
        cuts = [np.flatnonzero(cut == number) for number in range(len(self._cuts))]
        order = np.concatenate([within[nested_dissection_order(slabs)], *cuts])
        rank = np.empty_like(order)
        rank[order] = np.arange(len(order))
        return np.argsort(rank[self._point], kind="stable")

    def _cut_of(self, coupled: sparse.csr_matrix) -> Int[np.ndarray, " points"]:
        """Return the number of each point's cut, −1 within slabs.

        A cut is a smallest set of points that separates the points below it from those above. A point of an
        earlier cut that reaches over a later one moves there, so that no cut borders on two others.
        """
        cut = np.full(len(self._height), -1)
        for number, height in enumerate(self._cuts):
            below = np.flatnonzero(self._height < height)
            above = np.flatnonzero(self._height >= height)
            across = coupled[below][:, above].tocoo()
            low, row = np.unique(across.row, return_inverse=True)
            high, column = np.unique(across.col, return_inverse=True)
            edges = sparse.csr_matrix((np.ones(len(row)), (row, column)), shape=(len(low), len(high)))
            own_low, own_high = _cover(edges)
            cut[below[low[own_low]]] = number
            cut[above[high[own_high]]] = number
        return cut


def _cover(edges: sparse.csr_matrix) -> tuple[Bool[np.ndarray, " rows"], Bool[np.ndarray, " columns"]]:
    """Return a minimum vertex cover of bipartite edges between rows and columns, by a minimum cut.

    In the network each row and column has capacity one, and edges have any (Kőnig 1931; as a flow: Ford,
    Fulkerson 1962, §II.8).
    """
    rows, columns = edges.shape
    source, sink = rows + columns, rows + columns + 1
    to_rows = np.full(rows, source), np.arange(rows), np.ones(rows)
    along = edges.tocoo()
    through = along.row, rows + along.col, np.full(along.nnz, rows + columns)
    to_sink = rows + np.arange(columns), np.full(columns, sink), np.ones(columns)
    start, end, capacity = (np.concatenate(part) for part in zip(to_rows, through, to_sink, strict=True))
    network = sparse.csr_matrix((capacity.astype(np.int32), (start, end)), shape=(sink + 1, sink + 1))
    left = network - maximum_flow(network, source, sink).flow
    left.eliminate_zeros()
    reached = np.zeros(sink + 1, dtype=bool)
    reached[breadth_first_order(left, source, return_predecessors=False)] = True
    return ~reached[:rows], reached[rows:source]
