"""Self-contact of the chamber walls by the IPC barrier of `ipctk`.

The walls are split into triangles. The barrier acts below the activation distance of 0.05 mm. Lengths mm,
stresses MPa.

References
----------
Li et al. (2020), Incremental Potential Contact; the `ipctk` library.
"""

import ipctk
import numpy as np
import scipy.sparse as sparse
from jaxtyping import Float, Int

from fem_reference.walls.pair_forces import WallPairs, pair_vertices, wall_pairs

ACTIVATION = 0.05
# Stress scale of the area-weighted barrier. The bending angle at 60 kPa changes by 0.5 % when it is divided
# by ten.
STIFFNESS = 0.02
# Walls within this many activation distances are neighbours in the sparsity pattern: they may soon touch.
_NEAR = 3.0
# Fixed random offset of each vertex [mm]. An extruded mesh has many exactly parallel edges, for which
# round-off would decide the kind of an edge pair, and with it a part of the barrier.
TIE_BREAK = 1e-4
# Distance [mm] at which walls are kept that a step would bring through each other, …
_KEPT_DISTANCE = 0.3 * ACTIVATION
# … or this fraction of their distance at the start of the step, if smaller.
_KEPT_FRACTION = 0.4
# Rounds of collision detection, and projection sweeps over the blocked pairs in each round.
_ROUNDS = 8
_SWEEPS = 40
# Blocked pairs are looked for at this fraction of the way to the first touch.
_NEAR_TOUCH = 0.9
# Margin of the broad phase [mm]: candidates are found from straight edges, while an edge may move on an arc.
# The difference is 0.007 mm at 0.1/mm, twice the curvature of a half turn, with edges stretched to 0.75 mm.
_BROAD_PHASE_MARGIN = 0.02

#: Positions of all nodes at the start and the end of a step [mm].
ContactPath = tuple[Float[np.ndarray, "nodes 3"], Float[np.ndarray, "nodes 3"]]


