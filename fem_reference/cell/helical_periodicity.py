"""Helical periodicity: the cell's top face is the image of its bottom face under g = exp(pitch·(λ e3, u)).

Positions of all nodes follow from those of the independent ones (all but the top face's) and from the strain
y = (u, λ). This file maps forces and tangents over all nodes back to the independent nodes and y. Lengths mm.
"""

import numpy as np
import scipy.sparse as sparse
from jaxtyping import Float, Int

from fem_reference.cell.screw_motion import ScrewSeries
from fem_reference.mesh import BOTTOM, TOP, BodyMesh


class HelicalMap:
    """Pairs of bottom and top nodes that are images of each other.

    Parameters
    ----------
    mesh : one period of the body [mm], the nodes of its top face straight above those of its bottom face.
    overlap : height above the top face to which the map includes the next period [mm]. Its nodes there are
        images of those above the bottom face, and are numbered after the mesh's own.
    """

    def __init__(self, mesh: BodyMesh, overlap: float = 0.0) -> None:
        points = mesh.points
        self.period = float(points[:, 2].max())
        bottom = mesh.nodes(BOTTOM)
        top = mesh.nodes(TOP)
        bottom = bottom[np.lexsort(np.round(points[bottom, :2], 9).T)]
        top = top[np.lexsort(np.round(points[top, :2], 9).T)]
        mismatch = float(np.abs(points[bottom, :2] - points[top, :2]).max())
        if mismatch > 1e-9:
            raise ValueError(
                f"mesh: top and bottom faces differ by {mismatch:g} mm; expected an extruded mesh"
            )
        is_top = np.zeros(len(points), dtype=bool)
        is_top[top] = True
        self.independent = np.flatnonzero(~is_top)
        self.count = len(self.independent)
        above, next_cells = _next_period(mesh, overlap)
        #: For every node, the number among the independent nodes of itself or of its source.
        self.base = np.full(len(points), -1)
        self.base[self.independent] = np.arange(self.count)
        self.base[top] = self.base[bottom]
        self.base = np.append(self.base, self.base[above])
        self.is_image = np.append(is_top, np.ones(len(above), dtype=bool))
        self.images = np.flatnonzero(self.is_image)
        self.sources = self.base[self.images]
        # In the next period, the bottom face's nodes are the top face's, and those above it the new ones.
        renumbered = np.arange(len(points))
        renumbered[bottom] = top
        renumbered[above] = len(points) + np.arange(len(above))
        #: The mesh in linear hexahedra, with those of the next period up to the overlap.
        self.continued = BodyMesh(
            np.concatenate([points, points[above] + [0.0, 0.0, self.period]]),
            np.concatenate([mesh.cells, renumbered[next_cells]]),
            {},
        )


def _next_period(
    mesh: BodyMesh, overlap: float
) -> tuple[Int[np.ndarray, " nodes"], Int[np.ndarray, "cells 8"]]:
    """Nodes above the bottom face, and their linear hexahedra, up to the height that covers an overlap."""
    height = mesh.points[:, 2]
    levels = np.unique(np.round(height, 9))
    if overlap > levels[-2]:
        raise ValueError(
            f"winding: got a period of {levels[-1]:g} mm in {len(levels) - 1} layers of nodes and a thread "
            f"that ends {overlap:.3g} mm above it, expected at most {levels[-2]:g} mm; take shorter elements"
        )
    reached = levels[np.searchsorted(levels, overlap)] + 1e-9
    cells = mesh.cells[(height[mesh.cells] <= reached).all(axis=1)]
    return np.flatnonzero((height > 1e-9) & (height <= reached)), cells


