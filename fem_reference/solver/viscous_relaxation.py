"""Where a body goes by itself: from a state that has lost its balance down to an equilibrium, in time.

The silicone is taken as viscous, and time is stepped by backward Euler. A wall that snaps, or a body that has
no equilibrium nearby under its new load, creeps downhill until it comes to rest; the last step is the
equilibrium's own. The viscosity's size is of no account, as only its steps are chosen: as long as they
converge in few iterations, and shorter where the stiffness with the viscous one is still not positive. Rigid
motions meet no resistance: a wall that snaps does not keep the rest of a slender body from following.
"""

import logging
import math
from dataclasses import replace
from typing import Any

from fem_reference.algebra import SymmetricSolver
from fem_reference.errors import NewtonError
from fem_reference.solver.newton import solve_equilibrium
from fem_reference.solver.problem import Equilibrium, Problem

_LOG = logging.getLogger(__name__)

# Rate τ/Δt of the first step; by how much it falls after an easy one and rises after one that failed; and its
# bounds: below the first, the next step is to equilibrium itself.
_FIRST_RATE = 0.5
_FASTER, _SLOWER = 2.0, 3.0
_AT_REST, _LARGEST_RATE = 0.03, 1e3
_EASY = 3
# The longest step after one that failed, as a share of what that one would have been, and how it grows again:
# where walls slide, one that fails costs as much as four that do not.
_BELOW_FAILED, _FORGET = 0.7, 1.1
_MAX_STEPS = 80


def creep(problem: Problem, solver: SymmetricSolver, target: Any, start: Any) -> Equilibrium:
    """Let the body creep from ``start`` to a stable equilibrium under ``target``.

    Raises
    ------
    NewtonError
        Where it does not come to rest, or its steps become too short.
    """
    at, rate, iterations = start, _FIRST_RATE, 0
    # Length of the last step times its rate, and of the longest that is tried.
    reached, longest = math.inf, math.inf
    reason = ""
    for step in range(_MAX_STEPS):
        final = rate < _AT_REST
        try:
            resistance = None if final else problem.viscous(at, rate)
            found = solve_equilibrium(problem, solver, target, at, viscous=resistance)
        except NewtonError as error:
            _LOG.debug("creep %d: a step at rate %.3g failed: %s", step, rate, error)
            reason = str(error)
            rate = _AT_REST if final else rate
            longest = _BELOW_FAILED * reached / rate
            rate *= _SLOWER
            if rate > _LARGEST_RATE:
                break
            continue
        iterations += found.iterations
        at = found.configuration
        if final:
            _LOG.debug("creep: at rest after %d steps", step)
            return replace(found, configuration=at, iterations=iterations, convex=None)
        _LOG.debug("creep %d: rate %.3g, %d iterations", step, rate, found.iterations)
        reached, longest = found.longest * rate, _FORGET * longest
        if found.iterations <= _EASY and _FASTER * found.longest <= max(longest, problem.noise):
            rate /= _FASTER
    raise NewtonError(f"the body does not creep to rest in {step + 1} steps; the last failure: {reason}")
