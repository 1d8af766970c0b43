"""Steps with a stiffness that is kept: forces alone cost a tenth of new factors.

With the branch's own stiffness they shrink fast or are given up; with convex contact they are mixed
(`AndersonMixing`).
"""

import logging
from typing import Any

import numpy as np

from fem_reference.algebra import SymmetricSolver
from fem_reference.solver.anderson import AndersonMixing
from fem_reference.solver.convergence import (
    FORCE_TOLERANCE,
    MOMENT_TOLERANCE,
    ROUGH,
    ROUGH_FORCE,
    admissible_part,
    at_noise,
    imbalance,
)
from fem_reference.solver.problem import Problem

_LOG = logging.getLogger(__name__)

# A step with a kept stiffness that ends the iteration [mm], the force [N] and the moment [N mm]: strains of
# 1e-6, and an error of 1e-8 of its length in the place of the actuator's tip; further, where a stiffness of
# its own follows; less far where it does after mixed steps, as it ends in contact's noise.
_KEPT_END = 1e-6, 1e-5, MOMENT_TOLERANCE
_EXACT_END = 1e-8, 1e-6, MOMENT_TOLERANCE
_MIXED_END = 1e-5, 1e-4, 1e-5
# Steps with a stiffness that is kept: how many, how fast every other must shrink, and how many times as long
# as the last one may be: the first is often as long as the step before it.
_KEPT_ITERATIONS = 8
_KEPT_CONTRACTION, _KEPT_GROWTH = 0.2, 1.5
# Mixed steps: how many, and after how many that do not shrink to this share of the best they end, for
# good or where contact's noise is all that is left.
_MIXED_ITERATIONS, _MAX_STAGNANT_STEPS, _MAX_STAGNANT_STEPS_IN_NOISE, _STAGNATION_RATIO = 40, 6, 2, 0.9
# One this much longer than the best is of a mean too far, and how often it then starts from the best anew.
_TOO_FAR, _RESTARTS = 3.0, 2


def modified_newton_steps(
    problem: Problem, solver: SymmetricSolver, target: Any, at: Any, linear: Any, size: float
) -> tuple[Any, Any, float, bool]:
    """Steps with the factors at hand, as long as they shrink fast: forces alone cost a tenth of a stiffness.

    Returns where they lead, the last linearisation, its residual force, and whether that is an equilibrium.
    """
    sizes = [size]
    last_step, last_force, last_moment = _EXACT_END if problem.exact else _KEPT_END
    for iteration in range(_KEPT_ITERATIONS):
        linear = problem.update_forces(linear, at, target)
        force, moment = imbalance(problem, linear, target, iteration)
        if force <= FORCE_TOLERANCE and moment <= MOMENT_TOLERANCE:
            return at, linear, force, True
        step = problem.newton_step(solver, linear, target)
        size = problem.size(step, linear)
        _LOG.debug("  kept stiffness: force %.2e N, moment %.2e N mm, step %.2e mm", force, moment, size)
        if size <= last_step and force <= last_force and moment <= last_moment:
            return at, linear, force, True
        # Steps shrink in pairs: one for the stiff parts' forces, one for what they do.
        if size > _KEPT_GROWTH * sizes[-1] or (len(sizes) > 1 and size > _KEPT_CONTRACTION * sizes[-2]):
            break
        sizes.append(size)
        at, _ = admissible_part(problem, at, step, linear, 1.0)
        if not problem.keeps(linear, at):
            break
    return at, linear, force, False


def anderson_steps(
    problem: Problem, solver: SymmetricSolver, target: Any, at: Any, linear: Any, rough: bool
) -> tuple[Any, Any, float, float | None]:
    """Mixed steps with the factors at hand, of convex contact, as long as they lead on.

    Returns where they lead, the last linearisation, its residual force, and if that is an equilibrium, the
    least eigenvalue of the stiffness in the steps' directions, over that with convex contact.
    """
    mixing, smallest, since, restarts = AndersonMixing(problem), np.inf, 0, 0
    best, begun = (at, linear, 0.0), at
    last_step, last_force, last_moment = _MIXED_END if problem.exact else _KEPT_END
    for iteration in range(_MIXED_ITERATIONS):
        linear = problem.update_forces(linear, at, target)
        force, moment = imbalance(problem, linear, target, iteration)
        step = problem.newton_step(solver, linear, target)
        size = problem.size(step, linear)
        _LOG.debug("  mixed: force %.2e N, moment %.2e N mm, step %.2e mm", force, moment, size)
        if min(size, smallest) > problem.reach:
            # What the factors know nothing of: so far away even a look for walls in the way fills the memory.
            break
        since = 0 if size < _STAGNATION_RATIO * smallest else since + 1
        if size < smallest:
            smallest, best = size, (at, linear, force)
        if rough and size <= ROUGH * problem.nearby and force <= ROUGH_FORCE:
            moved, _ = admissible_part(problem, at, step, linear, 1.0)
            return moved, linear, force, mixing.smallest
        if size <= last_step and force <= last_force and moment <= last_moment:
            return at, linear, force, mixing.smallest
        in_noise = linear.walls_touch and at_noise(problem, step, force, moment)
        if since > _MAX_STAGNANT_STEPS_IN_NOISE and in_noise:
            # Steps of contact's noise do not tell a stiffness.
            return at, linear, force, np.inf
        if since > (_MAX_STAGNANT_STEPS_IN_NOISE if rough else _MAX_STAGNANT_STEPS):
            break
        if size > _TOO_FAR * smallest:
            if restarts == _RESTARTS or best[0] is begun:
                break
            # Back to the best, and another way from there.
            (at, linear, _), mixing, restarts = best, AndersonMixing(problem), restarts + 1
            begun = at
            step = problem.newton_step(solver, linear, target)
        moved = problem.advance(at, step, 1.0, linear)
        mixed = mixing.next(moved, step.positions)
        if not problem.keeps(linear, moved) or problem.allowed(linear, mixed) < 1.0:
            break
        at = mixed
    return *best, None
