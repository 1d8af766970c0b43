"""Continuation of equilibria along straight paths of load, with extrapolation and step control.

Where no equilibrium is found near the last one, walls have lost their balance: the body is then left to creep
to where it goes by itself.
"""

import logging
import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from jaxtyping import Float

from fem_reference.algebra import SymmetricSolver
from fem_reference.errors import NewtonError, UnstableError
from fem_reference.solver.extrapolation import allowed_step, weights
from fem_reference.solver.newton import solve_equilibrium
from fem_reference.solver.problem import Equilibrium, Problem
from fem_reference.solver.viscous_relaxation import creep

_LOG = logging.getLogger(__name__)

# A step is cut when Newton fails, kept where it takes the iterations between, and grown below.
_EASY, _HARD = 4, 8
# Cosine of the angle between two legs of a path that still counts as straight on.
_STRAIGHT = 0.999
_GROW, _SHRINK = 1.6, 0.6
# The longest step after one that failed, and how it grows again with every easy one.
_BELOW_FAILED, _FORGET = 0.7, 1.1
_SMALLEST = 0.05
# Earlier states kept for extrapolation, and the largest sum of absolute weights beyond a straight line; where
# a step is chosen by what a parabola leaves, one that may still be half as long again as the last.
_STATES = 2
_AMPLIFICATION, _AMPLIFICATION_BY_STRIDE = 8.0, 13.0
_PREDICTOR_CUTS = 6
# How often a step is halved before the body is left to creep to its load.
_HALVINGS = 2
# A path that is to end where walls lose their balance ends where its goal fails from this share of the way.
_MISSED = 0.05


class PathError(ArithmeticError):
    """No step forward converged.

    Parameters
    ----------
    message : why.
    last, target : last equilibrium, and what it is under.
    unstable : whether it is because walls lose their balance, and the body was not to creep.
    """

    def __init__(self, message: str, last: Equilibrium, target: Any, unstable: bool = False) -> None:
        super().__init__(message)
        self.last = last
        self.target = target
        self.unstable = unstable


@dataclass(frozen=True)
class PathMemory:
    """What a path follower goes on from, besides the equilibrium at hand.

    Parameters
    ----------
    step : length of the next step.
    earlier : configurations before the present one on this straight leg, and how far back each is.
    heading : direction of the leg.
    longest : no step is longer, after one that failed.
    """

    step: float
    earlier: list[tuple[Any, float]]
    heading: Float[np.ndarray, " loads"]
    longest: float = math.inf


