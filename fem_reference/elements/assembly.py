"""Assembly of named force groups and wall contact: energy, residual forces and sparse stiffness.

Groups act on points: the nodes of the mesh and, in the actuator, the control points of the rod's curve. The
sparse system is in unknowns; `Unknowns` maps matrices over points to matrices over unknowns.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Protocol, runtime_checkable

import numpy as np
import scipy.sparse as sparse
from jaxtyping import Float, Int

from fem_reference.algebra import SparsePattern, scatter
from fem_reference.elements.chamber import Chamber
from fem_reference.elements.force_group import (
    DisplacementGroup,
    FollowerPressure,
    ForceGroup,
    Own,
    Points,
    SolidGroup,
    StiffGroup,
    ThreadGroup,
)
from fem_reference.elements.solid import SolidElements
from fem_reference.elements.thread import ThreadSegments
from fem_reference.elements.thread_bending import ThreadBending
from fem_reference.geometry import Thread, Units
from fem_reference.walls import WallContact, WallPairs

#: Rows, columns and values of a matrix's upper triangle.
Entries = tuple[Int[np.ndarray, " n"], Int[np.ndarray, " n"], Float[np.ndarray, " n"]]


@runtime_checkable
class Unknowns(Protocol):
    """Map from matrices over points to matrices over unknowns."""

    def blocks(
        self, connectivity: Int[np.ndarray, "elements points"], stiffness: Float[np.ndarray, "elements n n"]
    ) -> Float[np.ndarray, "elements n n"]:
        """Return element matrices over the unknowns of each element's points."""
        ...

    def entries(self, matrix: sparse.spmatrix) -> Entries:
        """Return the upper triangle, over unknowns, of a matrix over all components of all points."""
        ...


@dataclass(frozen=True)
class Assembled:
    """Sum of all groups at given positions.

    Parameters
    ----------
    force : force on every point [N].
    data : values of the stiffness in the sparsity pattern.
    wall_stiffness : contact stiffness over all components of all points; None without contact.
    pairs : wall pairs in contact; None without contact.
    laws, gradients : by group name, the parts of `Response` that update its own forces.
    """

    force: Points
    data: Float[np.ndarray, " nonzeros"]
    wall_stiffness: sparse.csr_matrix | None
    pairs: WallPairs | None
    laws: Mapping[str, Own]
    gradients: Mapping[str, Own]


def body_groups(
    solid: SolidElements,
    segments: ThreadSegments,
    thread: Thread,
    rest: Float[np.ndarray, "nodes 3"],
    units: Units,
    is_periodic: bool = False,
) -> dict[str, ForceGroup]:
    """Return the groups of silicone and thread, and that of the thread's bending if it resists bending.

    Parameters
    ----------
    solid, segments : elements of silicone and thread.
    thread : the thread itself.
    rest, is_periodic : see `ThreadBending`.
    units : of the body.
    """
    groups: dict[str, ForceGroup] = {"solid": SolidGroup(solid), "thread": ThreadGroup(segments)}
    if thread.bends:
        stiffness = thread.bending_stiffness / units.newton * units.metre**2
        bending = ThreadBending(segments, rest, stiffness, is_periodic)
        groups["thread bending"] = DisplacementGroup(bending, bending.padding)
    return groups


def local_dofs(
    groups: Mapping[str, ForceGroup],
    number: Callable[[Int[np.ndarray, "elements points"]], Int[np.ndarray, "elements dofs"]],
) -> dict[str, Int[np.ndarray, "elements dofs"]]:
    """Return the unknowns of every group's elements by group name; −1 for points without weight."""
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
    """Return the chambers' follower pressures [MPa] as one group per patch."""
    return {
        name: FollowerPressure(patch, float(p))
        for p, chamber, names in zip(pressure, chambers, patch_names(chambers), strict=True)
        for name, patch in zip(names, chamber.patches, strict=True)
    }


def patch_names(chambers: list[Chamber]) -> list[list[str]]:
    """Return the names of `pressure_groups`, chamber by chamber."""
    return [[f"chamber {k}, patch {j}" for j, _ in enumerate(c.patches)] for k, c in enumerate(chambers)]


def total_energy(groups: Mapping[str, ForceGroup], walls: WallContact, positions: Points) -> float:
    """Return the energy of all groups and of wall contact [N mm]."""
    return sum(group.energy(positions) for group in groups.values()) + walls.energy(positions)


def assemble_forces(
    groups: Mapping[str, ForceGroup], walls: WallContact, positions: Points, own: Mapping[str, Own]
) -> tuple[Points, dict[str, Own], bool]:
    """Return the force on every point [N], the laws of the own forces, and whether walls touch."""
    wall_force = walls.force(positions)
    force = np.zeros_like(positions) if wall_force is None else wall_force
    laws: dict[str, Own] = {}
    for name, group in groups.items():
        local, law = group.force(positions, own.get(name))
        force += scatter(group.connectivity, local, len(positions))
        if name in own:
            laws[name] = law
    return force, laws, wall_force is not None


def assemble(
    groups: Mapping[str, ForceGroup],
    walls: WallContact,
    positions: Points,
    own: Mapping[str, Own],
    pattern: SparsePattern,
    unknowns: Unknowns,
    before: WallPairs | None = None,
) -> Assembled:
    """Assemble forces and stiffness.

    Parameters
    ----------
    groups, walls : force groups and wall contact to sum.
    positions : positions of all points.
    own : own forces by group name. A stiff group without an entry uses those of its law.
    pattern : sparsity pattern of the stiffness; it grows where walls have come near each other.
    unknowns : map to the unknowns of the sparse system.
    before : wall pairs at the start of the last step; see `pair_forces`.
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
    laws: dict[str, Own] = {}
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
    """Return the stiffness data with every wall pair's negative eigenvalues removed."""
    convex = data.copy()
    concave = walls.concave_part(positions)
    if concave is not None:
        pattern.add_entries(convex, *unknowns.entries(-concave))
    return convex


def own_after(
    groups: Mapping[str, StiffGroup],
    own: Mapping[str, Own],
    laws: Mapping[str, Own],
    gradients: Mapping[str, Own],
    positions: Points,
    move: Points,
    fraction: float,
) -> dict[str, Own]:
    """Return the own forces after a fraction of a Newton step from ``positions`` with ``own``."""
    after = {}
    for name, group in groups.items():
        full_step = group.own_after(positions, own[name], laws[name], gradients[name], move)
        after[name] = own[name] + fraction * (full_step - own[name])
    return after
