"""Which unknowns move which components of points: each its own, unless it is held or tied to an image.

Components are counted three to a point; signs say how they go with the unknowns that they are numbered by.
"""

import numpy as np
import scipy.sparse as sparse
from jaxtyping import Bool, Float, Int

# A vector's image in the plane y = 0.
_MIRROR = np.array([1.0, -1.0, 1.0])


class DofMap:
    """Numbers of unknowns for the components of all points.

    Parameters
    ----------
    number : of each component's unknown, −1 where it is held.
    sign : by which it goes with it.
    """

    def __init__(self, number: Int[np.ndarray, " dofs"], sign: Float[np.ndarray, " dofs"]) -> None:
        self._number, self._sign = number, sign
        #: Number of unknowns.
        self.size = int(number.max()) + 1
        free = np.flatnonzero(number >= 0)
        #: Sums components of all points to the unknowns that they go with; transposed, it moves the points.
        self.fold = sparse.csr_matrix((sign[free], (number[free], free)), shape=(self.size, number.size))

    @classmethod
    def but_for(cls, held: Bool[np.ndarray, "points 3"]) -> "DofMap":
        """Every component is an unknown but for those that are held."""
        free = ~held.ravel()
        return cls(np.where(free, np.cumsum(free) - 1, -1), np.ones(free.size))

    @classmethod
    def mirrored(cls, held: Bool[np.ndarray, "points 3"], image: Int[np.ndarray, " points"]) -> "DofMap":
        """The same where points are tied to their mirror images; see `_mirrored_numbers`."""
        return cls(*_mirrored_numbers(held, image))

    @property
    def held(self) -> Bool[np.ndarray, "points 3"]:
        """Which components of which points have no unknown."""
        return (self._number < 0).reshape(-1, 3)

    @property
    def points(self) -> Int[np.ndarray, " size"]:
        """Point that each unknown moves, the first of two images."""
        _, first = np.unique(self._number[self._number >= 0], return_index=True)
        return np.flatnonzero(self._number >= 0)[first] // 3

    def of(
        self, connectivity: Int[np.ndarray, "blocks points"]
    ) -> tuple[Int[np.ndarray, "blocks dofs"], Float[np.ndarray, "blocks dofs"]]:
        """Unknown and sign of all components of each block's points."""
        blocks, points = connectivity.shape
        components = (3 * connectivity[:, :, None] + np.arange(3)).reshape(blocks, 3 * points)
        return self._number[components], self._sign[components]

    def entries(self, matrix: sparse.spmatrix) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Rows, columns and values of the upper triangle, over unknowns, of a matrix over components."""
        full = matrix.tocoo()
        rows, columns = self._number[full.row], self._number[full.col]
        keep = (rows >= 0) & (rows <= columns)
        signs = self._sign[full.row[keep]] * self._sign[full.col[keep]]
        return rows[keep], columns[keep], signs * full.data[keep]


def _mirrored_numbers(
    held: Bool[np.ndarray, "points 3"], image: Int[np.ndarray, " points"]
) -> tuple[Int[np.ndarray, " dofs"], Float[np.ndarray, " dofs"]]:
    """Number of each degree of freedom and its sign; −1 where it is held, as by the plane.

    A point and its image have the same numbers; of two, the one that comes first moves as they say, and the
    other as its mirror image.
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
