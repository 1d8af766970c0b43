"""Steps that are mixed from the last ones: Anderson's acceleration of an iteration that keeps its stiffness.

With the factors of a matrix A near the stiffness K, Newton's steps are s = −A⁻¹ r; along what A takes for too
stiff they shrink slowly, and away from a saddle they grow. The next state is the mean of the last ones, each
moved by its own step, with the weights of the shortest mean step: as GMRES does for linear equations, so that
neither a few soft directions nor the sign of their stiffness is of account. How steps change from state to
state also tells A⁻¹K in these directions.

References
----------
Walker and Ni (2011), Anderson acceleration for fixed-point iterations, SIAM J. Numer. Anal. 49, §2.
"""

from typing import Any

import numpy as np
from jaxtyping import Float

from fem_reference.solver.problem import Problem

# States that are mixed; how many times as far as the step at hand a mean may be, or the oldest are left out;
# and the relative size of a direction of steps that is lost in their noise.
_DEPTH = 8
_FARTHEST = 30.0
_NOISE = 1e-6


class AndersonMixing:
    """The last states of an iteration with one stiffness.

    Parameters
    ----------
    problem : whose states they are.
    """

    def __init__(self, problem: Problem) -> None:
        self._problem = problem
        # Where they are, from the first one on and as steps are added up.
        self._places: list[Float[np.ndarray, " dofs"]] = []
        self._steps: list[Float[np.ndarray, " dofs"]] = []
        self._moved: list[Any] = []
        self._next = np.zeros(0)

    def next(self, moved: Any, step: Float[np.ndarray, "..."]) -> Any:
        """The state to go on from.

        Parameters
        ----------
        moved : the state at hand, which is the first or the last that came of this, moved by its step.
        step : the positions' part of that [mm].
        """
        here = self._next if self._steps else np.zeros(step.size)
        self._places = [*self._places, here][-_DEPTH:]
        self._steps = [*self._steps, step.ravel()][-_DEPTH:]
        self._moved = [*self._moved, moved][-_DEPTH:]
        while True:
            shares = self._shares()
            self._next = shares @ (np.array(self._places) + np.array(self._steps))
            if np.linalg.norm(self._next - here) <= _FARTHEST * np.linalg.norm(step):
                break
            self._places, self._steps, self._moved = self._places[1:], self._steps[1:], self._moved[1:]
        return self._problem.mean(self._moved, shares.tolist())

    def _shares(self) -> Float[np.ndarray, " states"]:
        """Weights of the shortest mean step."""
        changes = np.array([other - self._steps[-1] for other in self._steps[:-1]])
        if len(changes) == 0:
            return np.ones(1)
        first, *_ = np.linalg.lstsq(changes.T, -self._steps[-1], rcond=_NOISE)
        return np.append(first, 1.0 - first.sum())

    @property
    def smallest(self) -> float:
        """Least eigenvalue of A⁻¹K, as far as the states span it; below zero, they are about a saddle.

        Infinite where there are not enough of them.
        """
        if len(self._steps) < 3:
            return np.inf
        places = np.diff(self._places, axis=0)
        softened, *_ = np.linalg.lstsq(places.T, -np.diff(self._steps, axis=0).T, rcond=_NOISE)
        return float(np.linalg.eigvals(softened).real.min())
