"""Continuation of equilibria along straight paths of load, with extrapolation and step control."""

import logging

import numpy as np
from jaxtyping import Float

from fem_reference.cell_equations import CellEquations
from fem_reference.configuration import Configuration
from fem_reference.linear_solver import SymmetricSolver
from fem_reference.newton import Equilibrium, NewtonError, Target, solve_equilibrium
from fem_reference.screw import screw_series

_LOG = logging.getLogger(__name__)

# A step is cut when Newton fails, kept where it takes the iterations between, and grown below.
_EASY, _HARD = 5, 9
# Cosine of the angle between two legs of a path that still counts as straight on.
_STRAIGHT = 0.999
_GROW, _SHRINK = 1.6, 0.6
_SMALLEST = 0.05
# Steps beyond a spot where contact pairs change kind, tried when ever smaller ones all fail before it.
_LEAPS = (0.1, 0.2)


class PathError(ArithmeticError):
    """No step forward converged.

    Parameters
    ----------
    message : why.
    last, target : last equilibrium, and what it is under.
    """

    def __init__(self, message: str, last: Equilibrium, target: Target) -> None:
        super().__init__(message)
        self.last = last
        self.target = target


class PathFollower:
    """Equilibria of a cell, one load after another.

    Parameters
    ----------
    equations, solver : the cell and its linear solver.
    equilibrium, target : where the path starts: an equilibrium and what it is under.
    step : length of the first step, in the measure of `distance`; adapted while going on.
    """

    def __init__(
        self,
        equations: CellEquations,
        solver: SymmetricSolver,
        equilibrium: Equilibrium,
        target: Target,
        step: float = 1.0,
    ) -> None:
        self.equations = equations
        self.solver = solver
        self.equilibrium = equilibrium
        self.target = target
        self.step = step
        self.iterations = 0
        self._earlier: tuple[Configuration, float] | None = None
        self._heading = np.zeros(0)

    def follow(self, goal: Target) -> Equilibrium:
        """Go from the present equilibrium to ``goal``, in as many steps as it takes.

        The solver is left with the factors at the goal.

        Raises
        ------
        PathError
            When the goal is not reached; it carries the last equilibrium.
        """
        origin, length = self.target, distance(self.target, goal)
        heading = difference(origin, goal) / max(length, np.finfo(float).tiny)
        if heading.shape != self._heading.shape or heading @ self._heading < _STRAIGHT:
            # A turn of the path makes the last step's direction worthless.
            self._earlier = None
        self._heading = heading
        if length == 0.0 and not self._advance(goal, 0.0):
            raise PathError("the equilibrium at hand does not converge anew", self.equilibrium, origin)
        done = 0.0
        while done < length:
            step = min(self.step, length - done)
            if length - done - step < 0.25 * step:
                step = length - done
            if self._advance(origin.between(goal, (done + step) / length), step):
                done += step
                continue
            self.step = 0.5 * step
            if self.step < _SMALLEST:
                done += self._leap(origin, goal, done, length)
        return self.equilibrium

    def _leap(self, origin: Target, goal: Target, done: float, length: float) -> float:
        """Step over a spot that small steps cannot pass; return how far."""
        for leap in _LEAPS:
            if leap <= length - done and self._advance(origin.between(goal, (done + leap) / length), leap):
                self.step = leap
                return leap
        raise PathError(
            f"stopped at pressures {np.round(self.target.pressure * 1e3, 3)} kPa, where steps down to "
            f"{self.step:.2g} of about 1 kPa fail",
            self.equilibrium,
            self.target,
        )

    def _advance(self, target: Target, step: float) -> bool:
        """Solve for ``target``, a step away; tell whether it converged."""
        at = self.equilibrium.configuration
        start = at
        if self._earlier is not None and step > 0.0:
            guess = at.extrapolate(self._earlier[0], step / self._earlier[1])
            start = guess if self._admissible(at, guess) else at
        try:
            found = solve_equilibrium(self.equations, self.solver, target, start)
        except NewtonError as error:
            _LOG.debug("a step of %.3g failed: %s", step, error)
            return False
        self._earlier = (at, step) if step > 0.0 else None
        self.equilibrium, self.target = found, target
        self.iterations += found.iterations
        if found.iterations <= _EASY:
            self.step = max(self.step, step) * _GROW
        elif found.iterations > _HARD:
            self.step = step * _SHRINK
        return True

    def _admissible(self, at: Configuration, guess: Configuration) -> bool:
        """Whether an extrapolated configuration is one that Newton's method can start from."""
        equations = self.equations
        try:
            series = screw_series(guess.curvature, equations.reach)
        except ValueError:
            return False
        x = equations.all_positions(guess)
        return (
            equations.rod.admissible(x, series)
            and equations.solid.dilatation(x).min() > 0.5
            and equations.walls.step_limit(equations.all_positions(at), x) >= 1.0
        )


def difference(a: Target, b: Target) -> Float[np.ndarray, " loads"]:
    """Change of load in units of 1 kPa, 0.05 N mm and 1 1/m, which strain the cell about alike."""
    parts = [(b.pressure - a.pressure) / 1e-3]
    if a.moment is not None and b.moment is not None:
        parts.append((b.moment - a.moment) / 0.05)
    if a.curvature is not None and b.curvature is not None:
        parts.append((b.curvature - a.curvature) / 1e-3)
    return np.concatenate(parts)


def distance(a: Target, b: Target) -> float:
    """Length of a step of load, the norm of its `difference`."""
    return float(np.linalg.norm(difference(a, b)))
