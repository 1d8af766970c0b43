"""Viscous force of the silicone in a backward Euler step from a given configuration.

A solid of viscosity μτ parallel to its elasticity adds, over a time Δt, the force (τ/Δt) C (x − x₀), with C
the matrix of `SolidElements.viscosity` at x₀. The force has a potential, so the step is solved like any other
equilibrium. Lengths mm, forces N.
"""

import copy

import numpy as np
from jaxtyping import Float

from fem_reference.elements.solid import SolidElements


class ViscousSolid:
    """Viscous resistance to leaving one configuration.

    Parameters
    ----------
    solid : elements.
    origin : positions x₀ of all nodes at the start of the step [mm].
    rate : τ/Δt.
    """

    def __init__(self, solid: SolidElements, origin: Float[np.ndarray, "nodes 3"], rate: float) -> None:
        self._solid = solid
        self._origin = origin
        self.matrices = rate * solid.viscosity(origin)

    def force(self, positions: Float[np.ndarray, "nodes 3"]) -> Float[np.ndarray, "elements dofs"]:
        """Return the forces on the elements' nodes."""
        moved = (positions - self._origin)[self._solid.connectivity].reshape(len(self.matrices), -1, 1)
        return (self.matrices @ moved)[:, :, 0]

    def times(self, factor: float) -> "ViscousSolid":
        """Return the same resistance, scaled by ``factor``."""
        other = copy.copy(self)
        other.matrices = factor * self.matrices
        return other
