"""Equations of an equilibrium: residual, stiffness, and steps of Newton's method.

The solvers pass states, targets, linearisations, steps and resistances on, and look into none of them beyond
what the bounds of the type parameters below say.
"""

import abc
from dataclasses import dataclass
from typing import Generic, Protocol, TypeVar, runtime_checkable

import numpy as np
from jaxtyping import Float

from fem_reference.algebra import SparsePattern, SymmetricSolver


@dataclass(frozen=True)
class Linearisation:
    """Residual and stiffness of the equations at a state.

    Parameters
    ----------
    residual : forces on the unknowns of the sparse system [N].
    data : of the stiffness, in the equations' pattern.
    walls_touch : whether chamber walls are in contact.
    """

    residual: Float[np.ndarray, " q"]
    data: Float[np.ndarray, " nonzeros"]
    walls_touch: bool


_Own = TypeVar("_Own")


@runtime_checkable
class Step(Protocol):
    """A Newton step."""

    @property
    def positions(self) -> Float[np.ndarray, "..."]:
        """Displacement of the nodes [mm]."""
        ...


@runtime_checkable
class Resistance(Protocol):
    """Viscous resistance to leaving a state."""

    def times(self: _Own, factor: float) -> _Own:
        """The same resistance, ``factor`` times as large."""
        ...


@runtime_checkable
class PathTarget(Protocol):
    """Loads along a path."""

    @property
    def pressure(self) -> Float[np.ndarray, " chambers"]:
        """Pressures [MPa]."""
        ...

    def between(self: _Own, other: _Own, fraction: float) -> _Own:
        """The loads a fraction of the way from these to ``other``."""
        ...

    def to(self: _Own, other: _Own) -> Float[np.ndarray, " loads"]:
        """Change of the loads, in units of about equal effect."""
        ...


#: Unknowns; loads to solve for; residual and stiffness; Newton step; viscous resistance.
State = TypeVar("State")
Target = TypeVar("Target")
Linear = TypeVar("Linear", bound=Linearisation)
Move = TypeVar("Move", bound=Step)
Viscous = TypeVar("Viscous", bound=Resistance)
#: Loads that a path leads to.
Load = TypeVar("Load", bound=PathTarget)


class Equations(abc.ABC, Generic[State, Target, Linear, Move, Viscous]):
    """Residual and stiffness of a body, and how a Newton step changes its state."""

    #: Sparsity of the stiffness.
    pattern: SparsePattern
    #: Number of multipliers among the unknowns; each has a negative pivot.
    constraints: int = 0

    @abc.abstractmethod
    def begin(self, start: State, target: Target) -> State:
        """The state to iterate from; raises a NewtonError if it is not admissible."""

    @abc.abstractmethod
    def linearise(
        self, at: State, target: Target, viscous: Viscous | None = None, before: Linear | None = None
    ) -> Linear:
        """Residual and stiffness, with those of a ``viscous`` resistance.

        After a step from the linearisation ``before``, the stiffness of wall contact takes the pair forces
        that this step predicted (see `pair_forces`).
        """

    @abc.abstractmethod
    def update_forces(
        self, linear: Linear, at: State, target: Target, viscous: Viscous | None = None
    ) -> Linear:
        """``linear`` with its stiffness, and the residual at ``at``."""

    @abc.abstractmethod
    def keeps(self, linear: Linear, at: State) -> bool:
        """Whether the stiffness of ``linear`` may be used at ``at``: no thread has become slack or taut."""

    @abc.abstractmethod
    def viscous(self, at: State, rate: float) -> Viscous:
        """Viscous resistance to leaving ``at``: its stiffness is ``rate`` times the silicone's at rest."""

    @abc.abstractmethod
    def stiffened(
        self, data: Float[np.ndarray, " nonzeros"], resistance: Viscous, linear: Linear
    ) -> Float[np.ndarray, " nonzeros"]:
        """A stiffness' data plus the matrix of a viscous ``resistance``."""

    @abc.abstractmethod
    def newton_step(self, solver: SymmetricSolver, linear: Linear, target: Target) -> Move:
        """Newton step by the factors that ``solver`` holds."""

    def excess(self, solver: SymmetricSolver, linear: Linear, negative: int | None) -> int | None:
        """Negative pivots of the stiffness in ``solver`` beyond the constraints'; None if not known."""
        return None if negative is None else negative - self.constraints

    def imbalance(self, linear: Linear, target: Target) -> float:
        """Largest residual of unknowns outside the sparse system, as a moment [N mm]."""
        return 0.0

    def size(self, step: Move, linear: Linear) -> float:
        """Root-mean-square displacement of the nodes in a step [mm]."""
        return float(np.sqrt(np.mean(step.positions**2)))

    def is_small(self, step: Move) -> bool:
        """Whether unknowns outside the sparse system move no more than contact noise may move them."""
        return True

    def longest(self, step: Move) -> float:
        """Largest share of a step, at most 1, for which its linearisation holds."""
        return 1.0

    @abc.abstractmethod
    def advance(self, at: State, step: Move, fraction: float, linear: Linear) -> State:
        """The state after a fraction of a step, with the own forces of stiff groups."""

    @abc.abstractmethod
    def allowed(self, linear: Linear, trial: State) -> float:
        """Share of a trial step before something blocks it; 1 if all of the step is admissible."""

    @abc.abstractmethod
    def mean(self, states: list[State], weights: list[float]) -> State:
        """Weighted mean of states. The weights add up to one; negative weights extrapolate."""

    def pushed(self, solver: SymmetricSolver, at: State, linear: Linear) -> State | None:
        """``at``, pushed a little along a direction of negative stiffness; None if there is none.

        ``solver`` holds the factors of the stiffness there.
        """
        return None

    @abc.abstractmethod
    def distance(self, at: State, other: State) -> float:
        """Largest displacement of a node between two states [mm], the bend of a slender body apart."""

    @abc.abstractmethod
    def may_start(self, at: State, guess: State) -> bool:
        """Whether Newton's method may start from ``guess``, extrapolated from the equilibrium ``at``."""
