"""What Newton's method, creep and the path follower ask of a set of equations, and what they tell of it.

A problem owns its types of configurations, targets, linearisations and steps; the solvers only hand them on.
"""

import abc
from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Bool, Float

from fem_reference.algebra import SparsePattern, SymmetricSolver


@dataclass(frozen=True)
class Linearisation:
    """Residual and stiffness of a problem at a configuration.

    Parameters
    ----------
    residual : forces on the unknowns of the sparse system [N].
    data : of the stiffness, in the problem's pattern.
    walls_touch : whether chamber walls are in contact.
    pairs : of walls in contact where the stiffness is of; None where there are none.
    slack : which thread segments the stiffness takes for slack.
    """

    residual: Float[np.ndarray, " q"]
    data: Float[np.ndarray, " nonzeros"]
    walls_touch: bool
    pairs: Any
    slack: Bool[np.ndarray, " segments"]


@dataclass(frozen=True)
class Equilibrium:
    """A converged configuration with the linearisation there.

    Parameters
    ----------
    residual : largest nodal force left [N].
    excess_negative : negative pivots of the stiffness beyond those of the constraints, with
        contact taken as convex; above zero the body is at a saddle of its energy. None where the linear
        solver does not tell.
    excess_as_it_is : the same of the stiffness with contact as it is; None where it was not looked at.
    longest : size of the longest step on the way there [mm].
    convex : where the last matrix had its contact made convex, the share of the rod's roundness to leave out
        of the next one's to begin with; else None.
    """

    configuration: Any
    linear: Any
    iterations: int
    residual: float
    excess_negative: int | None
    longest: float = 0.0
    convex: float | None = None
    negative_eigenvalues_true_contact: int | None = None


class Problem(abc.ABC):
    """What Newton's method and the path follower ask of the equations.

    Configurations, targets, linearisations and steps are the problem's own types; a linearisation extends
    `Linearisation`, and a step has ``positions``, the nodes' part of it [mm].
    """

    #: Sparsity of the stiffness, and how many of its unknowns are multipliers with a negative pivot each.
    pattern: SparsePattern
    constraints: int
    #: Root-mean-square displacement that a step may have [mm].
    reach: float
    #: Displacement of any node that the contact's jumps may leave open [mm].
    noise: float
    #: Size of a step below which the stiffness is kept for the next ones [mm].
    nearby: float
    #: Whether an equilibrium must come with its own stiffness and factors, not those of a state nearby.
    exact: bool
    #: Size of the longest step of Newton's method that a step of the load is to lead to [mm]; infinite where
    #: it is the number of iterations alone that counts.
    stride: float

    @abc.abstractmethod
    def begin(self, start: Any, target: Any) -> Any:
        """The configuration to iterate from; raises a NewtonError where it is not admissible."""

    @abc.abstractmethod
    def linearise(self, at: Any, target: Any, viscous: Any = None, before: Any = None) -> Any:
        """Residual and stiffness, those of a `viscous` resistance included.

        After a step from the linearisation ``before``, the stiffness of wall contact is that of the forces
        which it led to expect (see `wall_pairs`).
        """

    @abc.abstractmethod
    def update_forces(self, linear: Any, at: Any, target: Any, viscous: Any = None) -> Any:
        """``linear`` with the residual at ``at`` and the stiffness as it was."""

    @abc.abstractmethod
    def keeps(self, linear: Any, at: Any) -> bool:
        """Whether the stiffness of ``linear`` may be kept at ``at``: no thread has gone slack or taut."""

    @abc.abstractmethod
    def convexified_contact(self, linear: Any) -> Float[np.ndarray, " nonzeros"]:
        """The stiffness' data with contact of walls made convex, pair by pair."""

    @abc.abstractmethod
    def core_curvature_stiffness(self, linear: Any) -> Float[np.ndarray, " nonzeros"]:
        """What of the stiffness' data comes with the rod's roundness, off which a pressed wall slides."""

    @abc.abstractmethod
    def viscous(self, at: Any, rate: float) -> Any:
        """Viscous resistance to leaving ``at``, its stiffness ``rate`` times that of the silicone at rest."""

    @abc.abstractmethod
    def stiffened(
        self, data: Float[np.ndarray, " nonzeros"], resistance: Any, linear: Any
    ) -> Float[np.ndarray, " nonzeros"]:
        """A stiffness' data with the matrix of a viscous ``resistance`` added."""

    @abc.abstractmethod
    def imbalance(self, linear: Any, target: Any) -> float:
        """Largest residual moment of unknowns outside the sparse system [N mm]."""

    @abc.abstractmethod
    def newton_step(self, solver: SymmetricSolver, linear: Any, target: Any) -> Any:
        """Step from the factors that ``solver`` holds."""

    def excess(self, solver: SymmetricSolver, linear: Any, negative: int | None) -> int | None:
        """Negative pivots of the stiffness in ``solver`` beyond those of the constraints; None: not told."""
        return None if negative is None else negative - self.constraints

    @abc.abstractmethod
    def size(self, step: Any, linear: Any) -> float:
        """Root-mean-square displacement of the nodes in a step [mm]."""

    @abc.abstractmethod
    def is_small(self, step: Any) -> bool:
        """Whether the unknowns other than nodes move by no more than the contact's noise may move them."""

    @abc.abstractmethod
    def longest(self, step: Any) -> float:
        """Largest share of a step that its linearisation stands for, at most 1."""

    @abc.abstractmethod
    def advance(self, at: Any, step: Any, fraction: float, linear: Any) -> Any:
        """The configuration after a share of a step, stiff forces included."""

    def keep_walls_apart(self, at: Any, trial: Any) -> Any:
        """A trial with what it brings together held apart; itself where that is nothing, as it is here."""
        return trial

    @abc.abstractmethod
    def allowed(self, linear: Any, trial: Any) -> float:
        """Share of a trial step that nothing blocks; 1 where it is admissible in full."""

    @abc.abstractmethod
    def mean(self, states: list[Any], weights: list[float]) -> Any:
        """Weighted mean of configurations, weights adding up to one; negative ones extrapolate."""

    @abc.abstractmethod
    def may_start(self, at: Any, guess: Any) -> bool:
        """Whether ``guess``, extrapolated from the equilibrium ``at``, is one to iterate from."""
