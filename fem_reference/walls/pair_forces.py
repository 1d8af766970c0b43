"""Pairs of chamber walls in contact, and the forces between them that Newton's method expects.

A barrier's force f(d) grows like 1/d where walls are close. Newton's method, which takes f'(d) for its slope,
overshoots inwards where a gap was wide, and only doubles one that is too narrow with every step. The force of
a pair is therefore an unknown of its own while iterating, as in primal-dual interior-point methods: the last
step says what it will be, λ. Newton's step for λ d = d f(d) has the stiffness −f'(d) + (λ − f)/d, which for
f = c/d is λ/d. Forces stay those of the barrier, and so does the equilibrium; where λ and f agree, the
stiffness is the barrier's own.

References
----------
Nocedal and Wright (2006), Numerical Optimization, §19.3. Li et al. (2020), Incremental Potential Contact, for
the barrier b = −(s − 1)² ln s of the squared distance, s = (d/d̂)².
"""

from dataclasses import dataclass, replace

import ipctk
import numpy as np
from jaxtyping import Float, Int

# λ of a pair that was not there before: what it is at this share of the activation distance, or f if that is
# less; and the least of it that a step leaves of what was.
_NEW, _LEAST = 0.3, 0.1
# Difference of λ and f, as a share of f, that counts as none.
_AGREED = 0.05


def barrier_force(
    distance: Float[np.ndarray, " pairs"], activation: float, stiffness: float
) -> tuple[Float[np.ndarray, " pairs"], Float[np.ndarray, " pairs"]]:
    """f(d) and −f'(d) per area [MPa, MPa/mm]; zero beyond the activation distance [mm]."""
    s = np.minimum(distance / activation, 1.0) ** 2
    log = np.log(s)
    slope = 2.0 * (1.0 - s) * log - (1.0 - s) ** 2 / s
    curve = -2.0 * log + 4.0 * (1.0 - s) / s + ((1.0 - s) / s) ** 2
    force = -2.0 * stiffness * distance / activation * slope
    return force, stiffness / activation * (4.0 * s * curve + 2.0 * slope)


@dataclass(frozen=True)
class WallPairs:
    """Pairs within the activation distance, at one iterate.

    Parameters
    ----------
    vertices : of the walls [mm].
    kinds : 0 to 3, of vertex and vertex, edge and vertex, edge and edge, face and vertex.
    members : the pairs' vertices; beyond the first two or three, 0 and a gradient of zero.
    gradient : of the distance in those vertices.
    area : that each pair stands for [mm²]; less where parallel edges share it.
    distance : of each [mm].
    force : f of each [MPa].
    law, stiffness : −f' of each, and what it is taken for [MPa/mm].
    """

    vertices: np.ndarray
    kinds: np.ndarray
    members: np.ndarray
    gradient: Float[np.ndarray, "pairs 4 3"]
    area: Float[np.ndarray, " pairs"]
    distance: Float[np.ndarray, " pairs"]
    force: Float[np.ndarray, " pairs"]
    law: Float[np.ndarray, " pairs"]
    stiffness: Float[np.ndarray, " pairs"]

    @property
    def names(self) -> Int[np.ndarray, "pairs 5"]:
        """The same for the same pair at another iterate."""
        return np.column_stack([self.kinds, self.members])

    def expected(
        self, vertices: np.ndarray, names: Int[np.ndarray, "others 5"]
    ) -> Float[np.ndarray, " others"]:
        """λ of the pairs of these names after a move to other ``vertices`` [MPa]; NaN of those unknown."""
        moved = (vertices - self.vertices)[self.members]
        force = self.force - self.stiffness * np.einsum("pai,pai->p", self.gradient, moved)
        _, number = np.unique(np.concatenate([self.names, names]), axis=0, return_inverse=True)
        known = np.full(len(number), np.nan)
        known[number[: len(force)]] = np.maximum(force, _LEAST * self.force)
        return known[number[len(force) :]]

    def change(self) -> tuple[np.ndarray, np.ndarray]:
        """Vertices of the pairs whose stiffness is not the law's, and their local matrices, of change."""
        chosen = self.stiffness != self.law
        weight = self.area[chosen] * (self.stiffness - self.law)[chosen]
        gradient = self.gradient[chosen].reshape(-1, 12)
        return self.members[chosen], weight[:, None, None] * gradient[:, :, None] * gradient[:, None, :]


