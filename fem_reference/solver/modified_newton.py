"""Modified Newton method: steps with old factors, which cost a tenth of new ones.

With the branch's own stiffness they shrink fast or are given up; with a convexified matrix Anderson
acceleration combines them (`AndersonMixing`).
"""

import logging

import numpy as np

from fem_reference.algebra import SymmetricSolver
from fem_reference.solver.anderson import AndersonMixing
from fem_reference.solver.convergence import admissible_part, at_noise, imbalance, is_balanced
from fem_reference.solver.equations import Linear, Move, State, Target, Viscous
from fem_reference.solver.options import DEFAULT, SolverOptions
from fem_reference.solver.problem import Problem

_LOG = logging.getLogger(__name__)


def modified_newton_steps(
    problem: Problem[State, Target, Linear, Move, Viscous],
    solver: SymmetricSolver,
    target: Target,
    at: State,
    linear: Linear,
    size: float,
    options: SolverOptions = DEFAULT,
) -> tuple[State, Linear, float, bool]:
    """Steps with the solver's factors, as long as they shrink fast.

    Returns
    -------
    the last state, its linearisation, its residual force, and whether it is an equilibrium.
    """
    own, sizes, force = options.modified_newton, [size], np.inf
    end = own.exact_end if problem.tolerances.exact_stiffness else own.end
    for iteration in range(own.steps):
        linear = problem.update_forces(linear, at, target)
        force, moment = imbalance(problem, linear, target, iteration)
        if is_balanced(force, moment, options.convergence):
            return at, linear, force, True
        step = problem.newton_step(solver, linear, target)
        size = problem.size(step, linear)
        _LOG.debug("  old factors: force %.2e N, moment %.2e N mm, step %.2e mm", force, moment, size)
        if size <= end.step and force <= end.force and moment <= end.moment:
            return at, linear, force, True
        # Steps shrink in pairs: one for the stiff parts' forces, one for what they do.
        if size > own.growth * sizes[-1] or (len(sizes) > 1 and size > own.contraction * sizes[-2]):
            break
        sizes.append(size)
        at, _ = admissible_part(problem, at, step, linear, 1.0, options.line_search.cuts)
        if not problem.keeps(linear, at):
            break
    return at, linear, force, False


def anderson_steps(
    problem: Problem[State, Target, Linear, Move, Viscous],
    solver: SymmetricSolver,
    target: Target,
    at: State,
    linear: Linear,
    rough: bool,
    options: SolverOptions = DEFAULT,
) -> tuple[State, Linear, float, float | None]:
    """Accelerated steps with the solver's factors, of a convexified matrix, as long as they make progress.

    Returns
    -------
    the last state, its linearisation, its residual force, and, if it is an equilibrium, the least eigenvalue
    of the stiffness over the convexified matrix in the directions of the steps.
    """
    own, convergence = options.anderson, options.convergence
    mixing, smallest, since, restarts = AndersonMixing(problem, own), np.inf, 0, 0
    best, begun = (at, linear, 0.0), at
    end = own.exact_end if problem.tolerances.exact_stiffness else options.modified_newton.end
    for iteration in range(own.steps):
        linear = problem.update_forces(linear, at, target)
        force, moment = imbalance(problem, linear, target, iteration)
        step = problem.newton_step(solver, linear, target)
        size = problem.size(step, linear)
        _LOG.debug("  accelerated: force %.2e N, moment %.2e N mm, step %.2e mm", force, moment, size)
        if min(size, smallest) > problem.tolerances.max_step:
            # The factors say nothing of so far a state, and the search for walls in the way fills the memory.
            break
        since = 0 if size < own.progress * smallest else since + 1
        if size < smallest:
            smallest, best = size, (at, linear, force)
        near = size <= convergence.rough_step * problem.tolerances.modified_newton_step
        if rough and near and force <= convergence.rough_force:
            moved, _ = admissible_part(problem, at, step, linear, 1.0, options.line_search.cuts)
            return moved, linear, force, mixing.smallest
        if size <= end.step and force <= end.force and moment <= end.moment:
            return at, linear, force, mixing.smallest
        in_noise = linear.walls_touch and at_noise(problem, step, force, moment, convergence)
        if since > own.stagnant_steps_in_noise and in_noise:
            # Differences of noise do not estimate a stiffness.
            return at, linear, force, np.inf
        if since > (own.stagnant_steps_in_noise if rough else own.stagnant_steps):
            break
        if size > own.restart_growth * smallest:
            if restarts == own.restarts or best[0] is begun:
                break
            (at, linear, _), mixing, restarts = best, AndersonMixing(problem, own), restarts + 1
            begun = at
            step = problem.newton_step(solver, linear, target)
        moved = problem.advance(at, step, 1.0, linear)
        mixed = mixing.next(moved, step.positions)
        if not problem.keeps(linear, moved) or problem.allowed(linear, mixed) < 1.0:
            break
        at = mixed
    return *best, None
