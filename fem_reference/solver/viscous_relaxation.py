"""Viscous relaxation: from a state that has lost its balance downhill to a stable equilibrium.

The silicone is viscous, and backward Euler steps in time (pseudo-transient continuation). A wall that snaps,
or a body without an equilibrium nearby, moves until it comes to rest; the last step is without viscosity. The
size of the viscosity does not matter, as only the rate of each step counts: it falls where steps converge in
few iterations, and rises where they fail. Rigid motions meet no resistance, so the rest of a slender body
follows a wall that snaps.
"""

import logging
import math
from dataclasses import replace

from fem_reference.algebra import SymmetricSolver
from fem_reference.errors import NewtonError, UnstableError
from fem_reference.solver.equations import Linear, Move, State, Target, Viscous
from fem_reference.solver.newton import solve_equilibrium
from fem_reference.solver.options import DEFAULT, SolverOptions
from fem_reference.solver.problem import Equilibrium, Problem

_LOG = logging.getLogger(__name__)


def relax(
    problem: Problem[State, Target, Linear, Move, Viscous],
    solver: SymmetricSolver,
    target: Target,
    start: State,
    options: SolverOptions = DEFAULT,
    within: float = math.inf,
) -> Equilibrium[State, Linear]:
    """Stable equilibrium under ``target`` to which the viscous body relaxes from ``start``.

    Raises
    ------
    UnstableError
        If a node moves farther than ``within`` [mm].
    NewtonError
        If the body does not come to rest, or its steps become too short.
    """
    own = options.viscous_relaxation
    at, rate, iterations = start, own.first_rate, 0
    # Length of the last step times its rate, and of the longest that is tried.
    reached, longest = math.inf, math.inf
    reason = ""
    # State from which the last step failed, and how often it did from there.
    waited, failures = start, 0
    for step in range(own.steps):
        final = rate < own.at_rest
        try:
            resistance = None if final else problem.viscous(at, rate)
            found = solve_equilibrium(problem, solver, target, at, viscous=resistance, options=options)
        except NewtonError as error:
            _LOG.debug("relaxation %d: a step at rate %.3g failed: %s", step, rate, error)
            reason = str(error)
            if final:
                failures = failures + 1 if failures and problem.distance(waited, at) < own.still else 1
                waited, rate = at, own.at_rest
                if failures == own.last_steps:
                    break
            longest = own.after_failure * reached / rate
            rate *= own.slower
            if rate > own.largest_rate:
                break
            continue
        iterations += found.iterations
        at = found.configuration
        # A slender body's states are straightened to be compared: no work for one that may go anywhere.
        if math.isfinite(within) and (moved := problem.distance(start, at)) > within:
            raise UnstableError(f"the body moves by {moved:.3g} mm and more")
        if final:
            _LOG.debug("relaxation: at rest after %d steps", step)
            return replace(found, configuration=at, iterations=iterations, convex=None)
        _LOG.debug("relaxation %d: rate %.3g, %d iterations", step, rate, found.iterations)
        reached, longest = found.longest * rate, own.recovery * longest
        easy = found.iterations <= own.easy_iterations
        if easy and own.faster * found.longest <= max(longest, problem.tolerances.contact_noise):
            rate /= own.faster
    raise NewtonError(f"the body does not come to rest in {step + 1} steps; the last failure: {reason}")
