"""Map from the components of points to unknowns, with held components and mirror images.

Components are numbered three per point. A sign (±1) relates each component to its unknown.
"""

import numpy as np
import scipy.sparse as sparse
from jaxtyping import Bool, Float, Int

# Mirror image of a vector in the plane y = 0.
_MIRROR = np.array([1.0, -1.0, 1.0])


class DofMap:
    """Unknown of each component of all points.

    Parameters
    ----------
    number : unknown of each component, −1 where it is held.
    sign : sign (±1) with which the unknown enters the component.
    """

    def __init__(self, number: Int[np.ndarray, " dofs"], sign: Float[np.ndarray, " dofs"]) -> None:
        self._number, self._sign = number, sign
        #: Number of unknowns.
        self.size = int(number.max()) + 1
        free = np.flatnonzero(number >= 0)
        #: Sums components of all points to unknowns; the transpose expands unknowns to components.
        self.fold = sparse.csr_matrix((sign[free], (number[free], free)), shape=(self.size, number.size))

    @classmethod
    def but_for(cls, held: Bool[np.ndarray, "points 3"]) -> "DofMap":
        """Map every component to its own unknown, except the held ones."""
        free = ~held.ravel()
        return cls(np.where(free, np.cumsum(free) - 1, -1), np.ones(free.size))

    @classmethod
    def mirrored(cls, held: Bool[np.ndarray, "points 3"], image: Int[np.ndarray, " points"]) -> "DofMap":
        """Map points and their mirror images to the same unknowns; see `_mirrored_numbers`."""
        return cls(*_mirrored_numbers(held, image))

    @property
    def held(self) -> Bool[np.ndarray, "points 3"]:
        """Components without an unknown."""
        return (self._number < 0).reshape(-1, 3)

    @property
    def points(self) -> Int[np.ndarray, " size"]:
        """Point that each unknown moves; the first of two images."""
        _, first = np.unique(self._number[self._number >= 0], return_index=True)
        return np.flatnonzero(self._number >= 0)[first] // 3

    def of(
        self, connectivity: Int[np.ndarray, "blocks points"]
    ) -> tuple[Int[np.ndarray, "blocks dofs"], Float[np.ndarray, "blocks dofs"]]:
        """Return unknown and sign of all components of each block's points."""
        blocks, points = connectivity.shape
        components = (3 * connectivity[:, :, None] + np.arange(3)).reshape(blocks, 3 * points)
        return self._number[components], self._sign[components]

    def entries(self, matrix: sparse.spmatrix) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return a matrix over components as the upper triangle over unknowns: rows, columns and values."""
        full = matrix.tocoo()
        rows, columns = self._number[full.row], self._number[full.col]
        keep = (rows >= 0) & (rows <= columns)
        signs = self._sign[full.row[keep]] * self._sign[full.col[keep]]
        return rows[keep], columns[keep], signs * full.data[keep]


def _mirrored_numbers(
    held: Bool[np.ndarray, "points 3"], image: Int[np.ndarray, " points"]
) -> tuple[Int[np.ndarray, " dofs"], Float[np.ndarray, " dofs"]]:
    """Return the unknown of each component, −1 where it is held, and its sign.

    A point and its image share unknowns: the first of the two moves by them, the other by their mirror image.
    A point in the plane is held across it.
    """
    own = np.arange(len(image))
    free = ~held
    free[image == own, 1] = False
    first = own <= image
    counted = (free & first[:, None]).ravel()
    number = np.where(counted, np.cumsum(counted) - 1, -1).reshape(-1, 3)
    number = number[np.minimum(own, image)]
    sign = np.where(first[:, None], 1.0, _MIRROR)
    return np.where(free, number, -1).ravel(), sign.ravel()
