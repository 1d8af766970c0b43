"""Assembly of batched local matrices into a symmetric sparse matrix with a cached pattern."""

import itertools
from collections.abc import Callable, Mapping

import numpy as np
import scipy.sparse as sparse
from jaxtyping import Float, Int

_REVISIONS = itertools.count()


class SparsePattern:
    """Upper triangle of a symmetric matrix as the union of local dense blocks and single entries.

    Parameters
    ----------
    size : number of unknowns.
    groups : by the group's name, the unknowns of its local matrices, (blocks, local size); −1 where a
        component is clamped or has no weight.
    entries : rows and columns of further entries.
    signs : by the group's name, ±1 for each component: the sign with which its unknown moves it. All are +1
        by default.
    """

    def __init__(
        self,
        size: int,
        groups: Mapping[str, Int[np.ndarray, "_ _"]],
        entries: tuple[Int[np.ndarray, " n"], Int[np.ndarray, " n"]],
        signs: Mapping[str, Float[np.ndarray, "_ _"]] | None = None,
    ) -> None:
        self.size = size
        #: Number of this pattern, unique among all: a solver analyses the matrix anew when it changes.
        self.revision = next(_REVISIONS)
        self._index = {name: index for index, name in enumerate(groups)}
        local_keys, chosen_of, sizes, weights = [], [], [], []
        for name, dofs in groups.items():
            local = dofs.shape[1]
            rows = np.repeat(dofs, local, axis=1).ravel()
            columns = np.tile(dofs, (1, local)).ravel()
            chosen = np.flatnonzero((rows >= 0) & (rows <= columns))
            chosen_of.append(chosen)
            sizes.append(rows.size)
            weight = np.ones(len(chosen))
            if signs is not None:
                weight = (signs[name][:, :, None] * signs[name][:, None, :]).ravel()[chosen]
            weights.append(weight)
            local_keys.append(rows[chosen] * np.int64(size) + columns[chosen])
        rows, columns = entries
        diagonal = np.arange(size, dtype=np.int64) * (size + 1)
        fixed = np.minimum(rows, columns) * np.int64(size) + np.maximum(rows, columns)
        keys = _distinct(np.concatenate([*local_keys, fixed, diagonal]))
        # Each group has its places in the data, and a matrix that sums its local entries there. It is stored
        # by columns, so that entries are read in the order in which they lie in memory.
        merged = [np.unique(np.searchsorted(keys, k), return_inverse=True) for k in local_keys]
        own_places = [places for places, _ in merged]
        self._own_sums = [
            sparse.csc_matrix((weight, (inverse, chosen)), shape=(len(places), size))
            for (places, inverse), weight, chosen, size in zip(merged, weights, chosen_of, sizes, strict=True)
        ]
        self._own = keys, own_places
        self._set(*self._own)

    def _set(self, keys: Int[np.ndarray, " nonzeros"], places: list[Int[np.ndarray, " _"]]) -> None:
        self._keys, self._places = keys, places
        # A group that fills most of the matrix is summed over all of it. That costs half as much as sums over
        # its own places, which are then added to the data by index.
        self._sums = [
            sparse.csc_matrix((s.data, to[s.indices], s.indptr), shape=(len(keys), s.shape[1]))
            if 2 * len(to) > len(keys)
            else s
            for s, to in zip(self._own_sums, places, strict=True)
        ]
        rows = keys // self.size
        self.indices = (keys % self.size).astype(np.int32)
        self.indptr = np.searchsorted(rows, np.arange(self.size + 1)).astype(np.int32)

    @property
    def diagonal(self) -> Int[np.ndarray, " size"]:
        """Places of the diagonal's entries in the matrix's data."""
        return self.indptr[:-1]

    def __len__(self) -> int:
        return len(self._keys)

    def cover(
        self,
        rows: Int[np.ndarray, " n"],
        columns: Int[np.ndarray, " n"],
        likely: Callable[[], tuple[Int[np.ndarray, " m"], Int[np.ndarray, " m"]]],
    ) -> None:
        """Replace the pattern's further entries by these, if some of them are missing.

        The new pattern also has the ``likely`` entries, which the next steps may need: after each change the
        solver analyses the matrix anew. Entries that are no longer needed go, as they would fill the factors.
        """
        if self._missing(rows, columns).size:
            self._set(*self._own)
            more_rows, more_columns = likely()
            self.extend(np.concatenate([rows, more_rows]), np.concatenate([columns, more_columns]))

    def _missing(
        self, rows: Int[np.ndarray, " n"], columns: Int[np.ndarray, " n"]
    ) -> Int[np.ndarray, " missing"]:
        wanted = rows * np.int64(self.size) + columns
        at = np.minimum(np.searchsorted(self._keys, wanted), len(self._keys) - 1)
        return wanted[self._keys[at] != wanted]

    def extend(self, rows: Int[np.ndarray, " n"], columns: Int[np.ndarray, " n"]) -> None:
        """Add missing entries of the upper triangle; a change gives a new ``revision``."""
        missing = np.unique(self._missing(rows, columns))
        if missing.size:
            before = np.searchsorted(self._keys, missing)
            shift = np.cumsum(np.bincount(before, minlength=len(self._keys)))
            self._set(np.insert(self._keys, before, missing), [p + shift[p] for p in self._places])
            self.revision = next(_REVISIONS)

    def add_group(
        self, data: Float[np.ndarray, " nonzeros"], name: str, local: Float[np.ndarray, "blocks n n"]
    ) -> None:
        """Add the named group's local matrices to the matrix's data."""
        index = self._index[name]
        sums = self._sums[index]
        places = slice(None) if sums.shape[0] == len(data) else self._places[index]
        data[places] += sums @ local.reshape(-1)

    def add_entries(
        self,
        data: Float[np.ndarray, " nonzeros"],
        rows: Int[np.ndarray, " n"],
        columns: Int[np.ndarray, " n"],
        values: Float[np.ndarray, " n"],
    ) -> None:
        """Add single entries of the upper triangle, all of them in the pattern."""
        np.add.at(data, np.searchsorted(self._keys, rows * np.int64(self.size) + columns), values)

    def matrix(self, data: Float[np.ndarray, " nonzeros"]) -> sparse.csr_matrix:
        """The upper triangle as CSR, sharing ``data``."""
        return sparse.csr_matrix((data, self.indices, self.indptr), shape=(self.size, self.size))


def _distinct(keys: Int[np.ndarray, " n"]) -> Int[np.ndarray, " distinct"]:
    """Sorted, each once; NumPy's `unique` finds them by a hash table, which takes ten times as long."""
    keys = np.sort(keys)
    return keys[np.insert(np.diff(keys) > 0, 0, True)]


def scatter(
    points: Int[np.ndarray, "blocks nodes"], local: Float[np.ndarray, "blocks dofs"], count: int
) -> Float[np.ndarray, "points 3"]:
    """Sum local nodal vectors into an array over all points."""
    dofs = (3 * points[:, :, None] + np.arange(3)).ravel()
    # Without any block bincount counts, in whole numbers.
    total = np.bincount(dofs, weights=local.ravel(), minlength=3 * count).astype(float)
    return total.reshape(count, 3)
