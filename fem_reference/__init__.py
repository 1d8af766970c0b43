"""Full 3D finite-element reference of a wound soft pneumatic actuator."""

from fem_reference.cell import CellError, CellState, Load, PeriodCell, follow
from fem_reference.geometry import ActuatorGeometry
from fem_reference.material import Ogden
from fem_reference.mesh import LEVELS, MeshLevel
from fem_reference.winding import DoubleHelix, Thread, Winding

__all__ = [
    "LEVELS",
    "ActuatorGeometry",
    "CellError",
    "CellState",
    "DoubleHelix",
    "Load",
    "MeshLevel",
    "Ogden",
    "PeriodCell",
    "Thread",
    "Winding",
    "follow",
]
