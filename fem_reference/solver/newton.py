"""Newton's method for equilibria: mixed unknowns for the stiff parts, inertia, and a line search.

Two parts are stiff beyond comparison with the silicone's shear: the thread's stretch and the elements'
volume. Both are quadratic in small rotations, so that a plain Newton step from a displacement-only form
overshoots by orders of magnitude. Their forces (segment tension, element pressure) are therefore unknowns of
their own while iterating; they are condensed locally, so the linear system keeps its size, and the solution
is that of the displacement form. So are the forces between walls in contact (`wall_pairs`).

A matrix with more negative eigenvalues than the branch of equilibria has would lead to a saddle or round in
circles. Contact is then made convex: that of walls pair by pair, and that with the rod, where this does not
do, with less of its roundness, off which a pressed wall slides; on the way to another equilibrium it then
stays so to the end. Where that is not enough, the silicone's viscous matrix is added for a few iterations. If
the matrix stays indefinite, the method gives up, and says so by an `UnstableError`: what moves by itself is
followed in time (see `creep`).

Globalisation is a line search whose merit is the size of the Newton step itself: a step may not be much
longer than the one before (the ordinary monotonicity test), or that one is taken again at half its length; no
step is longer than the problem's reach. The energy would not do for a merit: a good step swings the
inextensible thread, and its energy jumps by orders of magnitude before it falls. Nor would the residual
forces, for the same reason.

References
----------
Magisano, Leonetti, Garcea (2017), Advantages of the mixed format in geometrically nonlinear analysis of beams
and shells using solid finite elements, Int. J. Numer. Meth. Eng. 109, §3. Deuflhard (2011), Newton Methods
for Nonlinear Problems, §3.1, for the test.
"""

import logging
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from fem_reference.algebra import SingularMatrixError, SymmetricSolver
from fem_reference.errors import NewtonError, UnstableError
from fem_reference.solver.convergence import (
    FORCE_TOLERANCE,
    MOMENT_TOLERANCE,
    ROUGH,
    ROUGH_FORCE,
    admissible_part,
    at_noise,
    imbalance,
    is_near,
    is_over,
)
from fem_reference.solver.inertia_correction import InertiaCorrection
from fem_reference.solver.modified_newton import anderson_steps, modified_newton_steps
from fem_reference.solver.problem import Equilibrium, Problem
from fem_reference.solver.step_lengthening import StepLengthening

_LOG = logging.getLogger(__name__)

# A step of this size [mm] under forces below that [N] is round-off of a large mesh.
_ROUND_OFF_STEP, _ROUND_OFF_FORCE = 1e-12, 1e-7
MAX_ITERATIONS = 50
# Of a step in time: one that needs more iterations is too long. Only the way's end counts, so that it ends as
# soon as it leaves little force; what leaves much leads to where single elements are crushed, and no next
# step is found.
_CREEP_ITERATIONS = 8

# Iterations before steps that contract by less than this are halved, or taken for the contact's noise.
_SETTLING = 5
_CONTRACTION = 0.7
_PATIENCE = 3
# Iterations in a row, of those that must end with the stiffness itself, that leave more force than the best:
# a shorter step of the load costs less than more of them.
_LOST = 6
# Line search: a step may be this much larger than the one before; how often one is halved; and the share of
# the problem's reach below which growth is let pass.
_GROWTH = 2.0
_MAX_HALVINGS = 2
_FLOOR = 0.1
# Damped steps beyond the problem's reach with which the method gives up, and how often in a row they may
# grow: a matrix that is stiffer than the true one leads to a minimum, if slowly, and away from a saddle.
_TOO_LONG, _GROWING = 3, 6
# Residual [N] above which the inertia must be right.
_INERTIA_ABOVE = 1e-4
# Share of the size below which a stiffness is kept below which one with convex contact is.
_KEPT_CONVEX = 0.4


def solve_equilibrium(
    problem: Problem,
    solver: SymmetricSolver,
    target: Any,
    start: Any,
    inertia: int = 0,
    viscous: Any = None,
    on_the_way: bool = False,
    convex: float | None = None,
) -> Equilibrium:
    """Iterate from ``start`` to equilibrium under ``target``; the solver is left with the factors there.

    They are those with convex contact where the equilibrium was found with it, and says so.

    Parameters
    ----------
    problem, solver, target : what, by what, and under which loads.
    start : configuration to iterate from.
    inertia : negative eigenvalues of the branch of equilibria that is followed: 0 for minima of the energy.
    viscous : resistance for a step in time, which is solved roughly.
    on_the_way : that it only leads to the next one, and may be rough.
    convex : share of the rod's roundness to leave out to begin with, walls convex, without a look at the
        stiffness as it is; None for a look.

    Raises
    ------
    UnstableError
        Where the stiffness has more negative eigenvalues than that, contact taken as convex.
    NewtonError
        When it does not converge for another reason.
    """
    sizes: list[float] = []
    found = _iterate(problem, solver, target, start, inertia, viscous, on_the_way, convex, sizes)
    return replace(found, longest=max(sizes, default=0.0))


