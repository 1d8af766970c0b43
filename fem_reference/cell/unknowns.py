"""The cell's unknowns: independent nodes, or pairs of mirror images, the gauge's multipliers, and the strain.

Two multipliers fix the gauge: the bottom section's mean axial slip and mean rotation about the core are zero.
"""

import numpy as np
import scipy.sparse as sparse
from jaxtyping import Float, Int

from fem_reference.algebra import DofMap
from fem_reference.cell.helical_periodicity import HelicalFrame, HelicalMap
from fem_reference.elements import Entries
from fem_reference.mesh import BOTTOM, BodyMesh

# Compliance of the gauge [mm/N]. It violates the gauge by less than 1e-9 mm, and gives its pivots a sign.
_GAUGE_COMPLIANCE = 1e-9
#: Number of gauges: mean slip and mean rotation.
GAUGES = 2


class NodalUnknowns:
    """Unknowns of the independent nodes, which mirror images share, and the multipliers of the gauge.

    Parameters
    ----------
    mesh, helical : of the cell.
    image : mirror image of each independent node; None without the plane of symmetry.
    """

    def __init__(self, mesh: BodyMesh, helical: HelicalMap, image: Int[np.ndarray, " free"] | None) -> None:
        held = np.zeros((helical.count, 3), dtype=bool)
        self._dofs = DofMap.but_for(held) if image is None else DofMap.mirrored(held, image)
        self._base, self._rest = helical.base, mesh.points[helical.independent]
        #: Sums components of the independent nodes to unknowns if mirror images share them; None if not.
        self.fold = None if image is None else self._dofs.fold
        #: Number of unknowns, multipliers included.
        self.size = self._dofs.size + GAUGES
        self._gauge = _gauge_rows(mesh.nodal_areas(BOTTOM)[helical.independent], self._rest)
        self._folded_gauge = self._folded(self._gauge.T).T
        #: Rows, columns and values of the gauge in the system's upper triangle.
        self.gauge_entries = self._gauge_matrix_entries()

    def of(
        self, connectivity: Int[np.ndarray, "blocks points"]
    ) -> tuple[Int[np.ndarray, "blocks dofs"], Float[np.ndarray, "blocks dofs"]]:
        """Unknown and sign of all components of each block's nodes, by the independent nodes behind them."""
        return self._dofs.of(self._base[connectivity])

    def displacement(self, unknowns: Float[np.ndarray, " q"]) -> Float[np.ndarray, "free 3"]:
        """Displacement of the independent nodes when the unknowns change, multipliers left out [mm]."""
        moved = unknowns if self.fold is None else self.fold.T @ unknowns
        return np.asarray(moved).reshape(-1, 3)

    def columns(self, columns: Float[np.ndarray, "free 3 m"]) -> Float[np.ndarray, "q m"]:
        """Columns over the independent nodes as columns over the unknowns; zero for the multipliers."""
        folded = self._folded(columns.reshape(-1, columns.shape[2]))
        return np.concatenate([folded, np.zeros((GAUGES, folded.shape[1]))])

    def residual(
        self,
        positions: Float[np.ndarray, "free 3"],
        force: Float[np.ndarray, "free 3"],
        multipliers: Float[np.ndarray, "2"],
    ) -> Float[np.ndarray, " q"]:
        """Forces on the unknowns, those of the multipliers included, and how far the gauge is violated."""
        slip = self._gauge @ (positions - self._rest).ravel()
        return np.concatenate(
            [
                self._folded(force.ravel()) + multipliers @ self._folded_gauge,
                slip - _GAUGE_COMPLIANCE * multipliers,
            ]
        )

    def _folded(self, components: Float[np.ndarray, "dofs *m"]) -> Float[np.ndarray, "q *m"]:
        return components if self.fold is None else self.fold @ components

    def _gauge_matrix_entries(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        gauge, node = np.nonzero(self._folded_gauge)
        first = self._folded_gauge.shape[1]
        own = first + np.arange(GAUGES)
        return (
            np.concatenate([node, own]),
            np.concatenate([first + gauge, own]),
            np.concatenate([self._folded_gauge[gauge, node], np.full(GAUGES, -_GAUGE_COMPLIANCE)]),
        )


def _gauge_rows(
    areas: Float[np.ndarray, " free"], rest: Float[np.ndarray, "free 3"]
) -> Float[np.ndarray, "2 dofs"]:
    """Mean axial displacement and mean rotation, times the mean radius, of the section with these areas."""
    weight = areas / areas.sum()
    x, y, _ = rest.T
    arm = np.sqrt(float((weight * (x**2 + y**2)).sum()))
    rows = np.zeros((GAUGES, len(rest), 3))
    rows[0, :, 2] = weight
    rows[1, :, 0] = -weight * y / arm
    rows[1, :, 1] = weight * x / arm
    return rows.reshape(GAUGES, -1)


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
