"""Model of the full actuator: what it is made of, its unknowns, and their linearisation (N, mm, MPa)."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Protocol, TypeVar, runtime_checkable

import numpy as np
from jaxtyping import Bool, Float

from fem_reference.elements import Own
from fem_reference.geometry import ActuatorGeometry, Core, Thread, Winding
from fem_reference.materials import Material
from fem_reference.mesh import MeshLevel
from fem_reference.solver import Linearisation
from fem_reference.walls import WallPairs


@dataclass(frozen=True)
class Deformation:
    """Unknowns of the actuator.

    Parameters
    ----------
    positions : of the mesh's nodes, then of the core's control points [mm].
    element_pressure, segment_tension, axis_tension : own forces of solid, thread and core [MPa, N, N], which
        are unknowns while Newton's method iterates.
    """

    positions: Float[np.ndarray, "points 3"]
    element_pressure: Float[np.ndarray, "elements modes"]
    segment_tension: Float[np.ndarray, " segments"]
    axis_tension: Float[np.ndarray, " spans"]

    @property
    def own(self) -> dict[str, Own]:
        """Own forces by their group's name."""
        return {"solid": self.element_pressure, "thread": self.segment_tension, "core": self.axis_tension}

    @property
    def deformation(self) -> "Deformation":
        """See `BodyState.deformation`."""
        return self

    def with_deformation(self, deformation: "Deformation") -> "Deformation":
        """See `BodyState.with_deformation`."""
        return deformation


_Body = TypeVar("_Body", bound="BodyState")


@runtime_checkable
class BodyState(Protocol):
    """State of the actuator: a deformation, and what else a problem takes for an unknown."""

    @property
    def deformation(self) -> Deformation:
        """Positions and own forces."""
        ...

    def with_deformation(self: _Body, deformation: Deformation) -> _Body:
        """The same state, but for its deformation."""
        ...


def with_positions(state: _Body, positions: Float[np.ndarray, "points 3"]) -> _Body:
    """The state with other positions."""
    return state.with_deformation(replace(state.deformation, positions=positions))


@dataclass(frozen=True)
class ActuatorLinearisation(Linearisation):
    """Residual and stiffness, and what the update of own forces needs.

    Parameters
    ----------
    pairs : of walls in contact; None where there are none.
    slack : thread segments that the stiffness takes for slack.
    positions : of all points [mm].
    force : internal forces less the pressures', at every point, clamped ones too [N].
    load_columns, load_rows : the tip load's stiffness is their product, to subtract; None without a tip load.
    laws, gradients : by the group's name, what its own forces' update needs (see `Response`).
    """

    pairs: WallPairs | None
    slack: Bool[np.ndarray, " segments"]
    positions: Float[np.ndarray, "points 3"]
    force: Float[np.ndarray, "points 3"]
    load_columns: Float[np.ndarray, "q 3"] | None
    load_rows: Float[np.ndarray, "3 q"] | None
    laws: Mapping[str, Own]
    gradients: Mapping[str, Own]


@dataclass(frozen=True)
class ActuatorModel:
    """What the actuator is made of.

    Parameters
    ----------
    geometry, material, winding, thread : of the actuator.
    level : mesh density.
    density : of silicone and core [kg/m³].
    bonded : where the cavity is bonded to the core: ``cap`` (the cap's whole length), ``tip`` (the cap's end,
        over the core's diameter) or ``all`` along.
    cap_wound : whether the thread continues over the cap.
    symmetric : whether the body keeps its plane of symmetry y = 0.
    core : central rod.
    """

    geometry: ActuatorGeometry
    material: Material
    winding: Winding
    thread: Thread
    level: MeshLevel
    density: float
    bonded: str
    cap_wound: bool = False
    symmetric: bool = False
    core: Core = field(default_factory=Core)
