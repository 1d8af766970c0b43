"""What the equations of the cell are about: its unknowns, a Newton step, and the linearisation at a point."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from fem_reference.helical import HelicalFrame
from fem_reference.problem import Linearisation


@dataclass(frozen=True)
class Configuration:
    """Unknowns of the cell.

    Parameters
    ----------
    positions : of the independent nodes [mm].
    curvature : u [1/mm].
    element_pressure : π_j [MPa] and segment_tension [N], independent while Newton iterates.
    multipliers : of the gauge [N].
    """

    positions: Float[np.ndarray, "free 3"]
    curvature: Float[np.ndarray, "3"]
    element_pressure: Float[np.ndarray, "elements modes"]
    segment_tension: Float[np.ndarray, " segments"]
    multipliers: Float[np.ndarray, "2"]


@dataclass(frozen=True)
class Step:
    """Newton step; see `Configuration`."""

    positions: Float[np.ndarray, "free 3"]
    curvature: Float[np.ndarray, "3"]
    multipliers: Float[np.ndarray, "2"]


@dataclass(frozen=True)
class CellLinearisation(Linearisation):
    """Residual and Hessian at a configuration; ``q`` stands for the independent nodes and the multipliers."""

    curvature_residual: Float[np.ndarray, "3"]
    node_curvature: Float[np.ndarray, "q 3"]
    node_pressure: Float[np.ndarray, "q 3"]
    curvature_curvature: Float[np.ndarray, "3 3"]
    curvature_pressure: Float[np.ndarray, "3 3"]
    volume: Float[np.ndarray, "3"]
    frame: HelicalFrame
    volume_gradient: Float[np.ndarray, "elements modes dofs"]
    length_gradient: Float[np.ndarray, "segments _"]