def wall_pairs(
    collisions: ipctk.NormalCollisions,
    mesh: ipctk.CollisionMesh,
    vertices: np.ndarray,
    activation: float,
    stiffness: float,
    before: WallPairs | None,
) -> WallPairs:
    """The pairs of a set of collisions.

    Parameters
    ----------
    collisions, mesh, vertices : of ipctk.
    activation [mm], stiffness [MPa] : of the barrier.
    before : the pairs of the last iterate; without them the stiffness is the law's.
    """
    found = [_measured(of_kind, mesh, vertices) for of_kind in _by_kind(collisions)]
    kinds = np.repeat(np.arange(len(found)), [len(members) for members, *_ in found])
    members, distance, gradient, area = (np.concatenate(parts) for parts in zip(*found, strict=True))
    force, law = barrier_force(distance, activation, stiffness)
    pairs = WallPairs(vertices, kinds, members, gradient, area, distance, force, law, law)
    if before is None:
        return pairs
    wide = np.maximum(distance, _NEW * activation)
    new, _ = barrier_force(wide, activation, stiffness)
    known = before.expected(vertices, pairs.names)
    expected = np.where(np.isnan(known), new, known)
    excess = np.where(np.abs(expected - force) > _AGREED * force, expected - force, 0.0)
    taken = np.maximum(law + excess / distance, 0.0)
    return replace(pairs, stiffness=taken)


def _by_kind(collisions: ipctk.NormalCollisions) -> tuple[list, list, list, list]:
    """The pairs of each kind, in the order of `WallPairs`.

    Python's handles of them may not outlive ``collisions``.
    """
    return (
        collisions.vv_collisions,
        collisions.ev_collisions,
        collisions.ee_collisions,
        collisions.fv_collisions,
    )


def pair_vertices(pairs: list, mesh: ipctk.CollisionMesh) -> Int[np.ndarray, "pairs _"]:
    """Vertices of pairs of one kind, as ipctk orders them.

    ipctk tells them of each pair by a call that takes as long as all else that is asked of it.
    """
    if not pairs:
        return np.zeros((0, 4), int)
    kind = pairs[0]
    if hasattr(kind, "face_id"):
        ids = np.array([(pair.vertex_id, pair.face_id) for pair in pairs])
        return np.column_stack([ids[:, 0], mesh.faces[ids[:, 1]]])
    if hasattr(kind, "edge0_id"):
        ids = np.array([(pair.edge0_id, pair.edge1_id) for pair in pairs])
        return np.column_stack([mesh.edges[ids[:, 0]], mesh.edges[ids[:, 1]]])
    if hasattr(kind, "edge_id"):
        ids = np.array([(pair.vertex_id, pair.edge_id) for pair in pairs])
        return np.column_stack([ids[:, 0], mesh.edges[ids[:, 1]]])
    return np.array([(pair.vertex0_id, pair.vertex1_id) for pair in pairs])


def _measured(
    pairs: list, mesh: ipctk.CollisionMesh, vertices: np.ndarray
) -> tuple[
    Int[np.ndarray, "pairs 4"],
    Float[np.ndarray, " pairs"],
    Float[np.ndarray, "pairs 4 3"],
    Float[np.ndarray, " pairs"],
]:
    """Vertices of pairs of one kind, their distances, these' gradients, and areas."""
    own = pair_vertices(pairs, mesh)
    count, size = own.shape
    members, shares = np.zeros((count, 4), int), np.zeros((count, 4))
    members[:, :size] = own
    places = vertices[own].reshape(count, 3 * size)
    # The vector between the closest points is Σ c_a x_a; as these are the closest, its length changes as if
    # the c_a stayed.
    each = list(zip(pairs, places, strict=True))
    if pairs:
        shares[:, :size] = [pair.compute_coefficients(place) for pair, place in each]
    between = np.einsum("pa,pai->pi", shares[:, :size], vertices[own])
    distance = np.linalg.norm(between, axis=1)
    gradient = shares[:, :, None] * (between / distance[:, None])[:, None]
    area = np.array([pair.weight for pair in pairs])
    if pairs and pairs[0].is_mollified():
        area *= [pair.mollifier(place) for pair, place in each]
    return members, distance, gradient, area
