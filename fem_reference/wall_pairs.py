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

import math
from dataclasses import dataclass, replace
from typing import Any

import ipctk
import numpy as np
from jaxtyping import Float

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
    def names(self) -> list[tuple[int, ...]]:
        """The same for the same pair at another iterate."""
        return [tuple(row) for row in np.column_stack([self.kinds, self.members]).tolist()]

    def expected(self, vertices: np.ndarray) -> dict[tuple[int, ...], float]:
        """λ of these pairs after a move to other ``vertices`` [MPa]."""
        moved = (vertices - self.vertices)[self.members]
        force = self.force - self.stiffness * np.einsum("pai,pai->p", self.gradient, moved)
        return dict(zip(self.names, np.maximum(force, _LEAST * self.force).tolist(), strict=True))

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
    count = len(collisions)
    kinds, members = np.zeros(count, int), np.zeros((count, 4), int)
    distance, area, gradient = np.empty(count), np.empty(count), np.zeros((count, 4, 3))
    edges, faces, i = mesh.edges, mesh.faces, 0
    for kind, of_kind in enumerate(_by_kind(collisions)):
        kinds[i : i + len(of_kind)] = kind
        for pair in of_kind:
            found, distance[i], slope, area[i] = _measured(pair, vertices, edges, faces)
            members[i, : len(found)], gradient[i, : len(found)] = found, slope
            i += 1
    force, law = barrier_force(distance, activation, stiffness)
    pairs = WallPairs(vertices, kinds, members, gradient, area, distance, force, law, law)
    if before is None:
        return pairs
    wide = np.maximum(distance, _NEW * activation)
    new, known = barrier_force(wide, activation, stiffness)[0].tolist(), before.expected(vertices)
    expected = np.array([known.get(name, default) for name, default in zip(pairs.names, new, strict=True)])
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


def _measured(
    pair: Any, vertices: np.ndarray, edges: np.ndarray, faces: np.ndarray
) -> tuple[list[int], float, np.ndarray, float]:
    """Vertices of a pair, its distance, that one's gradient, and area."""
    points, size = pair.dof(vertices, edges, faces), pair.num_vertices()
    # ipctk's distances are squared ones.
    distance = math.sqrt(pair.compute_distance(points))
    gradient = pair.compute_distance_gradient(points).reshape(size, 3) / (2.0 * distance)
    area = pair.weight * (pair.mollifier(points) if pair.is_mollified() else 1.0)
    return pair.vertex_ids(edges, faces)[:size], distance, gradient, area
