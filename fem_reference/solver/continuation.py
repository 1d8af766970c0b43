"""Continuation of equilibria along straight paths of load, with extrapolation and step control.

Where Newton's method finds no equilibrium near the last one, walls have lost their balance, and viscous
relaxation follows the body to the next stable one.
"""

import logging
import math
from dataclasses import dataclass, replace
from typing import Any, Generic

import numpy as np
from jaxtyping import Float

from fem_reference.algebra import SymmetricSolver
from fem_reference.errors import NewtonError, UnstableError
from fem_reference.solver.equations import Linear, Load, Move, State, Viscous
from fem_reference.solver.extrapolation import allowed_step, weights
from fem_reference.solver.newton import solve_equilibrium
from fem_reference.solver.options import DEFAULT, SolverOptions
from fem_reference.solver.problem import Equilibrium, Problem
from fem_reference.solver.viscous_relaxation import relax

_LOG = logging.getLogger(__name__)


class PathError(ArithmeticError):
    """Error for a path that cannot advance: no step converges.

    Parameters
    ----------
    message : reason.
    last, target : last equilibrium and its loads.
    unstable : whether the path ended, as asked for, where walls lose their balance.
    """

    def __init__(
        self, message: str, last: Equilibrium[Any, Any], target: Any, unstable: bool = False
    ) -> None:
        super().__init__(message)
        self.last = last
        self.target = target
        self.unstable = unstable


@dataclass(frozen=True)
class PathMemory:
    """State of a path follower beside its equilibrium, to resume a path.

    Parameters
    ----------
    step : length of the next step.
    earlier : configurations before the present one on this straight leg, each with its distance back.
    heading : direction of the leg.
    longest : bound on the next steps, after one that failed.
    """

    step: float
    earlier: list[tuple[Any, float]]
    heading: Float[np.ndarray, " loads"]
    longest: float = math.inf


