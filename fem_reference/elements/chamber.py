"""Exact volume of the closed chambers, with gradient and Hessian, for the work of a follower pressure.

A chamber's wall is closed by triangle fans over its boundary loops. On a helically periodic cell the fans'
apex has no influence, because the two cuts are images of each other. Lengths mm.
"""

import numpy as np
from jaxtyping import Float, Int

from fem_reference.elements.enclosed_volume import VolumePatch, facet_form, fan_form
from fem_reference.mesh import BodyMesh, cut


class Chamber:
    """One closed chamber.

    Parameters
    ----------
    mesh : mesh of the body [mm].
    boundary : name of the chamber's wall in the mesh.
    """

    def __init__(self, mesh: BodyMesh, boundary: str) -> None:
        facets = mesh.oriented(boundary)
        #: Wall facets as cycles of four nodes, normals pointing out of the chamber.
        self.quads = cut(facets, mesh.order)
        fans = [_fan(loop, mesh.points) for loop in _loops(facets, mesh.order)]
        #: Wall and fans.
        self.patches = [VolumePatch(facets, facet_form(mesh.order))]
        if fans:
            self.patches.append(VolumePatch(np.concatenate(fans), fan_form(mesh.order)))

    def volume(self, positions: Float[np.ndarray, "nodes 3"]) -> float:
        """Enclosed volume [mm³]."""
        return sum(patch.volume(positions) for patch in self.patches)


def _loops(facets: Int[np.ndarray, "facets _"], order: int) -> list[Int[np.ndarray, "edges nodes"]]:
    """Return the boundary loops of a patch of oriented facets, each running against the facets' edges."""
    grid = facets.reshape(-1, order + 1, order + 1)
    sides = np.concatenate([grid[:, 0, :], grid[:, :, -1], grid[:, -1, ::-1], grid[:, ::-1, 0]])
    ends = {(int(side[0]), int(side[-1])): side for side in sides}
    following = {b: side[::-1] for (a, b), side in ends.items() if (b, a) not in ends}
    loops = []
    while following:
        start = next(iter(following))
        loop = [following.pop(start)]
        while loop[-1][-1] != start:
            loop.append(following.pop(int(loop[-1][-1])))
        loops.append(np.array(loop))
    return loops


def _fan(
    loop: Int[np.ndarray, "edges _"], points: Float[np.ndarray, "nodes 3"]
) -> Int[np.ndarray, "triangles _"]:
    """Close a loop by ruled triangles, oriented like the facets: each is the apex and an edge's nodes.

    The apex is chosen by x and y, so that the fans of two sections are images of each other.
    """
    first = min(range(len(loop)), key=lambda i: tuple(np.round(points[loop[i][0], :2], 6)))
    edges = np.roll(loop, -first, axis=0)
    if loop.shape[1] == 2:
        # Straight edges at the apex enclose no area.
        return np.column_stack([np.full(len(loop) - 2, edges[0, 0]), edges[1:-1]])
    return np.column_stack([np.full(len(loop), edges[0, 0]), edges])
