"""Problem of equilibrium: equations, tolerances, and contact if the body has any."""

from dataclasses import dataclass
from typing import Generic

import numpy as np
from jaxtyping import Float

from fem_reference.solver.equations import Equations, Linear, Move, State, Target, Viscous


@dataclass(frozen=True)
class Tolerances:
    """Lengths and accuracy of a problem's steps.

    Parameters
    ----------
    max_step : largest root-mean-square displacement in one step [mm].
    modified_newton_step : size of a step below which modified Newton steps follow, with the stiffness at
        hand [mm].
    contact_noise : displacement of a node that jumps of the contact force may leave undetermined [mm].
    exact_stiffness : whether an equilibrium needs the stiffness and factors at its own state, not those
        nearby.
    desired_step : size of the longest Newton step that a step of the load should lead to [mm]. If it is
        infinite, the number of iterations alone sets the step of the load.
    """

    max_step: float
    modified_newton_step: float
    contact_noise: float
    exact_stiffness: bool
    desired_step: float


class Contact(Generic[State, Linear]):
    """How contact changes the stiffness and a step; this class is that of a body without contact."""

    def convexified(self, linear: Linear) -> Float[np.ndarray, " nonzeros"]:
        """The stiffness' data with the contact of walls made convex, pair by pair."""
        return linear.data

    def core_curvature_stiffness(self, linear: Linear) -> Float[np.ndarray, " nonzeros"]:
        """The stiffness' data from the core's curvature alone: a wall pressed on the core slides off."""
        return np.zeros_like(linear.data)

    def keep_walls_apart(self, at: State, trial: State) -> State:
        """The trial state, with walls moved apart that the step would bring through each other.

        The trial state itself, if no walls are moved.
        """
        return trial


class Problem(Equations[State, Target, Linear, Move, Viscous]):
    """Equations that Newton's method and pressure continuation can solve."""

    tolerances: Tolerances
    contact: Contact[State, Linear]
    #: Unit of pressure [kPa], for messages.
    kilopascals: float = 1e3


@dataclass(frozen=True)
class Equilibrium(Generic[State, Linear]):
    """A converged state with the linearisation there.

    Parameters
    ----------
    configuration : the state.
    linear : the linearisation there; None for an equilibrium on the way to another.
    iterations : of Newton's method.
    residual : largest nodal force left [N].
    excess_negative : negative pivots of the stiffness beyond those of the constraints, with convexified
        contact. If there are any, the body is at a saddle of its energy. None if the linear solver does not
        count them.
    longest : size of the longest step on the way there [mm].
    convex : if the last matrix had convexified contact, the share of the core's curvature stiffness to leave
        out first at the next equilibrium; else None.
    negative_eigenvalues_true_contact : negative pivots with the contact's true stiffness; None if that was
        not factorised.
    """

    configuration: State
    linear: Linear | None
    iterations: int
    residual: float
    excess_negative: int | None
    longest: float = 0.0
    convex: float | None = None
    negative_eigenvalues_true_contact: int | None = None

    @property
    def own_linear(self) -> Linear:
        """The linearisation at this equilibrium; a ValueError for an equilibrium on the way to another."""
        if self.linear is None:
            raise ValueError("equilibrium: got one on the way to another, expected one with its stiffness")
        return self.linear
