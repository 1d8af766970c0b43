"""How contact changes the stiffness and the steps of the actuator."""

from typing import TypeVar

import numpy as np
from jaxtyping import Float

from fem_reference.actuator.equations import ActuatorEquations
from fem_reference.actuator.model import ActuatorLinearisation, BodyState, with_positions
from fem_reference.actuator.motion import BodyMotion
from fem_reference.elements import convexified
from fem_reference.solver import Contact

Body = TypeVar("Body", bound=BodyState)
BodyLinear = TypeVar("BodyLinear", bound=ActuatorLinearisation)


class ActuatorContact(Contact[Body, BodyLinear]):
    """Contact of the chambers' walls with themselves, and of the cavity's wall with the core.

    Parameters
    ----------
    equations, motion : of the actuator.
    """

    def __init__(self, equations: ActuatorEquations, motion: BodyMotion) -> None:
        self._equations, self._motion = equations, motion

    def convexified(self, linear: BodyLinear) -> Float[np.ndarray, " nonzeros"]:
        """See `Contact.convexified`."""
        own = self._equations
        return convexified(linear.data, own.walls, linear.positions, own.pattern, own.unknowns)

    def core_curvature_stiffness(self, linear: BodyLinear) -> Float[np.ndarray, " nonzeros"]:
        """See `Contact.core_curvature_stiffness`."""
        pattern, contact = self._equations.pattern, self._equations.contact
        data = np.zeros(len(pattern))
        pattern.add_group(data, "core contact", contact.concave_part(linear.positions))
        return data

    def keep_walls_apart(self, at: Body, trial: Body) -> Body:
        """See `Contact.keep_walls_apart`."""
        start, end = at.deformation.positions, trial.deformation.positions
        moved = self._motion.keep_walls_apart(start, end)
        return trial if moved is None else with_positions(trial, moved)
