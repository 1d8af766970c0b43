"""When an iterate is good enough, and how much of a step may be taken."""

import logging
from typing import Any

import numpy as np

from fem_reference.errors import NewtonError
from fem_reference.solver.problem import Problem

_LOG = logging.getLogger(__name__)

# Residual forces [N] and moments [N mm]: chamber pressures give nodal forces of 1e-3 to 1e-2 N, round-off of
# the stiff parts about 1e-11 N.
FORCE_TOLERANCE = 1e-9
MOMENT_TOLERANCE = 1e-8
# Where walls touch, the barrier's gradient jumps a little as contact pairs change kind, and Newton's method
# may end in a cycle about such a jump. It is accepted below this force [N] once the whole step is within the
# problem's noise, which bounds what is lost, and below this moment [N mm].
CONTACT_FORCE_TOLERANCE, CONTACT_MOMENT_TOLERANCE = 1e-3, 1e-4
# Share of the size below which a stiffness is kept, with which an equilibrium on the way to another ends; of
# what the next step would be, if steps shrink on as they do; and the force [N] below which it may do so with
# a matrix that was made convex, or after a second step as small: single nodes between close walls take long
# to share out theirs.
ROUGH, ROUGH_FORCE = 0.2, 5e-2
_ROUGH_NEXT = 0.04
# A step [mm] of a matrix with convex contact that ends the iteration, and the force [N]: a hundredth of where
# a kept stiffness ends it, as the matrix may be so many times too stiff.
_CONVEX_END, _CONVEX_END_FORCE = 1e-8, 1e-7
_MAX_BACKTRACKS = 12


def imbalance(problem: Problem, linear: Any, target: Any, iteration: int) -> tuple[float, float]:
    """Largest residual force and moment."""
    force = float(np.abs(linear.residual).max())
    moment = problem.imbalance(linear, target)
    if not np.isfinite(force + moment):
        raise NewtonError(f"the residual is not finite at iteration {iteration}")
    return force, moment


def is_near(problem: Problem, size: float, last_size: float) -> bool:
    """Whether a step leaves so little that its end is good enough on the way to another equilibrium."""
    ahead = size * min(1.0, size / last_size) if last_size > 0.0 else size
    soon = not problem.exact and size <= problem.nearby and ahead <= _ROUGH_NEXT * problem.nearby
    return soon or size <= ROUGH * problem.nearby


def at_noise(problem: Problem, step: Any, force: float, moment: float) -> bool:
    """Whether all that is left is what the contact's jumps may leave."""
    farthest = float(np.abs(step.positions).max())
    return (
        force <= CONTACT_FORCE_TOLERANCE
        and farthest <= problem.noise
        and moment <= CONTACT_MOMENT_TOLERANCE
        and problem.is_small(step)
    )


def is_over(size: float, force: float, moment: float) -> bool:
    """Whether a step with convex contact, and what called for it, are as good as nothing."""
    return size <= _CONVEX_END and force <= _CONVEX_END_FORCE and moment <= MOMENT_TOLERANCE


def admissible_part(problem: Problem, at: Any, step: Any, linear: Any, fraction: float) -> tuple[Any, bool]:
    """The longest admissible part of a step: no wall crossed, no node in the rod, no element inverted.

    Told with it is whether nothing was in the way.
    """
    whole = True
    for _ in range(_MAX_BACKTRACKS):
        trial = problem.advance(at, step, fraction, linear)
        allowed = problem.allowed(linear, trial)
        if allowed < 1.0:
            whole, plain = False, trial
            trial = problem.keep_walls_apart(at, plain)
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
