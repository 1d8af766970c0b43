"""The plane of symmetry y = 0: which point is whose image, and vectors that are their own mirror images.

Where body, winding and loads have the plane, there are equilibria that keep it. With points tied to their
images, half the unknowns are left, and what breaks the symmetry is out of reach: the stiffness has the pivots
of deformations that keep the plane, and no others. Lengths mm.
"""

import numpy as np
from jaxtyping import Bool, Float, Int
from scipy.spatial import cKDTree

# Distance within which a point is another one's image [mm]: gmsh's arcs are accurate to 3e-8 mm.
_SAME = 1e-6
_MIRROR = np.array([1.0, -1.0, 1.0])


def images(points: Float[np.ndarray, "points 3"]) -> Int[np.ndarray, " points"] | None:
    """Index of each point's mirror image among them, its own in the plane; None where one has no image."""
    distance, image = cKDTree(points).query(points * _MIRROR)
    return image if float(distance.max(initial=0.0)) <= _SAME else None


def numbering(
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
