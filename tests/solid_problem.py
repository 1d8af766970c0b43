"""Equilibrium of a body of hexahedra with some displacements given, for closed forms and made solutions."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float

from fem_reference import Ogden
from fem_reference.algebra import SparsePattern, scatter
from fem_reference.algebra.factorisation import PardisoSolver
from fem_reference.elements import SolidElements
from fem_reference.mesh import BodyMesh

FORCE_TOLERANCE = 1e-11
MAX_ITERATIONS = 40


@dataclass(frozen=True)
class SolvedBody:
    """Positions at equilibrium [mm], and the force of the supports on every node [N]."""

    positions: Float[np.ndarray, "nodes 3"]
    reaction: Float[np.ndarray, "nodes 3"]
    solid: SolidElements


def solve_body(
    mesh: BodyMesh,
    material: Ogden,
    start: Float[np.ndarray, "nodes 3"],
    held: Bool[np.ndarray, "nodes 3"],
    load: Float[np.ndarray, "nodes 3"],
) -> SolvedBody:
    """Newton's method from ``start``, whose held components are the given ones.

    The element pressures of the tangent follow the linearised volumes, which keeps it from overshooting.
    """
    solid, solver = SolidElements(mesh, material), PardisoSolver()
    free = np.flatnonzero(~held.ravel())
    number = np.full(held.size, -1)
    number[free] = np.arange(len(free))
    dofs = number[3 * solid.connectivity[:, :, None] + np.arange(3)].reshape(len(solid), -1)
    none = np.empty(0, np.int64)
    pattern = SparsePattern(len(free), {"solid": dofs}, (none, none))
    x, pressure = start.copy(), np.zeros((len(solid), solid.modes))
    for _ in range(MAX_ITERATIONS):
        force, stiffness, volume_gradient, constitutive = solid.response(x, pressure)
        total = scatter(solid.connectivity, force, len(x)) - load
        if np.abs(total.ravel()[free]).max() <= FORCE_TOLERANCE:
            return SolvedBody(x, np.where(held, total, 0.0), solid)
        data = np.zeros(len(pattern))
        pattern.add_group(data, "solid", stiffness)
        solver.factorise(pattern.matrix(data), pattern.revision)
        move = np.zeros(x.shape)
        move.ravel()[free] = solver.solve(-total.ravel()[free][:, None])[:, 0]
        pressure = solid.pressure_after(constitutive, volume_gradient, move)
        x = x + move
    raise AssertionError(f"no equilibrium in {MAX_ITERATIONS} iterations")