class PathFollower(Generic[State, Load, Linear, Move, Viscous]):
    """Path of equilibria of a problem, one load after another.

    Parameters
    ----------
    problem, solver : equations, and the linear solver, which others may use between two goals.
    equilibrium, target : equilibrium from which the path starts, and its loads.
    memory : of the path that led here, or the length of a first step in the measure of the target's ``to``.
    creeps : whether viscous relaxation follows the body where walls lose their balance; if not, the path ends
        there.
    options : of the solvers.
    """

    def __init__(
        self,
        problem: Problem[State, Load, Linear, Move, Viscous],
        solver: SymmetricSolver,
        equilibrium: Equilibrium[State, Linear],
        target: Load,
        memory: PathMemory | float = 1.0,
        creeps: bool = True,
        options: SolverOptions = DEFAULT,
    ) -> None:
        self.problem = problem
        self.solver = solver
        self.options = options
        self.equilibrium = equilibrium
        self.target = target
        self.iterations = 0
        #: Last loads before the body jumps on the way to the last goal; None where it does not jump.
        self.limit: Load | None = None
        if not isinstance(memory, PathMemory):
            memory = PathMemory(memory, [], np.zeros(0))
        self.step, self._earlier, self._heading = memory.step, memory.earlier, memory.heading
        self._longest = memory.longest
        self._creeps = creeps
        # Number of the solver's factors at the present equilibrium; whether the last step failed for a loss
        # of balance.
        self._factors, self._unstable = solver.factors, False

    @property
    def jumped(self) -> bool:
        """Whether the body jumps where the load rises to the last goal."""
        return self.limit is not None

    @property
    def memory(self) -> PathMemory:
        """Memory from which another follower resumes this path without a break."""
        return PathMemory(self.step, self._earlier, self._heading, self._longest)

    def follow(self, goal: Load) -> Equilibrium[State, Linear]:
        """Equilibrium at ``goal``, reached from the present one in steps of load.

        The solver keeps the factors at the goal.

        Raises
        ------
        PathError
            If the goal is not reached; it carries the last equilibrium.
        """
        self.limit = None
        origin, change = self.target, self.target.to(goal)
        length = float(np.linalg.norm(change))
        self._turn(change / max(length, np.finfo(float).tiny))
        if length == 0.0 and not self._advance(goal, 0.0):
            raise PathError("the present equilibrium does not converge again", self.equilibrium, origin)
        done, missed = 0.0, self.options.continuation.missed_share * length
        # Targets and lengths of the steps that failed from the present equilibrium.
        failed: list[tuple[Load, float]] = []
        while done < length:
            step = min(self.step, length - done)
            if length - done - step < 0.25 * step:
                step = length - done
            target = origin.between(goal, (done + step) / length)
            if self._advance(target, step, done + step < length):
                done, failed = done + step, []
                continue
            failed.append((target, step))
            near = not self._creeps and done + step >= length and step < missed
            if near and (not self._unstable or step <= self._telling):
                if not self._relax(target, step):
                    raise self._error(step)
                relaxed = step
            else:
                relaxed = self._retreat(failed)
            if relaxed > 0.0:
                done, failed = done + relaxed, []
        if self.equilibrium.negative_eigenvalues_true_contact:
            self._slide_off(goal)
        return self.equilibrium

    def _slide_off(self, goal: Load) -> None:
        """Leave a saddle for a minimum of the energy close by, if there is one.

        Walls are made of facets: pressed on an edge, a node is at a saddle, and at rest beside the edge.
        """
        saddle, own = self.equilibrium, self.options.continuation
        start = self.problem.pushed(self.solver, saddle.configuration, saddle.own_linear)
        if start is not None:
            try:
                found = relax(self.problem, self.solver, goal, start, self.options, own.slide)
            except NewtonError as error:
                _LOG.debug("the saddle stays: %s", error)
            else:
                self._earlier, self._factors = [], self.solver.factors
                self.equilibrium = found
                self.iterations += found.iterations
        if self._factors != self.solver.factors:
            # The pattern may have grown on the way, as other walls came near.
            linear = self.problem.linearise(saddle.configuration, goal)
            self.solver.factorise(self.problem.pattern.matrix(linear.data), self.problem.pattern.revision)
            self.equilibrium, self._factors = replace(saddle, linear=linear), self.solver.factors

    def _turn(self, heading: Float[np.ndarray, " loads"]) -> None:
        """Drop the earlier states where the path turns, as they do not extrapolate around a corner."""
        straight = self.options.continuation.straight
        if heading.shape != self._heading.shape or heading @ self._heading < straight:
            self._earlier = []
        self._heading = heading

    def _retreat(self, failed: list[tuple[Load, float]]) -> float:
        """Shorten the step after those that ``failed``, or relax; return the distance to where it relaxed.

        Each failed step is a target and its distance. Relaxation leads to the first, the farthest, or, if it
        must not leave the branch, to the last, the nearest. The distance is zero if the body is where it was.
        """
        own = self.options.continuation
        _, step = failed[-1]
        self.step, self._longest = 0.5 * step, own.after_failure * step
        lost = self._unstable and not self._creeps
        telling = self._telling if lost else 0.0
        if 0.0 < telling < self.step:
            self.step = max(telling, own.shortest)
        if len(failed) <= own.halvings and own.shortest <= self.step < step:
            return 0.0
        # A step that is as short as any ends the path, though it tell no loss: a soft body moves far over it.
        ends = self.step < own.shortest or (lost and step <= max(telling, own.shortest))
        goal, distance = failed[0] if self._creeps else failed[-1]
        if (self._creeps or ends) and self._relax(goal, distance):
            return distance
        if ends:
            raise self._error(step)
        failed.clear()
        return 0.0

    @property
    def _telling(self) -> float:
        """Longest step that, if it fails, tells a loss of balance; zero where that is not known.

        The load itself moves a body on its branch. Only where that is well within the slide does a body that
        relaxes beyond the slide leave the branch.
        """
        if not self._earlier:
            return 0.0
        own, (before, back) = self.options.continuation, self._earlier[0]
        moved = self.problem.distance(before, self.equilibrium.configuration)
        return own.own_motion * own.slide * back / max(moved, np.finfo(float).tiny)

    def _error(self, step: float) -> PathError:
        """Error for a path whose next step, down to this length, does not converge."""
        unit = self.problem.kilopascals
        here, step = np.round(self.target.pressure * unit, 3), 1e-3 * unit * step
        unstable = self._unstable and not self._creeps
        message = f"stopped at pressures {here} kPa, where steps down to about {step:.2g} kPa fail"
        if unstable:
            message = f"walls lose their balance within {step:.2g} kPa or so of pressures {here} kPa"
        return PathError(message, self.equilibrium, self.target, unstable)

    def _relax(self, target: Load, step: float) -> bool:
        """Relax the body under ``target``; tell whether it came to rest, on this branch if it must not jump.

        A body that comes to rest close by has not jumped: single nodes slid off an edge of the wall that they
        are pressed on, or walls began to lean to one side.
        """
        before, slide = self.equilibrium.configuration, self.options.continuation.slide
        within = math.inf if self._creeps else slide
        try:
            found = relax(self.problem, self.solver, target, before, self.options, within)
        except NewtonError as error:
            _LOG.debug("relaxation over a step of %.3g failed: %s", step, error)
            return False
        # States before a jump do not extrapolate beyond it.
        self._factors, self._earlier = self.solver.factors, []
        self._longest = math.inf
        if self.problem.distance(before, found.configuration) > slide:
            self._jump(self.target)
        self.equilibrium, self.target, self.step = found, target, 2.0 * step
        self.iterations += found.iterations
        return True

    def _jump(self, target: Load) -> None:
        """Keep the first loads where the body jumps."""
        self.limit = target if self.limit is None else self.limit

    def _advance(self, target: Load, step: float, on_the_way: bool = False) -> bool:
        """Solve for ``target``, a step away; tell whether the solve converged."""
        at = self.equilibrium.configuration
        start: State | None = at
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

    def _solve(
        self, problem: Problem[Any, Any, Any, Any, Any], target: Any, start: Any, on_the_way: bool
    ) -> Equilibrium[Any, Any] | None:
        """Equilibrium of this branch by Newton's method; None if it fails."""
        try:
            found = solve_equilibrium(
                problem,
                self.solver,
                target,
                start,
                self.equilibrium.excess_negative or 0,
                on_the_way=on_the_way,
                convex=self.equilibrium.convex,
                options=self.options,
            )
        except NewtonError as error:
            _LOG.debug("no equilibrium: %s", error)
            self._unstable = isinstance(error, UnstableError)
            return None
        self._factors = self.solver.factors
        return found

    def _arrive(self, found: Equilibrium[State, Linear], target: Load, left: Any, step: float) -> None:
        """Continue from ``found``, a step from the configuration ``left``; choose the next step."""
        own = self.options.continuation
        back = [distance for _, distance in self._earlier]
        earlier = [(left, 0.0), *self._earlier][: own.earlier_states]
        self._earlier = [(state, distance + step) for state, distance in earlier] if step > 0.0 else []
        self.equilibrium, self.target = found, target
        self.iterations += found.iterations
        ahead = [distance for _, distance in self._earlier]
        allowed = allowed_step(step, back, ahead, found.longest, self.problem.tolerances.desired_step)
        if found.iterations > own.hard_iterations or allowed < own.shrinkage * step:
            self.step = step * own.shrinkage
        elif found.iterations <= own.easy_iterations or allowed < step:
            self.step = min(max(self.step, step) * own.growth, allowed, self._longest)
            self._longest *= own.recovery

    def _predict(self, target: Load) -> State:
        """Start by the tangent at the present equilibrium, as far as nothing blocks it.

        The stiffness is that under the old load: a new pressure makes that of the same shape indefinite.
        """
        at, linear = self.equilibrium.configuration, self.equilibrium.linear
        if linear is None or self._factors != self.solver.factors:
            linear = self.problem.linearise(at, self.target)
            self.solver.factorise(self.problem.pattern.matrix(linear.data), self.problem.pattern.revision)
        loaded = replace(linear, residual=self.problem.linearise(at, target).residual)
        step = self.problem.newton_step(self.solver, loaded, target)
        fraction = self.problem.longest(step)
        for _ in range(self.options.continuation.predictor_cuts):
            guess = self.problem.advance(at, step, fraction, linear)
            allowed = self.problem.allowed(linear, guess)
            if allowed >= 1.0:
                return guess
            fraction *= allowed
        return at

    def _extrapolate(self, step: float, degree: int) -> State | None:
        """Start by a polynomial through the last states on this leg; None if it amplifies their errors."""
        states, back = zip(*self._earlier[:degree], strict=True)
        if not self._trusts(step, list(back)):
            return None
        return self.problem.mean([self.equilibrium.configuration, *states], weights(step, list(back)))

    def _trusts(self, step: float, back: list[float]) -> bool:
        """Whether a polynomial through these states amplifies their errors little enough."""
        own = self.options.continuation
        by_stride = math.isfinite(self.problem.tolerances.desired_step)
        most = own.amplification_by_stride if by_stride else own.amplification
        return len(back) < 2 or float(np.abs(weights(step, back)).sum()) <= most