class WallContact:
    """Self-contact of the chambers' walls.

    Parameters
    ----------
    rest : reference positions of all nodes [mm].
    quads : oriented wall facets of all chambers, by their nodes.
    """

    def __init__(self, rest: Float[np.ndarray, "nodes 3"], quads: Int[np.ndarray, "facets 4"]) -> None:
        self.nodes, local = np.unique(quads, return_inverse=True)
        local = local.reshape(-1, 4)
        self._offset = TIE_BREAK * np.random.default_rng(0).uniform(-1.0, 1.0, (len(self.nodes), 3))
        self.triangles = _mirror_symmetric_split(rest[quads], local).astype(np.int32)
        sides = np.concatenate(
            [self.triangles[:, [0, 1]], self.triangles[:, [1, 2]], self.triangles[:, [2, 0]]]
        )
        edges = np.unique(np.sort(sides, axis=1), axis=0)
        self._mesh = ipctk.CollisionMesh(np.asfortranarray(rest[self.nodes]), edges, self.triangles)
        # One thread sums in a fixed order: equal positions give bitwise equal forces.
        ipctk.set_num_threads(1)
        self._potential = ipctk.BarrierPotential(ACTIVATION, STIFFNESS, use_physical_barrier=True)
        self._last: tuple[np.ndarray, ipctk.NormalCollisions, sparse.csr_matrix] | None = None

    def _vertices(self, positions: Float[np.ndarray, "nodes 3"]) -> np.ndarray:
        return np.asfortranarray(positions[self.nodes] + self._offset)

    def _collisions(self, vertices: np.ndarray, reach: float = ACTIVATION) -> ipctk.NormalCollisions:
        collisions = ipctk.NormalCollisions()
        collisions.use_area_weighting = True
        collisions.collision_set_type = ipctk.NormalCollisions.IMPROVED_MAX_APPROX
        collisions.build(self._mesh, vertices, reach)
        return collisions

    def energy(self, positions: Float[np.ndarray, "nodes 3"]) -> float:
        """Return the barrier energy [N mm]."""
        vertices = self._vertices(positions)
        return float(self._potential(self._collisions(vertices), self._mesh, vertices))

    def force(self, positions: Float[np.ndarray, "nodes 3"]) -> Float[np.ndarray, "nodes 3"] | None:
        """Return the force on all nodes [N]; None if no walls are near."""
        vertices = self._vertices(positions)
        collisions = self._collisions(vertices)
        return None if collisions.empty() else self._force(collisions, vertices, positions)

    def iterate(
        self, positions: Float[np.ndarray, "nodes 3"], before: WallPairs | None
    ) -> tuple[Float[np.ndarray, "nodes 3"], sparse.csr_matrix, WallPairs] | None:
        """Return force on all nodes, stiffness over all components, and pairs; None if no walls are near.

        The stiffness is the Hessian, or with the pairs ``before`` that of `pair_forces`.
        """
        vertices, collisions, hessian = self._with_hessian(positions)
        if collisions.empty():
            return None
        force = self._force(collisions, vertices, positions)
        pairs = wall_pairs(collisions, self._mesh, vertices, ACTIVATION, STIFFNESS, before)
        members, local = pairs.change()
        dofs = (3 * self.nodes[members][:, :, None] + np.arange(3)).reshape(len(members), 12)
        rows, columns = np.repeat(dofs, 12, axis=1).ravel(), np.tile(dofs, (1, 12)).ravel()
        change = sparse.csr_matrix((local.ravel(), (rows, columns)), shape=hessian.shape)
        return force, hessian + change, pairs

    def concave_part(self, positions: Float[np.ndarray, "nodes 3"]) -> sparse.csr_matrix | None:
        """Return the part of the Hessian with each pair's negative eigenvalues; None if no walls are near."""
        vertices, collisions, hessian = self._with_hessian(positions)
        if collisions.empty():
            return None
        convex = ipctk.PSDProjectionMethod.CLAMP
        return hessian - self._hessian(collisions, vertices, positions.size, convex)

    def _with_hessian(
        self, positions: Float[np.ndarray, "nodes 3"]
    ) -> tuple[np.ndarray, ipctk.NormalCollisions, sparse.csr_matrix]:
        """Return vertices, collisions and Hessian; cached, as the concave part is usually needed next."""
        vertices = self._vertices(positions)
        if self._last is None or not np.array_equal(self._last[0], vertices):
            collisions, unchanged = self._collisions(vertices), ipctk.PSDProjectionMethod.NONE
            hessian = self._hessian(collisions, vertices, positions.size, unchanged)
            self._last = vertices, collisions, hessian
        return self._last

    def neighbours(self, positions: Float[np.ndarray, "nodes 3"]) -> sparse.csr_matrix:
        """Return a matrix over all components with entries where the Hessian has some, or soon may.

        It couples all vertices of faces and edges that are near each other, because the closest pairs among
        them change with every step.
        """
        vertices, reach = self._vertices(positions), _NEAR * ACTIVATION
        candidates = ipctk.Candidates()
        candidates.build(self._mesh, vertices, reach / 2.0)
        near, count = [], len(self.nodes)
        for pairs in (candidates.fv_candidates, candidates.ee_candidates):
            own = pair_vertices(pairs, self._mesh)
            places = vertices[own].reshape(-1, 12)
            squares = [pair.compute_distance(place) for pair, place in zip(pairs, places, strict=True)]
            near.append(own[np.array(squares) <= reach**2])
        members = np.concatenate(near)
        both = np.unique(members[:, :, None] * count + members[:, None, :])
        components = np.arange(3)
        rows, columns = np.broadcast_arrays(
            3 * self.nodes[both // count, None, None] + components[:, None],
            3 * self.nodes[both % count, None, None] + components,
        )
        size = positions.size
        return sparse.csr_matrix((np.ones(rows.size), (rows.ravel(), columns.ravel())), shape=(size, size))

    def _force(
        self, collisions: ipctk.NormalCollisions, vertices: np.ndarray, positions: np.ndarray
    ) -> Float[np.ndarray, "nodes 3"]:
        force = np.zeros_like(positions)
        force[self.nodes] = self._potential.gradient(collisions, self._mesh, vertices).reshape(-1, 3)
        return force

    def _hessian(
        self,
        collisions: ipctk.NormalCollisions,
        vertices: np.ndarray,
        size: int,
        projection: ipctk.PSDProjectionMethod,
    ) -> sparse.csr_matrix:
        local = self._potential.hessian(collisions, self._mesh, vertices, projection).tocoo()
        dofs = (3 * self.nodes[:, None] + np.arange(3)).ravel()
        return sparse.csr_matrix((local.data, (dofs[local.row], dofs[local.col])), shape=(size, size))

    def step_limit(
        self,
        start: Float[np.ndarray, "nodes 3"],
        end: Float[np.ndarray, "nodes 3"],
        broad_phase: ContactPath | None = None,
    ) -> float:
        """Return the largest fraction of the straight step from ``start`` to ``end`` before walls touch.

        Candidate pairs are found on the step itself, or on the ``broad_phase`` positions, which may have the
        body's bending removed so that less moves. Times of contact always come from the step itself, because
        straight edges become arcs when bending is removed.
        """
        first, last = self._vertices(start), self._vertices(end)
        candidates = self._candidates(first, last, broad_phase)
        return float(candidates.compute_collision_free_stepsize(self._mesh, first, last))

    def _candidates(
        self, first: np.ndarray, last: np.ndarray, broad_phase: ContactPath | None
    ) -> ipctk.Candidates:
        candidates = ipctk.Candidates()
        if broad_phase is None:
            candidates.build(self._mesh, first, last)
        else:
            start, end = (self._vertices(positions) for positions in broad_phase)
            candidates.build(self._mesh, start, end, _BROAD_PHASE_MARGIN)
        return candidates

    def keep_walls_apart(
        self,
        start: Float[np.ndarray, "nodes 3"],
        end: Float[np.ndarray, "nodes 3"],
        broad_phase: ContactPath | None = None,
    ) -> Float[np.ndarray, "nodes 3"] | None:
        """Return a displacement to add to ``end`` so that walls do not pass through each other in the step.

        It moves only the walls' nodes, along the pairs' normals, by projection as in position-based dynamics.
        The corrected step may still be blocked. None if no walls collide. For ``broad_phase`` see
        `step_limit`.

        References
        ----------
        Müller et al. (2007), Position based dynamics, §3.3.
        """
        first, wanted = self._vertices(start), self._vertices(end)
        last, candidates = wanted, self._candidates(first, wanted, broad_phase)
        for _ in range(_ROUNDS):
            touch = candidates.compute_collision_free_stepsize(self._mesh, first, last)
            if touch >= 1.0:
                break
            near = np.asfortranarray(first + _NEAR_TOUCH * touch * (last - first))
            last = self._separate(first, near, last)
        if last is wanted:
            return None
        correction = np.zeros_like(end)
        correction[self.nodes] = last - wanted
        return correction

    def _separate(self, first: np.ndarray, near: np.ndarray, last: np.ndarray) -> np.ndarray:
        """Return ``last`` with the pairs that are close at ``near`` moved to the distance that they keep."""
        pairs = wall_pairs(
            self._collisions(near, _NEAR * ACTIVATION), self._mesh, near, ACTIVATION, STIFFNESS, None
        )
        members, gradient = pairs.members, pairs.gradient

        def distance(at: np.ndarray) -> np.ndarray:
            return pairs.distance + np.einsum("pai,pai->p", gradient, (at - near)[members])

        kept = np.minimum(_KEPT_DISTANCE, _KEPT_FRACTION * np.maximum(distance(first), pairs.distance))
        weight = np.einsum("pai,pai->p", gradient, gradient)
        moved = last.copy()
        for _ in range(_SWEEPS):
            short = kept - distance(moved)
            close = short > 1e-3 * kept
            if not close.any():
                break
            push = (short[close] / weight[close])[:, None, None] * gradient[close]
            total, count = np.zeros_like(moved), np.zeros(len(moved))
            np.add.at(total, members[close], push)
            np.add.at(count, members[close], np.abs(gradient[close]).max(axis=2) > 0.0)
            moved += total / np.maximum(count, 1.0)[:, None]
        return np.asfortranarray(moved)

    def intersects(self, positions: Float[np.ndarray, "nodes 3"]) -> bool:
        """Return whether walls pass through each other."""
        return bool(ipctk.has_intersections(self._mesh, self._vertices(positions)))

    def minimum_distance(self, positions: Float[np.ndarray, "nodes 3"]) -> float:
        """Return the smallest wall distance below the activation distance [mm]; infinite if there is none."""
        vertices = self._vertices(positions)
        collisions = self._collisions(vertices)
        return float(np.sqrt(collisions.compute_minimum_distance(self._mesh, vertices)))


def _mirror_symmetric_split(
    corner: Float[np.ndarray, "facets 4 3"], quads: Int[np.ndarray, "facets 4"]
) -> np.ndarray:
    """Split quadrilaterals into two triangles, symmetrically about every chamber's mid-plane."""
    azimuth = np.arctan2(corner[..., 1].mean(axis=1), corner[..., 0].mean(axis=1))
    third = 2.0 * np.pi / 3.0
    side = azimuth - third * np.round(azimuth / third) > 0.0
    # Start each cycle at a corner of the lower edge: the one with the smaller azimuth on one side, the larger
    # on the other.
    height = corner[..., 2] - corner[..., 2].mean(axis=1, keepdims=True)
    low = height < -1e-9
    lower_edge = low & np.roll(low, -1, axis=1)
    # A ceiling has no lower edge; any start is good there.
    start = np.argmax(lower_edge, axis=1) + side
    cycle = np.take_along_axis(quads, (start[:, None] + np.arange(4)) % 4, axis=1)
    return np.concatenate([cycle[:, [0, 1, 2]], cycle[:, [0, 2, 3]]])
