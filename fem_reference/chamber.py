"""Volume of the closed chambers with its gradient and Hessian: the follower pressure's work, exactly.

A chamber's wall is split into triangles and closed by fans over the loops where it is cut. The volume is
Σ_t w_t/6 det(a, b, c): a bilinear quadrilateral is the mean of its two splittings, so wall facets enter with
weight ½. On a helically periodic cell the fans' choice of apex drops out, because the two cuts are images of
each other. Lengths mm.
"""

import numpy as np
import skfem
from jaxtyping import Float, Int

from fem_reference.screw import cross_matrix


class Chamber:
    """One closed chamber.

    Parameters
    ----------
    mesh : mesh of the body [mm].
    boundary : name of the chamber's wall in the mesh.
    """

    def __init__(self, mesh: skfem.MeshHex, boundary: str) -> None:
        quads = oriented_facets(mesh, boundary)
        self.quads = quads
        a, b, c, d = quads.T
        wall = np.concatenate([np.column_stack(t) for t in ((a, b, c), (a, c, d), (a, b, d), (b, c, d))])
        fans = np.concatenate([_fan(loop, mesh.p) for loop in _loops(quads)])
        self.triangles = np.concatenate([wall, fans])
        self._weight = np.concatenate([np.full(len(wall), 0.5), np.ones(len(fans))]) / 6.0

    def volume(self, positions: Float[np.ndarray, "nodes 3"]) -> float:
        """Enclosed volume [mm³]."""
        a, b, c = np.moveaxis(positions[self.triangles], 1, 0)
        return float((self._weight * np.einsum("ti,ti->t", a, np.cross(b, c))).sum())

    def gradient(self, positions: Float[np.ndarray, "nodes 3"]) -> Float[np.ndarray, "triangles 9"]:
        """∂V/∂x on each triangle's nodes: their shares of the outward vector area."""
        a, b, c = np.moveaxis(positions[self.triangles], 1, 0)
        parts = np.stack([np.cross(b, c), np.cross(c, a), np.cross(a, b)], axis=1)
        return (self._weight[:, None, None] * parts).reshape(-1, 9)

    def hessian(self, positions: Float[np.ndarray, "nodes 3"]) -> Float[np.ndarray, "triangles 9 9"]:
        """∂²V/∂x² on each triangle's nodes."""
        corner = positions[self.triangles]
        hessian = np.zeros((len(self.triangles), 3, 3, 3, 3))
        for node in range(3):
            after, last = (node + 1) % 3, (node + 2) % 3
            # det(a, b, c) = a·(b × c): ∂²/∂a∂b = −[c]×, and cyclically.
            block = -self._weight[:, None, None] * _cross_matrices(corner[:, last])
            hessian[:, node, :, after, :] = block
            hessian[:, after, :, node, :] = np.swapaxes(block, 1, 2)
        return hessian.reshape(-1, 9, 9)


def oriented_facets(mesh: skfem.MeshHex, boundary: str) -> Int[np.ndarray, "facets 4"]:
    """Facets of a boundary as cycles of nodes whose normal points into the solid (out of a cavity)."""
    facets = mesh.boundaries[boundary]
    quads = mesh.facets[:, facets].T.copy()
    inside = mesh.p[:, mesh.t[:, mesh.f2t[0, facets]]].mean(axis=1).T
    corner = mesh.p.T[quads]
    # scikit-fem stores a facet's nodes in no particular cycle: the longest "edge" of the three pairings is
    # the diagonal.
    for row, x in zip(quads, corner, strict=True):
        far = 1 + int(np.argmax([_diagonal_score(x, k) for k in (1, 2, 3)]))
        near = [k for k in (1, 2, 3) if k != far]
        row[:] = row[[0, near[0], far, near[1]]]
    corner = mesh.p.T[quads]
    normal = np.cross(corner[:, 2] - corner[:, 0], corner[:, 3] - corner[:, 1])
    flip = np.einsum("fi,fi->f", normal, inside - corner.mean(axis=1)) < 0.0
    quads[flip] = quads[flip][:, ::-1]
    return quads


def _diagonal_score(x: Float[np.ndarray, "4 3"], k: int) -> float:
    """How close the mid-points of (0, k) and of the other two nodes lie: those of diagonals nearly meet."""
    others = [j for j in (1, 2, 3) if j != k]
    return -float(np.linalg.norm(x[0] + x[k] - x[others[0]] - x[others[1]]))


def _loops(quads: Int[np.ndarray, "facets 4"]) -> list[list[int]]:
    """Boundary loops of a patch of oriented facets, each running against the facets' edges."""
    edges = {(int(q[i]), int(q[(i + 1) % 4])) for q in quads for i in range(4)}
    following = {b: a for a, b in edges if (b, a) not in edges}
    loops = []
    while following:
        start = next(iter(following))
        loop = [start]
        node = following.pop(start)
        while node != start:
            loop.append(node)
            node = following.pop(node)
        loops.append(loop)
    return loops


def _fan(loop: list[int], points: Float[np.ndarray, "3 nodes"]) -> Int[np.ndarray, "triangles 3"]:
    """Triangles that close a loop, oriented like the facets beyond it.

    The apex is chosen by the section's coordinates, so that the fans of two sections are images of each
    other.
    """
    first = min(range(len(loop)), key=lambda i: tuple(np.round(points[:2, loop[i]], 6)))
    loop = loop[first:] + loop[:first]
    return np.array([(loop[0], loop[i], loop[i + 1]) for i in range(1, len(loop) - 1)])


def _cross_matrices(a: Float[np.ndarray, "n 3"]) -> Float[np.ndarray, "n 3 3"]:
    return np.einsum("ni,ijk->njk", a, np.stack([cross_matrix(e) for e in np.eye(3)]))
