"""Tests of convergence, and the admissible part of a step."""

import logging

import numpy as np

from fem_reference.errors import NewtonError
from fem_reference.solver.equations import Equations, Linear, Move, State, Target, Viscous
from fem_reference.solver.options import DEFAULT, ConvergenceOptions
from fem_reference.solver.problem import Problem, Tolerances

_LOG = logging.getLogger(__name__)


def imbalance(
    equations: Equations[State, Target, Linear, Move, Viscous], linear: Linear, target: Target, iteration: int
) -> tuple[float, float]:
    """Largest residual force and moment."""
    force = float(np.abs(linear.residual).max())
    moment = equations.imbalance(linear, target)
    if not np.isfinite(force + moment):
        raise NewtonError(f"the residual is not finite at iteration {iteration}")
    return force, moment


def is_balanced(force: float, moment: float, options: ConvergenceOptions) -> bool:
    """Whether residual force and moment are those of an equilibrium."""
    return force <= options.force and moment <= options.moment


def is_round_off(size: float, force: float, moment: float, options: ConvergenceOptions) -> bool:
    """Whether a step and its residual are the round-off of a large mesh."""
    return size <= options.round_off_step and force <= options.round_off_force and moment <= options.moment


def is_near(tolerances: Tolerances, size: float, last_size: float, options: ConvergenceOptions) -> bool:
    """Whether a step ends a rough equilibrium, one on the way to another."""
    ahead = size * min(1.0, size / last_size) if last_size > 0.0 else size
    nearby = tolerances.modified_newton_step
    soon = not tolerances.exact_stiffness and size <= nearby and ahead <= options.rough_next_step * nearby
    return soon or size <= options.rough_step * nearby


def at_noise(
    problem: Problem[State, Target, Linear, Move, Viscous],
    step: Move,
    force: float,
    moment: float,
    options: ConvergenceOptions = DEFAULT.convergence,
) -> bool:
    """Whether a step and its residual are within contact's noise.

    The barrier's gradient jumps where contact pairs change kind, and Newton's method may cycle about a jump.
    """
    farthest = float(np.abs(step.positions).max())
    return (
        force <= options.noise_force
        and farthest <= problem.tolerances.contact_noise
        and moment <= options.noise_moment
        and problem.is_small(step)
    )


def is_over(size: float, force: float, moment: float, options: ConvergenceOptions) -> bool:
    """Whether a step with a convexified matrix ends the iteration."""
    return size <= options.convex_step and force <= options.convex_force and moment <= options.moment


def admissible_part(
    problem: Problem[State, Target, Linear, Move, Viscous],
    at: State,
    step: Move,
    linear: Linear,
    fraction: float,
    cuts: int = DEFAULT.line_search.cuts,
) -> tuple[State, bool]:
    """State after the longest admissible part of a step, and whether nothing blocked it.

    No wall is crossed, no node enters the rod, and no element is inverted.
    """
    whole = True
    for _ in range(cuts):
        trial = problem.advance(at, step, fraction, linear)
        allowed = problem.allowed(linear, trial)
        if allowed < 1.0:
            whole, plain = False, trial
            trial = problem.contact.keep_walls_apart(at, plain)
            if trial is not plain:
                allowed = problem.allowed(linear, trial)
        if allowed >= 1.0:
            if not whole:
                _LOG.debug("%.3g of a step taken, as something is in the way", fraction)
            return trial, whole
        fraction *= allowed
    raise NewtonError(
        f"no admissible step: a wall, the rod or an element blocks it at {fraction:.1e} of its length"
    )
