"""Continuation of equilibria along straight paths of load, with extrapolation and step control."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fem_reference.cell_equations import CellEquations, Configuration
from fem_reference.linear_solver import SymmetricSolver
from fem_reference.newton import Equilibrium, NewtonFailure, Target, solve_equilibrium
from fem_reference.screw import screw_series

# A step is cut when Newton fails, kept where it takes the iterations between, and grown below.
_EASY, _HARD = 5, 9
_GROW, _SHRINK = 1.6, 0.6
_SMALLEST = 0.02
# Steps beyond a spot where contact pairs change kind, tried when ever smaller ones all fail before it.
_LEAPS = (0.05, 0.1, 0.2)


class PathFailure(ArithmeticError):
    """No step forward converged.

    Parameters
    ----------
    message : why.
    last : last equilibrium, and target : what it is under.
    """

    def __init__(self, message: str, last: Equilibrium | None, target: Target | None) -> None:
        super().__init__(message)
        self.last = last
        self.target = target


@dataclass
class PathFollower:
    """Equilibria of a cell, one load after another.

    Parameters
    ----------
    equations, solver : the cell and its linear solver.
    step : length of the first step, in the measure of `distance`; adapted while going on.
    """

    equations: CellEquations
    solver: SymmetricSolver
    step: float = 1.0
    equilibrium: Equilibrium | None = None
    target: Target | None = None
    _earlier: tuple[Configuration, float] | None = None
    iterations: int = 0

    def start(self, target: Target, at: Configuration) -> Equilibrium:
        """Solve for the first equilibrium, from a configuration near it."""
        try:
            self.equilibrium = solve_equilibrium(self.equations, self.solver, target, at)
        except NewtonFailure as error:
            raise PathFailure(str(error), None, None) from error
        self.target, self._earlier = target, None
        self.iterations += self.equilibrium.iterations
        return self.equilibrium

    def follow(self, goal: Target) -> Equilibrium:
        """Go from the present equilibrium to ``goal``, in as many steps as it takes."""
        if self.equilibrium is None or self.target is None:
            raise RuntimeError("follow: called before start; expected an equilibrium to go on from")
        origin, length = self.target, distance(self.target, goal)
        # A turn of the path makes the last step's direction worthless.
        self._earlier = None
        done, failures = 0.0, 0
        while done < length:
            step = min(self.step, length - done)
            if length - done - step < 0.25 * step:
                step = length - done
            if self._advance(origin.between(goal, (done + step) / length), step):
                done += step
                failures = 0
                continue
            failures += 1
            self.step = 0.5 * step
            if self.step < _SMALLEST and not (leap := self._leap(origin, goal, done, length)):
                raise PathFailure(
                    f"stopped at pressures {np.round(self.target.pressure * 1e3, 3)} kPa: steps down to "
                    f"{self.step:.2g} fail",
                    self.equilibrium,
                    self.target,
                )
            if self.step < _SMALLEST:
                done += leap
        return self.equilibrium

    def _leap(self, origin: Target, goal: Target, done: float, length: float) -> float:
        """Try steps beyond a spot that small steps cannot pass; return the one taken, or 0."""
        for leap in _LEAPS:
            if leap <= length - done and self._advance(origin.between(goal, (done + leap) / length), leap):
                self.step = leap
                return leap
        return 0.0

    def _advance(self, target: Target, step: float) -> bool:
        at = self.equilibrium.configuration
        starts = [at]
        if self._earlier is not None:
            guess = at.extrapolate(self._earlier[0], step / self._earlier[1])
            if self._admissible(at, guess):
                starts = [guess]
        try:
            found = solve_equilibrium(self.equations, self.solver, target, starts[0])
        except NewtonFailure:
            return False
        self._earlier = (at, step)
        self.equilibrium, self.target = found, target
        self.iterations += found.iterations
        if found.iterations <= _EASY:
            self.step = max(self.step, step) * _GROW
        elif found.iterations > _HARD:
            self.step = step * _SHRINK
        return True

    def _admissible(self, at: Configuration, guess: Configuration) -> bool:
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


def distance(a: Target, b: Target) -> float:
    """Length of a step of load: 1 for 1 kPa, for 0.05 N mm and for a curvature of 1 1/m."""
    parts = [(b.pressure - a.pressure) / 1e-3]
    if a.moment is not None and b.moment is not None:
        parts.append((b.moment - a.moment) / 0.05)
    if a.curvature is not None and b.curvature is not None:
        parts.append((b.curvature - a.curvature) / 1e-3)
    return float(np.linalg.norm(np.concatenate(parts)))