class PathFollower:
    """Equilibria of a problem, one load after another.

    Parameters
    ----------
    problem, solver : what is in equilibrium, and the linear solver, which others may use between two goals.
    equilibrium, target : where the path starts: an equilibrium and what it is under.
    memory : of the path that led here, or the length of a first step in the measure of the target's ``to``.
    creeps : whether the body is left to creep where walls lose their balance; if not, the path ends there.
    """

    def __init__(
        self,
        problem: Problem,
        solver: SymmetricSolver,
        equilibrium: Equilibrium,
        target: Any,
        memory: PathMemory | float = 1.0,
        creeps: bool = True,
    ) -> None:
        self.problem = problem
        self.solver = solver
        self.equilibrium = equilibrium
        self.target = target
        self.iterations = 0
        #: The last loads on the way to the last goal before the body jumps, if it does.
        self.limit: Any = None
        if not isinstance(memory, PathMemory):
            memory = PathMemory(memory, [], np.zeros(0))
        self.step, self._earlier, self._heading = memory.step, memory.earlier, memory.heading
        self._longest = memory.longest
        self._creeps = creeps
        # The solver's factors of the equilibrium at hand, and whether the last step failed for a loss of
        # balance.
        self._factors, self._unstable = solver.factors, False

    @property
    def jumped(self) -> bool:
        """Whether a load that rises to the last goal takes the body there by a jump."""
        return self.limit is not None

    @property
    def memory(self) -> PathMemory:
        """To go on from the present equilibrium as if there had been no break."""
        return PathMemory(self.step, self._earlier, self._heading, self._longest)

    def follow(self, goal: Any) -> Equilibrium:
        """Go from the present equilibrium to ``goal``, in as many steps as it takes.

        The solver is left with the factors at the goal.

        Raises
        ------
        PathError
            When the goal is not reached; it carries the last equilibrium.
        """
        self.limit = None
        origin, change = self.target, self.target.to(goal)
        length = float(np.linalg.norm(change))
        self._turn(change / max(length, np.finfo(float).tiny))
        if length == 0.0 and not self._advance(goal, 0.0):
            raise PathError("the equilibrium at hand does not converge anew", self.equilibrium, origin)
        done = 0.0
        # Of the steps tried from the present equilibrium: how many, and the target and length of the first.
        failed: list[tuple[Any, float]] = []
        while done < length:
            step = min(self.step, length - done)
            if length - done - step < 0.25 * step:
                step = length - done
            target = origin.between(goal, (done + step) / length)
            if self._advance(target, step, done + step < length):
                done, failed = done + step, []
                continue
            failed.append((target, step))
            if done + step >= length and step < _MISSED * length and not self._creeps:
                raise self._error(step)
            if self._retreat(failed):
                done, failed = done + failed[0][1], []
        return self.equilibrium

    def _turn(self, heading: Float[np.ndarray, " loads"]) -> None:
        """Forget the states behind where the path turns: its direction there is worthless."""
        if heading.shape != self._heading.shape or heading @ self._heading < _STRAIGHT:
            self._earlier = []
        self._heading = heading

    def _retreat(self, failed: list[tuple[Any, float]]) -> bool:
        """Shorten the step after those that ``failed``, or let the body creep; tell whether it has crept.

        Each of them is a target and how far it is; a creep leads to the first, the farthest.
        """
        _, step = failed[-1]
        self.step, self._longest = 0.5 * step, _BELOW_FAILED * step
        if len(failed) <= _HALVINGS and self.step >= _SMALLEST:
            return False
        if not self._creeps and self._unstable:
            raise self._error(step)
        if self._creeps and self._creep(*failed[0]):
            return True
        if self.step < _SMALLEST:
            raise self._error(step)
        failed.clear()
        return False

    def _error(self, step: float) -> PathError:
        """That no step forward converges, the last one tried of a length."""
        here = np.round(self.target.pressure * 1e3, 3)
        unstable = self._unstable and not self._creeps
        message = f"stopped at pressures {here} kPa, where steps down to {step:.2g} of about 1 kPa fail"
        if unstable:
            message = f"walls lose their balance within {step:.2g} kPa or so of pressures {here} kPa"
        return PathError(message, self.equilibrium, self.target, unstable)

    def _creep(self, target: Any, step: float) -> bool:
        """Let the body creep to ``target``; tell whether it came to rest."""
        try:
            found = creep(self.problem, self.solver, target, self.equilibrium.configuration)
        except NewtonError as error:
            _LOG.debug("creeping over a step of %.3g failed: %s", step, error)
            return False
        # What lies behind a jump says nothing of the way ahead.
        self._factors, self._earlier = self.solver.factors, []
        self._longest = math.inf
        self._jump(self.target)
        self.equilibrium, self.target, self.step = found, target, 2.0 * step
        self.iterations += found.iterations
        return True

    def _jump(self, target: Any) -> None:
        """Keep loads as those where the body jumps, if they are the first."""
        self.limit = target if self.limit is None else self.limit

    def _advance(self, target: Any, step: float, on_the_way: bool = False) -> bool:
        """Solve for ``target``, a step away; tell whether it converged."""
        at = self.equilibrium.configuration
        start = at
        if self._earlier and step > 0.0:
            guesses = (self._extrapolate(step, count) for count in range(len(self._earlier), 0, -1))
            good = (g for g in guesses if g is not None and self.problem.may_start(at, g))
            start = next(good, None)
            if start is None:
                start = self._predict(target)
        found = self._solve(self.problem, target, start, on_the_way)
        if found is None:
            return False
        _LOG.debug(
            "a step of %.3g: %d iterations, the longest of %.2e mm", step, found.iterations, found.longest
        )
        self._arrive(found, target, at, step)
        return True

    def _solve(self, problem: Problem, target: Any, start: Any, on_the_way: bool) -> Equilibrium | None:
        """The equilibrium of this branch that Newton's method finds; None where it gives up."""
        try:
            found = solve_equilibrium(
                problem,
                self.solver,
                target,
                start,
                self.equilibrium.excess_negative or 0,
                on_the_way=on_the_way,
                convex=self.equilibrium.convex,
            )
        except NewtonError as error:
            _LOG.debug("no equilibrium: %s", error)
            self._unstable = isinstance(error, UnstableError)
            return None
        self._factors = self.solver.factors
        return found

    def _arrive(self, found: Equilibrium, target: Any, left: Any, step: float) -> None:
        """Go on from ``found``, a step from the configuration ``left``; choose the next step."""
        back = [distance for _, distance in self._earlier]
        earlier = [(left, 0.0), *self._earlier][:_STATES]
        self._earlier = [(state, distance + step) for state, distance in earlier] if step > 0.0 else []
        self.equilibrium, self.target = found, target
        self.iterations += found.iterations
        ahead = [distance for _, distance in self._earlier]
        allowed = allowed_step(step, back, ahead, found.longest, self.problem.stride)
        if found.iterations > _HARD or allowed < _SHRINK * step:
            self.step = step * _SHRINK
        elif found.iterations <= _EASY or allowed < step:
            self.step = min(max(self.step, step) * _GROW, allowed, self._longest)
            self._longest *= _FORGET

    def _predict(self, target: Any) -> Any:
        """Where the stiffness at hand takes the equilibrium under the new load, as far as nothing blocks.

        The stiffness is that under the old load: a new pressure makes that of an unchanged shape indefinite.
        """
        at, linear = self.equilibrium.configuration, self.equilibrium.linear
        if linear is None or self._factors != self.solver.factors:
            linear = self.problem.linearise(at, self.target)
            self.solver.factorise(self.problem.pattern.matrix(linear.data), self.problem.pattern.revision)
        loaded = replace(linear, residual=self.problem.linearise(at, target).residual)
        step = self.problem.newton_step(self.solver, loaded, target)
        fraction = self.problem.longest(step)
        for _ in range(_PREDICTOR_CUTS):
            guess = self.problem.advance(at, step, fraction, linear)
            allowed = self.problem.allowed(linear, guess)
            if allowed >= 1.0:
                return guess
            fraction *= allowed
        return at

    def _extrapolate(self, step: float, degree: int) -> Any | None:
        """Polynomial through the last states on this leg; None where it would amplify their errors."""
        states, back = zip(*self._earlier[:degree], strict=True)
        if not self._trusts(step, list(back)):
            return None
        return self.problem.mean([self.equilibrium.configuration, *states], weights(step, list(back)))

    def _trusts(self, step: float, back: list[float]) -> bool:
        """Whether a polynomial through these states does not amplify their errors too much."""
        by_iterations = math.isinf(self.problem.stride)
        most = _AMPLIFICATION if by_iterations else _AMPLIFICATION_BY_STRIDE
        return len(back) < 2 or float(np.abs(weights(step, back)).sum()) <= most
