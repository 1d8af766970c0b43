"""Anderson acceleration of modified Newton steps.

With the factors of a matrix A near the stiffness K, steps are s = −A⁻¹ r. Where A is too stiff they shrink
slowly, and away from a saddle they grow. The next state is the weighted mean of the last ones, each moved by
its own step; the weights make the mean step the shortest, as GMRES does for linear equations. A few soft
directions then cost a few steps, whatever the sign of their stiffness. The change of the steps from state to
state also estimates A⁻¹K in these directions.

References
----------
Walker and Ni (2011), Anderson acceleration for fixed-point iterations, SIAM J. Numer. Anal. 49, §2.
"""

from typing import Any, Generic

import numpy as np
from jaxtyping import Float

from fem_reference.solver.equations import Equations, State
from fem_reference.solver.options import DEFAULT, AndersonOptions


class AndersonMixing(Generic[State]):
    """The last states of an iteration with one matrix, and the next one from them.

    Parameters
    ----------
    equations : of the body, for the mean of states.
    options : of the acceleration.
    """

    def __init__(
        self, equations: Equations[State, Any, Any, Any, Any], options: AndersonOptions = DEFAULT.anderson
    ) -> None:
        self._equations, self._options = equations, options
        # Positions relative to the first state, as the sum of the steps so far.
        self._places: list[Float[np.ndarray, " dofs"]] = []
        self._steps: list[Float[np.ndarray, " dofs"]] = []
        self._moved: list[State] = []
        self._next = np.zeros(0)

    def next(self, moved: State, step: Float[np.ndarray, "..."]) -> State:
        """The state to continue from.

        Parameters
        ----------
        moved : the present state, moved by its step; the present state is the first or the last result.
        step : displacements of that step [mm].
        """
        depth, farthest = self._options.depth, self._options.farthest
        here = self._next if self._steps else np.zeros(step.size)
        self._places = [*self._places, here][-depth:]
        self._steps = [*self._steps, step.ravel()][-depth:]
        self._moved = [*self._moved, moved][-depth:]
        while True:
            shares = self._shares()
            self._next = shares @ (np.array(self._places) + np.array(self._steps))
            if np.linalg.norm(self._next - here) <= farthest * np.linalg.norm(step):
                break
            self._places, self._steps, self._moved = self._places[1:], self._steps[1:], self._moved[1:]
        return self._equations.mean(self._moved, shares.tolist())

    def _shares(self) -> Float[np.ndarray, " states"]:
        """Weights that make the mean step the shortest; they add up to one."""
        changes = np.array([other - self._steps[-1] for other in self._steps[:-1]])
        if len(changes) == 0:
            return np.ones(1)
        first, *_ = np.linalg.lstsq(changes.T, -self._steps[-1], rcond=self._options.noise)
        return np.append(first, 1.0 - first.sum())

    @property
    def smallest(self) -> float:
        """Least eigenvalue of A⁻¹K in the directions of the steps; below zero the states surround a saddle.

        Infinite for fewer than three states.
        """
        if len(self._steps) < 3:
            return np.inf
        places = np.diff(self._places, axis=0)
        softened, *_ = np.linalg.lstsq(places.T, -np.diff(self._steps, axis=0).T, rcond=self._options.noise)
        return float(np.linalg.eigvals(softened).real.min())