class HelicalFrame:
    """The map at one strain: positions, and the pull-back of forces and tangents.

    Parameters
    ----------
    helical : the pairs of nodes.
    positions : of the independent nodes [mm].
    series : of the rigid motion at that strain.
    """

    def __init__(
        self, helical: HelicalMap, positions: Float[np.ndarray, "free 3"], series: ScrewSeries
    ) -> None:
        self._map = helical
        self.series = series
        motion, first, second = series.at(helical.period)
        self.rotation = motion[:3, :3]
        source = positions[helical.sources]
        self.positions = positions[helical.base]
        self.positions[helical.images] = source @ self.rotation.T + motion[:3, 3]
        self._first_rotation = first[:, :3, :3]
        self._source, self._second = source, second
        #: ∂x/∂y of every node, (node, 3, y); zero for the independent ones.
        self.strain_motion = np.zeros((len(helical.base), 3, 4))
        self.strain_motion[helical.images] = (
            np.einsum("uij,nj->niu", self._first_rotation, source) + first[:, :3, 3].T
        )

    def motion(self, step: Float[np.ndarray, "free 3"], strain_step: Float[np.ndarray, "4"]) -> np.ndarray:
        """Linearised displacement of all nodes under a step of the independent ones and of the strain."""
        moved = step[self._map.base]
        moved[self._map.images] = step[self._map.sources] @ self.rotation.T
        return moved + self.strain_motion @ strain_step

    def pull_force(
        self, force: Float[np.ndarray, "nodes 3"]
    ) -> tuple[Float[np.ndarray, "free 3"], Float[np.ndarray, "4"]]:
        """Forces conjugate to the independent nodes and to the strain."""
        free = force[self._map.independent].copy()
        np.add.at(free, self._map.sources, force[self._map.images] @ self.rotation)
        return free, np.einsum("ni,niu->u", force, self.strain_motion)

    def pull_columns(
        self, columns: Float[np.ndarray, "nodes 3 m"]
    ) -> tuple[Float[np.ndarray, "free 3 m"], Float[np.ndarray, "4 m"]]:
        """`pull_force` for several columns."""
        free = columns[self._map.independent].copy()
        np.add.at(free, self._map.sources, np.swapaxes(self.rotation[None], 1, 2) @ columns[self._map.images])
        return free, np.einsum("niu,nim->um", self.strain_motion, columns)

    def geometric(
        self, force: Float[np.ndarray, "nodes 3"]
    ) -> tuple[Float[np.ndarray, "free 3 4"], Float[np.ndarray, "4 4"]]:
        """Second derivatives of the map contracted with the force: (node, y) and (y, y) blocks."""
        image = force[self._map.images]
        mixed = np.zeros((self._map.count, 3, 4))
        np.add.at(mixed, self._map.sources, np.einsum("ni,uij->nju", image, self._first_rotation))
        turned = np.einsum("uvij,ij->uv", self._second[:, :, :3, :3], image.T @ self._source)
        return mixed, turned + self._second[:, :, :3, 3] @ image.sum(axis=0)

    def rotate_blocks(self, connectivity: Int[np.ndarray, "blocks nodes"], blocks: np.ndarray) -> np.ndarray:
        """Rotate local matrices over all nodes, in place, to be over the independent nodes."""
        is_image = self._map.is_image[connectivity]
        touched = np.flatnonzero(is_image.any(axis=1))
        if touched.size == 0:
            return blocks
        count, nodes = connectivity[touched].shape
        turn = np.where(is_image[touched][:, :, None, None], self.rotation.T, np.eye(3))
        part = (turn @ blocks[touched].reshape(count, nodes, 3, 3 * nodes)).reshape(
            count, 3 * nodes, 3 * nodes
        )
        part = np.ascontiguousarray(np.swapaxes(part, 1, 2)).reshape(count, nodes, 3, 3 * nodes)
        blocks[touched] = np.swapaxes((turn @ part).reshape(count, 3 * nodes, 3 * nodes), 1, 2)
        return blocks

    def block_columns(self, connectivity: Int[np.ndarray, "blocks nodes"], blocks: np.ndarray) -> np.ndarray:
        """Σ_blocks K ∂x/∂y over all nodes, (node, 3, y)."""
        touched = np.flatnonzero(self._map.is_image[connectivity].any(axis=1))
        columns = np.zeros((len(self._map.base), 3, 4))
        if touched.size:
            nodes = connectivity[touched]
            local = self.strain_motion[nodes].reshape(len(touched), -1, 4)
            np.add.at(columns, nodes, (blocks[touched] @ local).reshape(*nodes.shape, 3, 4))
        return columns

    def transformation(self) -> sparse.csr_matrix:
        """∂(all positions)/∂(independent positions) as a sparse matrix."""
        nodes = np.arange(len(self._map.base))
        turn = np.where(self._map.is_image[:, None, None], self.rotation, np.eye(3))
        rows = np.broadcast_to(3 * nodes[:, None, None] + np.arange(3)[:, None], turn.shape)
        columns = np.broadcast_to(3 * self._map.base[:, None, None] + np.arange(3), turn.shape)
        return sparse.csr_matrix(
            (turn.ravel(), (rows.ravel(), columns.ravel())), shape=(3 * len(nodes), 3 * self._map.count)
        )
