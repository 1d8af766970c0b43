"""Primal-dual stiffness of wall pairs in contact, for a barrier potential.

The force f(d) of a barrier grows like 1/d where walls are close. Newton's method with the slope f'(d)
overshoots where the gap was wide, and at most doubles a narrow gap in one step. The pair force λ is therefore
a separate unknown while iterating, as in primal-dual interior-point methods; each step predicts its value.
Newton's step for λ d = d f(d) has the stiffness −f'(d) + (λ − f)/d, which for f = c/d is λ/d. The forces, and
so the equilibrium, remain those of the barrier; where λ and f agree, the stiffness is f' itself.

References
----------
Nocedal and Wright (2006), Numerical Optimization, §19.3. Li et al. (2020), Incremental Potential Contact, for
the barrier b = −(s − 1)² ln s of the squared distance, s = (d/d̂)².
"""

from dataclasses import dataclass, replace

import ipctk
import numpy as np
from jaxtyping import Float, Int

# A new pair starts with the barrier force at this fraction of the activation distance, or its own, if less.
_NEW_PAIR_DISTANCE = 0.3
# One step reduces the predicted force of a pair to no less than this fraction.
_MIN_FORCE_RATIO = 0.1
# λ and f agree if they differ by less than this fraction of f.
_AGREEMENT = 0.05


def barrier_force(
    distance: Float[np.ndarray, " pairs"], activation: float, stiffness: float
) -> tuple[Float[np.ndarray, " pairs"], Float[np.ndarray, " pairs"]]:
    """Return f(d) and −f'(d) per area [MPa, MPa/mm]; zero beyond the activation distance [mm]."""
    s = np.minimum(distance / activation, 1.0) ** 2
    log = np.log(s)
    slope = 2.0 * (1.0 - s) * log - (1.0 - s) ** 2 / s
    curve = -2.0 * log + 4.0 * (1.0 - s) / s + ((1.0 - s) / s) ** 2
    force = -2.0 * stiffness * distance / activation * slope
    return force, stiffness / activation * (4.0 * s * curve + 2.0 * slope)


@dataclass(frozen=True)
class WallPairs:
    """Wall pairs within the activation distance, at one iterate.

    Parameters
    ----------
    vertices : positions of the walls' vertices [mm].
    kinds : 0 vertex–vertex, 1 edge–vertex, 2 edge–edge, 3 face–vertex.
    members : the pairs' vertices; pairs with fewer than four are padded by 0, with a gradient of zero.
    gradient : derivative of the distance by those vertices.
    area : area of each pair [mm²]; reduced where parallel edges share it.
    distance : distance d [mm].
    force : barrier force f [MPa].
    law : −f' [MPa/mm].
    stiffness : stiffness in Newton's step, from λ [MPa/mm].
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
        """Kind and vertices, which identify a pair at all iterates."""
        return np.column_stack([self.kinds, self.members])

    def expected(
        self, vertices: np.ndarray, names: Int[np.ndarray, "others 5"]
    ) -> Float[np.ndarray, " others"]:
        """Predict λ [MPa] of the named pairs after a move to other ``vertices``; NaN for unknown pairs."""
        moved = (vertices - self.vertices)[self.members]
        force = self.force - self.stiffness * np.einsum("pai,pai->p", self.gradient, moved)
        _, number = np.unique(np.concatenate([self.names, names]), axis=0, return_inverse=True)
        known = np.full(len(number), np.nan)
        known[number[: len(force)]] = np.maximum(force, _MIN_FORCE_RATIO * self.force)
        return known[number[len(force) :]]

    def change(self) -> tuple[np.ndarray, np.ndarray]:
        """Return the pairs whose stiffness differs from the law's, as vertices and matrices of the change."""
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
    """Return the pairs of a set of collisions.

    Parameters
    ----------
    collisions, mesh, vertices : collision set, mesh and vertices of ipctk.
    activation, stiffness : the barrier's activation distance [mm] and stiffness [MPa].
    before : pairs of the last iterate; without them the stiffness is the law's.
    """
    found = [_measure(pairs, mesh, vertices) for pairs in _by_kind(collisions)]
    kinds = np.repeat(np.arange(len(found)), [len(members) for members, *_ in found])
    members, distance, gradient, area = (np.concatenate(parts) for parts in zip(*found, strict=True))
    force, law = barrier_force(distance, activation, stiffness)
    pairs = WallPairs(vertices, kinds, members, gradient, area, distance, force, law, law)
    if before is None:
        return pairs
    new, _ = barrier_force(np.maximum(distance, _NEW_PAIR_DISTANCE * activation), activation, stiffness)
    known = before.expected(vertices, pairs.names)
    expected = np.where(np.isnan(known), new, known)
    excess = np.where(np.abs(expected - force) > _AGREEMENT * force, expected - force, 0.0)
    return replace(pairs, stiffness=np.maximum(law + excess / distance, 0.0))


def _by_kind(collisions: ipctk.NormalCollisions) -> tuple[list, list, list, list]:
    """Return the pairs of each kind, in the order of `WallPairs`.

    They refer into ``collisions`` and must not outlive it.
    """
    return (
        collisions.vv_collisions,
        collisions.ev_collisions,
        collisions.ee_collisions,
        collisions.fv_collisions,
    )


def pair_vertices(pairs: list, mesh: ipctk.CollisionMesh) -> Int[np.ndarray, "pairs _"]:
    """Return the vertices of pairs of one kind, in ipctk's order.

    A call of ipctk for the vertices of each pair would take as long as all other calls together.
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


def _measure(
    pairs: list, mesh: ipctk.CollisionMesh, vertices: np.ndarray
) -> tuple[
    Int[np.ndarray, "pairs 4"],
    Float[np.ndarray, " pairs"],
    Float[np.ndarray, "pairs 4 3"],
    Float[np.ndarray, " pairs"],
]:
    """Return vertices, distances, gradients and areas of pairs of one kind."""
    own = pair_vertices(pairs, mesh)
    count, size = own.shape
    members, shares = np.zeros((count, 4), int), np.zeros((count, 4))
    members[:, :size] = own
    places = vertices[own].reshape(count, 3 * size)
    # The vector between the closest points is Σ c_a x_a. Its length is stationary in the c_a.
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
