"""State of the cell, a Newton step, and the linearisation at a state."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float

from fem_reference.cell.helical_periodicity import HelicalFrame
from fem_reference.elements import Own
from fem_reference.solver import Linearisation
from fem_reference.walls import WallPairs


@dataclass(frozen=True)
class Configuration:
    """Unknowns of the cell.

    Parameters
    ----------
    positions : of the independent nodes [mm].
    strain : y = (u, λ): curvature and twist [1/mm] and stretch, per length at rest.
    element_pressure, segment_tension : own forces of solid and thread [MPa, N], which are unknowns while
        Newton's method iterates.
    multipliers : of the gauge [N].
    """

    positions: Float[np.ndarray, "free 3"]
    strain: Float[np.ndarray, "4"]
    element_pressure: Float[np.ndarray, "elements modes"]
    segment_tension: Float[np.ndarray, " segments"]
    multipliers: Float[np.ndarray, "2"]

    @property
    def curvature(self) -> Float[np.ndarray, "3"]:
        """Curvature and twist u [1/mm]."""
        return self.strain[:3]

    @property
    def own(self) -> dict[str, Own]:
        """Own forces by their group's name."""
        return {"solid": self.element_pressure, "thread": self.segment_tension}


@dataclass(frozen=True)
class Step:
    """Newton step; see `Configuration`."""

    positions: Float[np.ndarray, "free 3"]
    strain: Float[np.ndarray, "4"]
    multipliers: Float[np.ndarray, "2"]


@dataclass(frozen=True)
class CellLinearisation(Linearisation):
    """Residual and Hessian at a state; ``q`` stands for the independent nodes and the multipliers.

    Parameters
    ----------
    pairs : of walls in contact; None where there are none.
    slack : thread segments that the stiffness takes for slack.
    frame : positions of all nodes.
    laws, gradients : by the group's name, what its own forces' update needs (see `Response`).
    """

    pairs: WallPairs | None
    slack: Bool[np.ndarray, " segments"]
    strain_residual: Float[np.ndarray, "4"]
    node_strain: Float[np.ndarray, "q 4"]
    node_pressure: Float[np.ndarray, "q 3"]
    strain_strain: Float[np.ndarray, "4 4"]
    strain_pressure: Float[np.ndarray, "4 3"]
    volume: Float[np.ndarray, "3"]
    frame: HelicalFrame
    laws: Mapping[str, Own]
    gradients: Mapping[str, Own]