def _iterate(
    problem: Problem,
    solver: SymmetricSolver,
    target: Any,
    start: Any,
    inertia: int,
    viscous: Any,
    on_the_way: bool,
    least_convex: float | None,
    sizes: list[float],
) -> Equilibrium:
    """See `solve_equilibrium`; ``sizes`` of steps are added to a list."""
    at = problem.begin(start, target)
    history: list[float] = []
    last: _TakenStep | None = None
    before: Any = None
    correction = InertiaCorrection(problem, solver, inertia, viscous is None, least_convex or 0.0)
    lengthening = StepLengthening()
    convex = least_convex is not None
    size, excess, too_long, growing = np.inf, None, 0, 0
    # Whether contact stays convex to the end, as the stiffness was seen to have more negative pivots nearby.
    convex_to_the_end = False
    # The least force that the branch's own stiffness has left, but for the first; and iterations since.
    least, since = 0.0, 0
    # Whether mixed steps have led here.
    mixed = False
    for iteration in range(MAX_ITERATIONS if viscous is None else _CREEP_ITERATIONS):
        linear = problem.linearise(at, target, viscous, before)
        force, moment = imbalance(problem, linear, target, iteration)
        least, since = (force, 0) if convex or iteration <= 1 or force < least else (least, since + 1)
        if since == _LOST and problem.exact and viscous is None:
            raise NewtonError(f"{since} iterations leave more force than the {least:.1e} N before them")
        try:
            # Far from equilibrium a matrix that was not the branch's is not likely to be so one step on.
            if not (convex and (on_the_way or convex_to_the_end or size > problem.nearby)):
                negative = solver.factorise(problem.pattern.matrix(linear.data), problem.pattern.revision)
                excess = problem.excess(solver, linear, negative)
                if force <= FORCE_TOLERANCE and moment <= MOMENT_TOLERANCE:
                    return _settled(problem, solver, at, linear, iteration, force, excess)
                convex = excess is not None and excess > inertia and force > _INERTIA_ABOVE
                convex_to_the_end = convex and not problem.exact and size <= problem.nearby
            if convex:
                correction.factorise(at, linear, iteration == 0 and viscous is None)
            step = problem.newton_step(solver, linear, target)
            last_size, size = size, problem.size(step, linear)
            sizes.append(size)
            if not convex and last is not None and last.overshot(size, problem.reach):
                _LOG.debug("the step would grow to %.2e mm: the last one is halved", size)
                last, before = last.halved(), last.linear
                at, _ = admissible_part(problem, last.origin, last.step, last.linear, last.fraction)
                continue
        except SingularMatrixError as error:
            raise NewtonError(f"iteration {iteration}: {error}") from error
        _LOG.debug(
            "iteration %d: force %.2e N, moment %.2e N mm, step %.2e mm, excess %s%s",
            *(iteration, force, moment, size, excess, ", damped" if convex else ""),
        )
        if size <= _ROUND_OFF_STEP and force <= _ROUND_OFF_FORCE and moment <= MOMENT_TOLERANCE:
            return _settled(problem, solver, at, linear, iteration, force, excess)
        patient = mixed or iteration >= _PATIENCE
        held = convex and correction.bare and not problem.exact
        noise = linear.walls_touch and at_noise(problem, step, force, moment)
        if patient and (noise or (held and is_over(size, force, moment))):
            if held:
                return Equilibrium(at, linear, iteration, force, inertia, convex=correction.next_share)
            return _settled(problem, solver, at, linear, iteration, force, excess)
        history.append(force)
        too_long += convex and size > problem.reach
        if too_long == _TOO_LONG:
            raise NewtonError(f"{too_long} steps of more than {problem.reach} mm with another stiffness")
        growing = growing + 1 if problem.exact and convex and size > last_size > 0.0 else 0
        if growing > _GROWING:
            raise UnstableError(f"{growing} steps with another stiffness grow, each from the one before")
        stalled = iteration >= _SETTLING and last is not None and size > _CONTRACTION * last.size
        longest = min(problem.longest(step), problem.reach / max(size, problem.reach))
        fraction = min(longest, 0.5 if stalled else 1.0)
        if viscous is not None and iteration == 0 and fraction < 1.0:
            raise NewtonError(f"the step in time would be one of {size:.1e} mm")
        # The first step sets the tension of the threads by the residual of their stretch; the next, free of
        # it, may well be longer.
        last = None if convex or iteration == 0 else _TakenStep(at, step, linear, size, fraction)
        if convex and not problem.exact and viscous is None and fraction == 1.0:
            fraction = lengthening.factor(step.positions)
        else:
            lengthening.forget()
        (at, whole), before = admissible_part(problem, at, step, linear, fraction), linear
        if not whole:
            # The next step does not tell what this one would have done.
            lengthening.forget()
        if viscous is not None and whole:
            remaining, _ = imbalance(
                problem, problem.update_forces(linear, at, target, viscous), target, iteration
            )
            if remaining <= ROUGH_FORCE:
                return Equilibrium(at, None, iteration + 1, remaining, None)
        # The first stiffness still has the threads' old tension in it.
        if not (whole and fraction == 1.0 and iteration > 0):
            continue
        settled = not convex or force <= ROUGH_FORCE or last_size <= ROUGH * problem.nearby
        if on_the_way and settled and is_near(problem, size, last_size):
            # A solver that does not tell the inertia is never led to convex contact.
            left = inertia if convex else None if excess is None else min(excess, inertia)
            return Equilibrium(
                at, None, iteration + 1, force, left, convex=correction.next_share if convex else None
            )
        if on_the_way and convex and size <= problem.nearby and problem.keeps(linear, at):
            at, linear, force, softest = anderson_steps(problem, solver, target, at, linear, True)
            if softest is not None:
                return Equilibrium(at, None, iteration + 1, force, inertia, convex=correction.next_share)
            continue
        if viscous is not None or (convex and not (problem.exact or convex_to_the_end)):
            continue
        if size <= problem.nearby * (_KEPT_CONVEX if convex else 1.0) and problem.keeps(linear, at):
            if convex:
                at, linear, force, softest = anderson_steps(problem, solver, target, at, linear, False)
                if softest is not None and softest < 0.0:
                    raise UnstableError("mixed steps lead to where the stiffness is negative along them")
                # What was in contact where the factors are from may have come free since: only new ones tell
                # how far it still is.
                mixed = softest is not None
                continue
            at, linear, force, balanced = modified_newton_steps(problem, solver, target, at, linear, size)
            # Negative pivots are judged by the stiffness here, not by one nearby.
            if balanced and not problem.exact and not excess:
                return _settled(problem, solver, at, linear, iteration + 1, force, excess)
    raise NewtonError(
        f"no convergence in {len(history)} iterations; the last residual forces are "
        + ", ".join(f"{r:.1e}" for r in history[-3:])
        + " N"
    )


