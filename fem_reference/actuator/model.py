"""What the full actuator is made of, its unknowns, and what its equations say of them (N, mm, MPa)."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from fem_reference.elements import Ogden
from fem_reference.geometry import ActuatorGeometry, Thread, Winding
from fem_reference.mesh import MeshLevel
from fem_reference.solver import Linearisation


@dataclass(frozen=True)
class Deformation:
    """Unknowns of the actuator.

    Parameters
    ----------
    positions : of the mesh's nodes, then of the rod's control points [mm].
    element_pressure, segment_tension, axis_tension : forces of the stiff parts [MPa, N, N], independent while
        Newton's method iterates.
    """

    positions: Float[np.ndarray, "points 3"]
    element_pressure: Float[np.ndarray, "elements modes"]
    segment_tension: Float[np.ndarray, " segments"]
    axis_tension: Float[np.ndarray, " spans"]


@dataclass(frozen=True)
class ActuatorLinearisation(Linearisation):
    """Residual and stiffness, and what the update of the stiff parts' forces needs.

    Parameters
    ----------
    positions : where [mm].
    force : internal forces less the pressures', at every point, clamped ones too [N].
    load_columns, load_rows : the tip load's stiffness is their product, to be taken off; None without one.
    volume_gradient, length_gradient, extension_gradient : of elements, thread segments and the rod's spans.
    constitutive : κ ϑ_j of the elements [MPa].
    """

    positions: Float[np.ndarray, "points 3"]
    force: Float[np.ndarray, "points 3"]
    load_columns: Float[np.ndarray, "q 3"] | None
    load_rows: Float[np.ndarray, "3 q"] | None
    volume_gradient: Float[np.ndarray, "elements modes dofs"]
    constitutive: Float[np.ndarray, "elements modes"]
    length_gradient: Float[np.ndarray, "segments _"]
    extension_gradient: Float[np.ndarray, "spans 12"]


@dataclass(frozen=True)
class ActuatorModel:
    """What the actuator is made of.

    Parameters
    ----------
    geometry, material, winding, thread : see there.
    level : mesh density.
    density : of silicone and rod [kg/m³].
    bonded : where the cavity is bonded to the rod: ``cap`` (its whole length), ``tip`` (its end, over the
        rod's diameter) or ``all``.
    cap_wound : whether the thread goes on over the cap.
    symmetric : whether the plane of symmetry y = 0 is kept.
    """

    geometry: ActuatorGeometry
    material: Ogden
    winding: Winding
    thread: Thread
    level: MeshLevel
    density: float
    bonded: str
    cap_wound: bool = False
    symmetric: bool = False
