"""The cell's unknowns: matrices over all nodes, taken to the independent nodes and the strain."""

import numpy as np
import scipy.sparse as sparse
from jaxtyping import Float, Int

from fem_reference.cell.helical_periodicity import HelicalFrame
from fem_reference.elements import Entries


class CellUnknowns:
    """Reduction of local and sparse matrices at one strain; see `Unknowns`.

    Parameters
    ----------
    frame : positions of all nodes in the independent ones and the strain.
    fold : sums components of the independent nodes to unknowns, where mirror images share them.
    """

    def __init__(self, frame: HelicalFrame, fold: sparse.csr_matrix | None = None) -> None:
        self._frame, self._fold = frame, fold
        #: K ∂x/∂y over all nodes (node, 3, y), summed over the local matrices so far.
        self.columns = np.zeros_like(frame.strain_motion)

    def blocks(
        self, connectivity: Int[np.ndarray, "elements points"], stiffness: Float[np.ndarray, "elements n n"]
    ) -> Float[np.ndarray, "elements n n"]:
        """See `Unknowns.blocks`; their ``columns`` are added up."""
        self.columns += self._frame.block_columns(connectivity, stiffness)
        return self._frame.rotate_blocks(connectivity, stiffness)

    def entries(self, matrix: sparse.spmatrix) -> Entries:
        """See `Unknowns.entries`."""
        transformation = self._frame.transformation()
        if self._fold is not None:
            transformation = transformation @ self._fold.T
        reduced = (transformation.T @ matrix @ transformation).tocoo()
        upper = reduced.row <= reduced.col
        return reduced.row[upper].astype(np.int64), reduced.col[upper].astype(np.int64), reduced.data[upper]
