"""The plane of symmetry y = 0: mirror images of points, blocks and vectors.

If body, winding and loads are symmetric, there are symmetric equilibria. Points that are tied to their images
leave half the unknowns; modes that break the symmetry are excluded, so that the stiffness has the pivots of
symmetric modes only. Elements are evaluated on one half. Lengths are in millimetres.
"""

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float, Int
from scipy.spatial import cKDTree

from fem_reference.mesh.body_mesh import BodyMesh

# A point this close to another one's image is that image [mm]; gmsh's arcs are accurate to 3e-8 mm.
_SAME = 1e-6
_MIRROR = np.array([1.0, -1.0, 1.0])


def mirror_images(points: Float[np.ndarray, "points 3"]) -> Int[np.ndarray, " points"] | None:
    """Index of each point's mirror image, its own for points in the plane; None if one has no image."""
    if len(points) == 0:
        return np.zeros(0, int)
    distance, image = cKDTree(points).query(points * _MIRROR)
    return image if float(distance.max(initial=0.0)) <= _SAME else None


def images_with_winding(
    points: Float[np.ndarray, "points 3"], thread: Float[np.ndarray, "places 3"]
) -> Int[np.ndarray, " points"]:
    """Index of each point's mirror image, in a body whose winding is its own mirror image too.

    Raises
    ------
    ValueError
        If a point of the body, or a place on the thread, has no image.
    """
    image = mirror_images(points)
    if image is None or mirror_images(thread) is None:
        raise ValueError(
            "symmetric: got a winding without it, expected its own mirror image in the plane y = 0"
        )
    return image


@dataclass(frozen=True)
class MirrorPairs:
    """Blocks (elements, facets) of which one of each mirror pair is kept.

    Parameters
    ----------
    kept : indices of the blocks that are kept.
    counts : number of blocks that each kept one represents: 2, or 1 if it is its own image.
    standing_for : for each block, the kept one that represents it.
    """

    kept: Int[np.ndarray, " kept"]
    counts: Int[np.ndarray, " kept"]
    standing_for: Int[np.ndarray, " blocks"]

    def expand(self, vectors: Float[np.ndarray, "kept _"]) -> Float[np.ndarray, "blocks _"]:
        """Expand values of the kept blocks, which are the same for both of a pair, to all blocks."""
        return vectors[self.standing_for]


def mirror_pairs(places: Float[np.ndarray, "blocks 3"], symmetric: bool) -> MirrorPairs:
    """Pair blocks with their mirror images by their centres; keep all of them if not symmetric."""
    own = np.arange(len(places))
    image = mirror_images(places) if symmetric else own
    if image is None:
        raise ValueError("places: got blocks without mirror images, expected all of a symmetric body's")
    kept, standing_for, counts = np.unique(np.minimum(own, image), return_inverse=True, return_counts=True)
    return MirrorPairs(kept, counts, standing_for)


def symmetrised(
    vectors: Float[np.ndarray, "points 3"], image: Int[np.ndarray, " points"]
) -> Float[np.ndarray, "points 3"]:
    """Symmetric part of a vector field: the mean of each vector and its image's mirrored vector."""
    mean: np.ndarray = 0.5 * (vectors + vectors[image] * _MIRROR)
    return mean


def even_mesh(mesh: BodyMesh) -> BodyMesh:
    """The mesh as its own mirror image to round-off, so that half of it stands for all of it."""
    image = mirror_images(mesh.points)
    if image is None:
        raise ValueError(
            "symmetric: got a geometry without it, expected its own mirror image in the plane y = 0"
        )
    return replace(mesh, points=symmetrised(mesh.points, image))
