"""Thread embedded in the host mesh: straight elastic segments whose end points move with the hexahedra.

A segment of rest length L0 has the energy EA/2 L0 (l/L0 − 1)². Its translations are interpolated from the
host's nodes, as the paper's embedded elements do. Lengths mm, forces N.
"""

import numpy as np
import skfem
from jaxtyping import Float, Int
from scipy.spatial import cKDTree

from fem_reference.winding import Thread, Winding

_MILLIMETRE = 1e3


class ThreadSegments:
    """All segments of a winding in a mesh.

    Parameters
    ----------
    mesh : host mesh [mm], between z = 0 and z = ``length``.
    winding : layout; thread : its elasticity.
    radius, length : of the winding's cylinder [m].
    points_per_turn : segments per turn of a helix, or of a ring; about one per host element.

    Raises
    ------
    ValueError
        For threads that overlap or leave the mesh.
    """

    def __init__(
        self,
        mesh: skfem.MeshHex,
        winding: Winding,
        thread: Thread,
        radius: float,
        length: float,
        points_per_turn: int,
    ) -> None:
        winding.refuse_overlap(thread)
        self.axial_stiffness = thread.axial_stiffness
        basis = skfem.Basis(mesh, skfem.ElementHex1(), intorder=1)
        hosts, weights, self.polylines = [], [], []
        count = 0
        pairs = []
        for line in winding.polylines(radius, length, points_per_turn):
            points = line * _MILLIMETRE
            # The cylinder is a polygon in the mesh; points on the end faces are nudged inside so as to be
            # found.
            inside = np.clip(points, [-np.inf, -np.inf, 1e-9], [np.inf, np.inf, length * _MILLIMETRE - 1e-9])
            cells, local = _locate(basis, inside)
            shape = np.stack([basis.elem.lbasis(local.T, a)[0] for a in range(8)], axis=-1)
            hosts.append(mesh.t[:, cells].T)
            weights.append(shape)
            index = count + np.arange(len(points))
            pairs.append(np.column_stack([index[:-1], index[1:]]))
            self.polylines.append(index)
            count += len(points)
        self._host = np.concatenate(hosts) if hosts else np.empty((0, 8), int)
        self._weight = np.concatenate(weights) if weights else np.empty((0, 8))
        #: The two points of every segment.
        self.segments = ends = np.concatenate(pairs) if pairs else np.empty((0, 2), int)
        self.connectivity = self._host[ends].reshape(len(ends), 16)
        # x_b − x_a = Σ_c coefficient_c x_c over the sixteen host nodes.
        self._coefficient = np.concatenate([-self._weight[ends[:, 0]], self._weight[ends[:, 1]]], axis=1)
        self.rest_length = np.linalg.norm(self._span(mesh.p.T), axis=1)

    def __len__(self) -> int:
        return len(self.connectivity)

    def points(self, positions: Float[np.ndarray, "nodes 3"]) -> Float[np.ndarray, "points 3"]:
        """Current positions of the thread's points [mm], indexed by ``polylines``."""
        return np.einsum("pa,pai->pi", self._weight, positions[self._host])

    def _span(self, positions: Float[np.ndarray, "nodes 3"]) -> Float[np.ndarray, "segments 3"]:
        return np.einsum("sc,sci->si", self._coefficient, positions[self.connectivity])

    def tension(self, positions: Float[np.ndarray, "nodes 3"]) -> Float[np.ndarray, " segments"]:
        """Constitutive tension EA (l/L0 − 1) [N]."""
        return self.axial_stiffness * (np.linalg.norm(self._span(positions), axis=1) / self.rest_length - 1.0)

    def energy(self, positions: Float[np.ndarray, "nodes 3"]) -> float:
        """Stretch energy [N mm]."""
        return float((self.tension(positions) ** 2 * self.rest_length).sum() / (2.0 * self.axial_stiffness))

    def response(
        self, positions: Float[np.ndarray, "nodes 3"], tension: Float[np.ndarray, " segments"] | None = None
    ) -> tuple[
        Float[np.ndarray, "segments 48"],
        Float[np.ndarray, "segments 48 48"],
        Float[np.ndarray, "segments 48"],
    ]:
        """Forces, tangents and ∂l/∂x of the segments on their sixteen host nodes.

        Parameters
        ----------
        positions : current positions of the nodes [mm].
        tension : of the tangent's geometric part [N]; by default the constitutive one (exact Hessian).
        """
        span = self._span(positions)
        length = np.linalg.norm(span, axis=1)
        direction = span / length[:, None]
        constitutive = self.axial_stiffness * (length / self.rest_length - 1.0)
        if tension is None:
            tension = constitutive
        length_gradient = (self._coefficient[:, :, None] * direction[:, None, :]).reshape(len(self), 48)
        force = constitutive[:, None] * length_gradient
        geometric = (tension / length)[:, None, None] * np.eye(3) + (
            self.axial_stiffness / self.rest_length - tension / length
        )[:, None, None] * (direction[:, :, None] * direction[:, None, :])
        outer = self._coefficient[:, :, None, None, None] * self._coefficient[:, None, None, :, None]
        stiffness = (outer * geometric[:, None, :, None, :]).reshape(len(self), 48, 48)
        return force, stiffness, length_gradient


# Elements nearest by their centres among which a point's host is sought, and how far outside the reference
# cube a point may lie by round-off.
_CANDIDATES = 24
_OUTSIDE = 1e-6
# Of the inverse map: quadratic convergence, from the centre of a nearly rectangular element.
_NEWTON_STEPS = 6


def _locate(
    basis: skfem.Basis, points: Float[np.ndarray, "points 3"]
) -> tuple[Int[np.ndarray, " points"], Float[np.ndarray, "points 3"]]:
    """Host element of every point, and its coordinates there. Of several hosts, the nearest centre's.

    Raises
    ------
    ValueError
        For points outside the mesh.
    """
    mesh = basis.mesh
    _, nearest = cKDTree(mesh.p[:, mesh.t].mean(axis=1).T).query(points, k=min(_CANDIDATES, mesh.nelements))
    cells = np.full(len(points), -1)
    local = np.zeros((len(points), 3))
    corner = mesh.p[:, mesh.t]
    low, high = corner.min(axis=1).T - _OUTSIDE, corner.max(axis=1).T + _OUTSIDE
    for candidate in nearest.T:
        boxed = ((points >= low[candidate]) & (points <= high[candidate])).all(axis=1)
        open_ = np.flatnonzero((cells < 0) & boxed)
        reference = _inverse(basis.mapping, points[open_], candidate[open_])
        inside = ((reference > -_OUTSIDE) & (reference < 1.0 + _OUTSIDE)).all(axis=1)
        cells[open_[inside]] = candidate[open_[inside]]
        local[open_[inside]] = reference[inside]
    if (cells < 0).any():
        lost = points[np.argmin(cells)]
        raise ValueError(
            f"winding: got a point at {np.round(lost, 3)} mm, expected all inside the body's mesh"
        )
    return cells, local


def _inverse(
    mapping: skfem.mapping.Mapping, points: Float[np.ndarray, "points 3"], cells: Int[np.ndarray, " points"]
) -> Float[np.ndarray, "points 3"]:
    """Reference coordinates of points in elements; not clipped to these, as scikit-fem's own are."""
    reference = np.full((3, len(points), 1), 0.5)
    for _ in range(_NEWTON_STEPS):
        gap = points.T[:, :, None] - mapping.F(reference, cells)
        reference = reference + np.einsum("ijkl,jkl->ikl", mapping.invDF(reference, cells), gap)
    return reference[:, :, 0].T
