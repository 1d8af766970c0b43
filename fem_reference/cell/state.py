"""What the equations of the cell are about: its unknowns, a Newton step, and the linearisation at a point."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from fem_reference.cell.helical_periodicity import HelicalFrame
from fem_reference.solver import Linearisation


@dataclass(frozen=True)
class Configuration:
    """Unknowns of the cell.

    Parameters
    ----------
    positions : of the independent nodes [mm].
    strain : y = (u, λ): curvature and twist [1/mm] and stretch, per length at rest.
    element_pressure : π_j [MPa] and segment_tension [N], independent while Newton iterates.
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


@dataclass(frozen=True)
class Step:
    """Newton step; see `Configuration`."""

    positions: Float[np.ndarray, "free 3"]
    strain: Float[np.ndarray, "4"]
    multipliers: Float[np.ndarray, "2"]


@dataclass(frozen=True)
class CellLinearisation(Linearisation):
    """Residual and Hessian at a configuration; ``q`` stands for the independent nodes and the multipliers."""

    strain_residual: Float[np.ndarray, "4"]
    node_strain: Float[np.ndarray, "q 4"]
    node_pressure: Float[np.ndarray, "q 3"]
    strain_strain: Float[np.ndarray, "4 4"]
    strain_pressure: Float[np.ndarray, "4 3"]
    volume: Float[np.ndarray, "3"]
    frame: HelicalFrame
    volume_gradient: Float[np.ndarray, "elements modes dofs"]
    constitutive: Float[np.ndarray, "elements modes"]
    length_gradient: Float[np.ndarray, "segments _"]
