"""The section potential's derivatives at an equilibrium of the cell, by static condensation of the nodes.

With y = (u, λ, p) and the nodes q at equilibrium, Π(y) = min_q E(q; y)/period gives

    ∂Π/∂u = m,   ∂Π/∂p = −V/period,   ∂²Π = (E_yy − E_yq E_qq⁻¹ E_qy)/period:

seven more solves with the factors at hand. Where the stretch λ is an unknown, it is condensed like a node;
where it is held, it is left out. Units N, mm, MPa.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from fem_reference.algebra import SymmetricSolver
from fem_reference.cell.equations import ACROSS, CellEquations
from fem_reference.cell.state import CellLinearisation, Configuration
from fem_reference.solver import Equilibrium

_STRETCH = 3


@dataclass(frozen=True)
class SectionDerivatives:
    """∂Π/∂u [N mm], ∂²Π in (u, p), and negative directions of the energy.

    Parameters
    ----------
    moment, hessian : derivatives of the section potential.
    negative_at_curvature : negative eigenvalues of E_λλ − E_λq E_qq⁻¹ E_qλ: 0 or 1.
    negative_in_bending : those with u condensed too. With those of E_qq they are the energy's own (Haynsworth
        1968): their sum changes only where the energy has a singular point, and neither part has to.
    """

    moment: Float[np.ndarray, "3"]
    hessian: Float[np.ndarray, "6 6"]
    negative_at_curvature: int
    negative_in_bending: int


def condense(
    equations: CellEquations,
    solver: SymmetricSolver,
    at: Equilibrium[Configuration, CellLinearisation],
) -> SectionDerivatives:
    """Condense the nodes out of the Hessian; ``solver`` holds the factors at ``at``."""
    linear = at.own_linear
    coupling = np.concatenate([linear.node_strain, linear.node_pressure], axis=1)
    direct = np.zeros((7, 7))
    direct[:4, :4] = linear.strain_strain
    direct[:4, 4:] = linear.strain_pressure
    direct[4:, :4] = linear.strain_pressure.T
    full = (direct - coupling.T @ solver.solve(coupling)) / equations.period
    hessian = np.delete(np.delete(full, _STRETCH, axis=0), _STRETCH, axis=1)
    turned_over = 0
    if equations.axial_stiffness is not None:
        row = np.delete(full[_STRETCH], _STRETCH)
        hessian -= np.outer(row, row) / full[_STRETCH, _STRETCH]
        turned_over = int(full[_STRETCH, _STRETCH] < 0.0)
    # Round-off of the two triangular solves leaves an asymmetry of about 1e-12.
    hessian = 0.5 * (hessian + hessian.T)
    bent = int((np.linalg.eigvalsh(hessian[:3, :3]) <= 0.0).sum())
    if equations.symmetric:
        hessian[ACROSS, ACROSS] = 0.0
    return SectionDerivatives(
        linear.strain_residual[:3] / equations.period, hessian, turned_over, turned_over + bent
    )
