"""The section potential's derivatives at an equilibrium of the cell, by static condensation of the nodes.

With y = (u, p) and the nodes q at equilibrium, Π(y) = min_q E(q; y)/period gives

    ∂Π/∂u = m,   ∂Π/∂p = −V/period,   ∂²Π = (E_yy − E_yq E_qq⁻¹ E_qy)/period:

six more solves with the factors at hand. Units N, mm, MPa.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from fem_reference.cell_equations import CellEquations
from fem_reference.linear_solver import SymmetricSolver
from fem_reference.problem import Equilibrium


@dataclass(frozen=True)
class SectionDerivatives:
    """∂Π/∂u [N mm] and ∂²Π in (u, p)."""

    moment: Float[np.ndarray, "3"]
    hessian: Float[np.ndarray, "6 6"]


def condense(equations: CellEquations, solver: SymmetricSolver, at: Equilibrium) -> SectionDerivatives:
    """Condense the nodes out of the Hessian; ``solver`` holds the factors at ``at``."""
    linear = at.linear
    coupling = np.concatenate([linear.node_curvature, linear.node_pressure], axis=1)
    direct = np.zeros((6, 6))
    direct[:3, :3] = linear.curvature_curvature
    direct[:3, 3:] = linear.curvature_pressure
    direct[3:, :3] = linear.curvature_pressure.T
    hessian = (direct - coupling.T @ solver.solve(coupling)) / equations.period
    # Round-off of the two triangular solves leaves an asymmetry of about 1e-12.
    return SectionDerivatives(linear.curvature_residual / equations.period, 0.5 * (hessian + hessian.T))
