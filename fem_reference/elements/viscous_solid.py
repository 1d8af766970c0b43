"""Viscous resistance of the silicone to leaving a configuration: an implicit step in time of a creeping body.

Backward Euler for a solid of viscosity μτ beside its elasticity gives, over a time Δt, the force
(τ/Δt) C (x − x₀) with C the matrix of `SolidElements.viscosity` at x₀. It comes from an energy, so that the
step is an equilibrium like any other. Lengths mm, forces N.
"""

import copy

import numpy as np
from jaxtyping import Float

from fem_reference.elements.solid import SolidElements


class ViscousSolid:
    """Resistance from one configuration on.

    Parameters
    ----------
    solid : elements.
    origin : positions of all nodes that are left [mm].
    rate : τ/Δt.
    """

    def __init__(self, solid: SolidElements, origin: Float[np.ndarray, "nodes 3"], rate: float) -> None:
        self._solid = solid
        self._origin = origin
        self.matrices = rate * solid.viscosity(origin)

    def force(self, positions: Float[np.ndarray, "nodes 3"]) -> Float[np.ndarray, "elements dofs"]:
        """Forces on the elements' nodes."""
        moved = (positions - self._origin)[self._solid.connectivity].reshape(len(self.matrices), -1, 1)
        return (self.matrices @ moved)[:, :, 0]

    def times(self, factor: float) -> "ViscousSolid":
        """The same resistance, ``factor`` times as large."""
        other = copy.copy(self)
        other.matrices = factor * self.matrices
        return other
