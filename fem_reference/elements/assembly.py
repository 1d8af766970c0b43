"""Sum of named force groups and of the walls' contact: energy, residual forces and sparse stiffness.

Groups act on points: nodes of the mesh, and where there is one the control points of the core's curve. The
sparse system is in unknowns; `Unknowns` says how these move the points.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Protocol

import numpy as np
import scipy.sparse as sparse
from jaxtyping import Float, Int

from fem_reference.algebra import SparsePattern, scatter
from fem_reference.elements.chamber import Chamber
from fem_reference.elements.force_group import FollowerPressure, ForceGroup, Own, Points, StiffGroup
from fem_reference.walls import WallContact, WallPairs

#: Rows, columns and values of a matrix's upper triangle.
Entries = tuple[Int[np.ndarray, " n"], Int[np.ndarray, " n"], Float[np.ndarray, " n"]]


class Unknowns(Protocol):
    """How matrices over points become matrices over unknowns."""

    def blocks(
        self, connectivity: Int[np.ndarray, "elements points"], stiffness: Float[np.ndarray, "elements n n"]
    ) -> Float[np.ndarray, "elements n n"]:
        """Local matrices over the unknowns that the pattern numbers an element's points by."""
        ...

    def entries(self, matrix: sparse.spmatrix) -> Entries:
        """Upper triangle, over the unknowns, of a matrix over all components of all points."""
        ...


@dataclass(frozen=True)
class Assembled:
    """Sum of all groups at given positions.

    Parameters
    ----------
    force : on every point [N].
    data : of the stiffness, in the pattern.
    wall_stiffness, pairs : of walls in contact, over all components of all points; None where there are none.
    laws, gradients : by the group's name, what its own forces' update needs (see `Response`).
    """

    force: Points
    data: Float[np.ndarray, " nonzeros"]
    wall_stiffness: sparse.csr_matrix | None
    pairs: WallPairs | None
    laws: Mapping[str, Own | None]
    gradients: Mapping[str, Own]


def local_dofs(
    groups: Mapping[str, ForceGroup],
    number: Callable[[Int[np.ndarray, "elements points"]], Int[np.ndarray, "elements dofs"]],
) -> dict[str, Int[np.ndarray, "elements dofs"]]:
    """Unknowns of every group's elements, by the group's name; −1 for points of no weight."""
    numbered = {}
    for name, group in groups.items():
        dofs = number(group.connectivity)
        if group.padding is not None:
            dofs = np.where(group.padding.repeat(3, axis=1), -1, dofs)
        numbered[name] = dofs
    return numbered


def pressure_groups(
    chambers: list[Chamber], pressure: Float[np.ndarray, " chambers"]
) -> dict[str, FollowerPressure]:
    """The chambers' follower pressures [MPa], a group for each patch."""
    return {
        name: FollowerPressure(patch, float(p))
        for p, chamber, names in zip(pressure, chambers, patch_names(chambers), strict=True)
        for name, patch in zip(names, chamber.patches, strict=True)
    }


def patch_names(chambers: list[Chamber]) -> list[list[str]]:
    """Names of `pressure_groups`, chamber by chamber."""
    return [[f"chamber {k}, patch {j}" for j, _ in enumerate(c.patches)] for k, c in enumerate(chambers)]


def total_energy(groups: Mapping[str, ForceGroup], walls: WallContact, positions: Points) -> float:
    """Energy of all groups and of the walls' contact [N mm]."""
    return sum(group.energy(positions) for group in groups.values()) + walls.energy(positions)


def assemble_forces(
    groups: Mapping[str, ForceGroup], walls: WallContact, positions: Points, own: Mapping[str, Own]
) -> tuple[Points, dict[str, Own | None], bool]:
    """Force on every point [N], the own forces' laws, and whether walls touch."""
    of_walls = walls.force(positions)
    force = np.zeros_like(positions) if of_walls is None else of_walls
    laws: dict[str, Own | None] = {}
    for name, group in groups.items():
        local, law = group.force(positions, own.get(name))
        force += scatter(group.connectivity, local, len(positions))
        if name in own:
            laws[name] = law
    return force, laws, of_walls is not None


def assemble(
    groups: Mapping[str, ForceGroup],
    walls: WallContact,
    positions: Points,
    own: Mapping[str, Own],
    pattern: SparsePattern,
    unknowns: Unknowns,
    before: WallPairs | None = None,
) -> Assembled:
    """Forces and stiffness.

    Parameters
    ----------
    groups, walls : what is summed.
    positions : of all points.
    own : own forces by the group's name. A stiff group without an entry takes those of its law.
    pattern : of the stiffness; it grows where walls have come near each other.
    unknowns : of the sparse system.
    before : pairs of walls where the last step began; see `pair_forces`.
    """
    contact = walls.iterate(positions, before)
    force = np.zeros_like(positions)
    if contact is not None:
        force += contact[0]
        entries = unknowns.entries(contact[1])
        pattern.cover(*entries[:2], lambda: unknowns.entries(walls.neighbours(positions))[:2])
    data = np.zeros(len(pattern))
    if contact is not None:
        pattern.add_entries(data, *entries)
    laws: dict[str, Own | None] = {}
    gradients: dict[str, Own] = {}
    for name, group in groups.items():
        local, stiffness, law, gradient = group.response(positions, own.get(name))
        force += scatter(group.connectivity, local, len(positions))
        pattern.add_group(data, name, unknowns.blocks(group.connectivity, stiffness))
        if gradient is not None:
            laws[name], gradients[name] = law, gradient
    _, wall_stiffness, pairs = contact or (None, None, None)
    return Assembled(force, data, wall_stiffness, pairs, laws, gradients)


def convexified(
    data: Float[np.ndarray, " nonzeros"],
    walls: WallContact,
    positions: Points,
    pattern: SparsePattern,
    unknowns: Unknowns,
) -> Float[np.ndarray, " nonzeros"]:
    """The stiffness' data with the walls' contact made convex, pair by pair."""
    convex = data.copy()
    concave = walls.concave_part(positions)
    if concave is not None:
        pattern.add_entries(convex, *unknowns.entries(-concave))
    return convex


def own_after(
    groups: Mapping[str, StiffGroup],
    own: Mapping[str, Own],
    laws: Mapping[str, Own | None],
    gradients: Mapping[str, Own],
    positions: Points,
    move: Points,
    fraction: float,
) -> dict[str, Own]:
    """Own forces after a fraction of a Newton step that begins at ``positions`` with ``own``."""
    after = {}
    for name, group in groups.items():
        whole = group.own_after(positions, own[name], laws[name], gradients[name], move)
        after[name] = own[name] + fraction * (whole - own[name])
    return after
