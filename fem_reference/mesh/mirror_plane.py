"""The plane of symmetry y = 0: which point is whose image, and vectors that are their own mirror images.

Where body, winding and loads have the plane, there are equilibria that keep it. With points tied to their
images, half the unknowns are left, and what breaks the symmetry is out of reach: the stiffness has the pivots
of deformations that keep the plane, and no others. What images do need not be worked out twice. Lengths mm.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int
from scipy.spatial import cKDTree

# Distance within which a point is another one's image [mm]: gmsh's arcs are accurate to 3e-8 mm.
_SAME = 1e-6
_MIRROR = np.array([1.0, -1.0, 1.0])


def mirror_images(points: Float[np.ndarray, "points 3"]) -> Int[np.ndarray, " points"] | None:
    """Index of each point's mirror image among them, its own in the plane; None where one has no image."""
    if len(points) == 0:
        return np.zeros(0, int)
    distance, image = cKDTree(points).query(points * _MIRROR)
    return image if float(distance.max(initial=0.0)) <= _SAME else None


@dataclass(frozen=True)
class MirrorPairs:
    """Blocks of points, each of which stands for its mirror image too.

    Parameters
    ----------
    kept : the blocks that do.
    counts : of how many blocks each stands for, one where it is its own image.
    standing_for : which of those kept stands for each block.
    """

    kept: Int[np.ndarray, " kept"]
    counts: Int[np.ndarray, " kept"]
    standing_for: Int[np.ndarray, " blocks"]

    def expand(self, vectors: Float[np.ndarray, "kept _"]) -> Float[np.ndarray, "blocks _"]:
        """Of every block, what is the same for both of a pair."""
        return vectors[self.standing_for]


def mirror_pairs(places: Float[np.ndarray, "blocks 3"], symmetric: bool) -> MirrorPairs:
    """Halve blocks, which have images among them, by the places of their middles; all of them if not."""
    own = np.arange(len(places))
    image = mirror_images(places) if symmetric else own
    if image is None:
        raise ValueError("places: got blocks without mirror images, expected all of a symmetric body's")
    kept, standing_for, counts = np.unique(np.minimum(own, image), return_inverse=True, return_counts=True)
    return MirrorPairs(kept, counts, standing_for)


def symmetrised(
    vectors: Float[np.ndarray, "points 3"], image: Int[np.ndarray, " points"]
) -> Float[np.ndarray, "points 3"]:
    """The mean of vectors at points and of the mirror images of those at the points' images."""
    mean: np.ndarray = 0.5 * (vectors + vectors[image] * _MIRROR)
    return mean