@dataclass(frozen=True)
class _TakenStep:
    """A step that was taken, to be taken again at half its length if it led astray."""

    origin: Any
    step: Any
    linear: Any
    size: float
    fraction: float
    halvings: int = 0

    def overshot(self, size: float, reach: float) -> bool:
        """Whether the step that followed grew, and a shorter one is worth trying."""
        return size > max(_GROWTH * self.size, _FLOOR * reach) and self.halvings < _MAX_HALVINGS

    def halved(self) -> "_TakenStep":
        return _TakenStep(
            self.origin, self.step, self.linear, self.size, 0.5 * self.fraction, self.halvings + 1
        )


def _settled(
    problem: Problem,
    solver: SymmetricSolver,
    at: Any,
    linear: Any,
    iterations: int,
    force: float,
    excess: int | None,
) -> Equilibrium:
    """The equilibrium, with its inertia free of the contact's own, and the exact factors in the solver."""
    as_it_is = excess
    if excess:
        data = problem.convexified_contact(linear) - problem.core_curvature_stiffness(linear)
        excess = solver.factorise(problem.pattern.matrix(data), problem.pattern.revision)
        excess = problem.excess(solver, linear, excess)
        solver.factorise(problem.pattern.matrix(linear.data), problem.pattern.revision)
    return Equilibrium(at, linear, iterations, force, excess, negative_eigenvalues_true_contact=as_it_is)
