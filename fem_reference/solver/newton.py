"""Newton's method with a mixed form for the stiff parts, an inertia correction, and a line search.

The thread's stretch and the elements' volume are stiffer than the silicone's shear by orders of magnitude.
Both are quadratic in small rotations, so a Newton step of the displacement form overshoots by as much.
Segment tensions and element pressures are therefore unknowns while iterating (mixed form). They are condensed
locally: the linear system keeps its size, and the solution is that of the displacement form. The forces of
walls in contact are unknowns too (`wall_pairs`).

A matrix with more negative eigenvalues than the branch has would lead to a saddle or in circles: the inertia
is corrected (`InertiaCorrection`). On the way to another equilibrium the correction stays to the end. If no
matrix has the branch's inertia, the method raises an `UnstableError`; a body that moves by itself is followed
in time (`relax`).

The line search takes the size of the Newton step as its merit (ordinary monotonicity test): where a step is
much longer than the one before, that one is halved. No step is longer than the problem's reach. Neither the
energy nor the residual would do as a merit: a good step swings the inextensible thread, and both jump by
orders of magnitude before they fall.

References
----------
Magisano, Leonetti, Garcea (2017), Advantages of the mixed format in geometrically nonlinear analysis of beams
and shells using solid finite elements, Int. J. Numer. Meth. Eng. 109, §3. Deuflhard (2011), Newton Methods
for Nonlinear Problems, §3.1, for the test.
"""

import logging
from dataclasses import dataclass, replace
from typing import Generic

import numpy as np

from fem_reference.algebra import SingularMatrixError, SymmetricSolver
from fem_reference.errors import NewtonError, UnstableError
from fem_reference.solver.convergence import (
    admissible_part,
    at_noise,
    imbalance,
    is_balanced,
    is_near,
    is_over,
    is_round_off,
)
from fem_reference.solver.equations import Linear, Move, State, Target, Viscous
from fem_reference.solver.inertia_correction import InertiaCorrection
from fem_reference.solver.modified_newton import anderson_steps, modified_newton_steps
from fem_reference.solver.options import DEFAULT, LineSearchOptions, SolverOptions
from fem_reference.solver.problem import Equilibrium, Problem
from fem_reference.solver.step_lengthening import StepLengthening

_LOG = logging.getLogger(__name__)


def solve_equilibrium(
    problem: Problem[State, Target, Linear, Move, Viscous],
    solver: SymmetricSolver,
    target: Target,
    start: State,
    inertia: int = 0,
    viscous: Viscous | None = None,
    on_the_way: bool = False,
    convex: float | None = None,
    options: SolverOptions = DEFAULT,
) -> Equilibrium[State, Linear]:
    """Equilibrium under ``target`` that Newton's method finds from ``start``.

    The solver keeps the factors there: of the convexified matrix if the equilibrium's ``convex`` is not None.

    Parameters
    ----------
    problem, solver, target : equations, linear solver, and loads.
    start : configuration to iterate from.
    inertia : negative eigenvalues of the branch of equilibria: 0 for minima of the energy.
    viscous : resistance of a step in time, which is solved roughly.
    on_the_way : whether the equilibrium only leads to the next one, and may be rough.
    convex : share of the rod's curvature stiffness that the first matrix, convexified, leaves out; None to
        try the stiffness itself first.
    options : of the solvers.

    Raises
    ------
    UnstableError
        If a convexified stiffness has more negative eigenvalues than the branch.
    NewtonError
        If the method does not converge for another reason.
    """
    sizes: list[float] = []
    found = _iterate(problem, solver, target, start, inertia, viscous, on_the_way, convex, sizes, options)
    return replace(found, longest=max(sizes, default=0.0))


def _iterate(
    problem: Problem[State, Target, Linear, Move, Viscous],
    solver: SymmetricSolver,
    target: Target,
    start: State,
    inertia: int,
    viscous: Viscous | None,
    on_the_way: bool,
    least_convex: float | None,
    sizes: list[float],
    options: SolverOptions,
) -> Equilibrium[State, Linear]:
    """See `solve_equilibrium`; the sizes of steps are appended to ``sizes``."""
    own, line_search, convergence = options.newton, options.line_search, options.convergence
    tolerances = problem.tolerances
    at = problem.begin(start, target)
    history: list[float] = []
    last: _TakenStep[State, Move, Linear] | None = None
    before: Linear | None = None
    correction = InertiaCorrection(
        problem, solver, inertia, viscous is None, least_convex or 0.0, options.inertia_correction
    )
    lengthening = StepLengthening(options.step_lengthening)
    convex = least_convex is not None
    size, excess, too_long = np.inf, None, 0
    # Whether contact stays convex to the end, as the stiffness had too many negative pivots nearby.
    convex_to_the_end = False
    # Least force that the branch's own stiffness has left after the first iteration; and iterations since.
    least, since = 0.0, 0
    # Whether accelerated steps have led here.
    accelerated = False
    for iteration in range(own.iterations if viscous is None else own.time_step_iterations):
        linear = problem.linearise(at, target, viscous, before)
        force, moment = imbalance(problem, linear, target, iteration)
        least, since = (force, 0) if convex or iteration <= 1 or force < least else (least, since + 1)
        if since == own.stagnant_iterations and tolerances.exact_stiffness and viscous is None:
            raise NewtonError(f"{since} iterations leave more force than the {least:.1e} N before them")
        try:
            # Far from equilibrium, a stiffness that has another inertia mostly has it one step on too.
            if not (convex and (on_the_way or convex_to_the_end or size > tolerances.modified_newton_step)):
                negative = solver.factorise(problem.pattern.matrix(linear.data), problem.pattern.revision)
                excess = problem.excess(solver, linear, negative)
                if is_balanced(force, moment, convergence):
                    return _settled(problem, solver, at, linear, iteration, force, excess)
                convex = excess is not None and excess > inertia and force > own.inertia_force
                convex_to_the_end = (
                    convex and not tolerances.exact_stiffness and size <= tolerances.modified_newton_step
                )
            if convex:
                correction.factorise(at, linear, iteration == 0 and viscous is None)
            step = problem.newton_step(solver, linear, target)
            last_size, size = size, problem.size(step, linear)
            sizes.append(size)
            if not convex and last is not None and last.overshot(size, tolerances.max_step, line_search):
                _LOG.debug("the step would grow to %.2e mm: the last one is halved", size)
                last, before = last.halved(), last.linear
                at, _ = admissible_part(
                    problem, last.origin, last.step, last.linear, last.fraction, line_search.cuts
                )
                continue
        except SingularMatrixError as error:
            raise NewtonError(f"iteration {iteration}: {error}") from error
        _LOG.debug(
            "iteration %d: force %.2e N, moment %.2e N mm, step %.2e mm, excess %s%s",
            *(iteration, force, moment, size, excess, ", corrected" if convex else ""),
        )
        if is_round_off(size, force, moment, convergence):
            return _settled(problem, solver, at, linear, iteration, force, excess)
        patient = accelerated or iteration >= convergence.noise_after
        held = convex and correction.bare and not tolerances.exact_stiffness
        noise = linear.walls_touch and at_noise(problem, step, force, moment, convergence)
        if patient and (noise or (held and is_over(size, force, moment, convergence))):
            if held:
                return Equilibrium(at, linear, iteration, force, inertia, convex=correction.next_share)
            return _settled(problem, solver, at, linear, iteration, force, excess)
        history.append(force)
        too_long += convex and size > tolerances.max_step
        if too_long == own.long_steps:
            raise NewtonError(
                f"{too_long} steps of more than {tolerances.max_step} mm with a corrected stiffness"
            )
        fraction = min(problem.longest(step), tolerances.max_step / max(size, tolerances.max_step))
        if viscous is not None and iteration == 0 and fraction < 1.0:
            raise NewtonError(f"the step in time would be one of {size:.1e} mm")
        # The first step sets the threads' tension by the residual of their stretch; the next may be longer.
        last = None if convex or iteration == 0 else _TakenStep(at, step, linear, size, fraction)
        if convex and not tolerances.exact_stiffness and viscous is None and fraction == 1.0:
            fraction = lengthening.factor(step.positions)
        else:
            lengthening.forget()
        (at, whole), before = admissible_part(problem, at, step, linear, fraction, line_search.cuts), linear
        if not whole:
            lengthening.forget()
        if viscous is not None and whole:
            remaining, _ = imbalance(
                problem, problem.update_forces(linear, at, target, viscous), target, iteration
            )
            # A step in time that leaves more force leads to crushed elements.
            if remaining <= convergence.rough_force:
                return Equilibrium(at, None, iteration + 1, remaining, None)
        # The first stiffness is that of the threads' old tension.
        if not (whole and fraction == 1.0 and iteration > 0):
            continue
        # Single nodes between close walls take a second small step to share out their forces.
        settled = (
            not convex
            or force <= convergence.rough_force
            or last_size <= convergence.rough_step * tolerances.modified_newton_step
        )
        if on_the_way and settled and is_near(problem.tolerances, size, last_size, convergence):
            # Without the inertia from the solver, contact is never made convex.
            left = inertia if convex else None if excess is None else min(excess, inertia)
            return Equilibrium(
                at, None, iteration + 1, force, left, convex=correction.next_share if convex else None
            )
        if on_the_way and convex and size <= tolerances.modified_newton_step and problem.keeps(linear, at):
            at, linear, force, softest = anderson_steps(problem, solver, target, at, linear, True, options)
            if softest is not None:
                return Equilibrium(at, None, iteration + 1, force, inertia, convex=correction.next_share)
            continue
        if viscous is not None or (convex and not (tolerances.exact_stiffness or convex_to_the_end)):
            continue
        if size <= tolerances.modified_newton_step * (own.anderson_step if convex else 1.0) and problem.keeps(
            linear, at
        ):
            if convex:
                at, linear, force, softest = anderson_steps(
                    problem, solver, target, at, linear, False, options
                )
                if softest is not None and softest < 0.0:
                    raise UnstableError("the stiffness is negative along accelerated steps")
                # Walls may have come apart since the last factors: only new ones tell how far they move.
                accelerated = softest is not None
                continue
            at, linear, force, balanced = modified_newton_steps(
                problem, solver, target, at, linear, size, options
            )
            # Negative pivots are those of the stiffness here, not of one nearby.
            if balanced and not tolerances.exact_stiffness and not excess:
                return _settled(problem, solver, at, linear, iteration + 1, force, excess)
    raise NewtonError(
        f"no convergence in {len(history)} iterations; the last residual forces are "
        + ", ".join(f"{r:.1e}" for r in history[-3:])
        + " N"
    )


@dataclass(frozen=True)
class _TakenStep(Generic[State, Move, Linear]):
    """A step that was taken, which the line search may halve."""

    origin: State
    step: Move
    linear: Linear
    size: float
    fraction: float
    halvings: int = 0

    def overshot(self, size: float, reach: float, options: LineSearchOptions) -> bool:
        """Whether the next step, of that ``size``, fails the monotonicity test, and halvings are left."""
        most = max(options.growth * self.size, options.growth_floor * reach)
        return size > most and self.halvings < options.halvings

    def halved(self) -> "_TakenStep[State, Move, Linear]":
        """The same step at half its length."""
        return _TakenStep(
            self.origin, self.step, self.linear, self.size, 0.5 * self.fraction, self.halvings + 1
        )


def _settled(
    problem: Problem[State, Target, Linear, Move, Viscous],
    solver: SymmetricSolver,
    at: State,
    linear: Linear,
    iterations: int,
    force: float,
    excess: int | None,
) -> Equilibrium[State, Linear]:
    """Equilibrium with its inertia apart from that of contact, and its own factors in the solver."""
    as_it_is = excess
    if excess:
        data = problem.contact.convexified(linear) - problem.contact.core_curvature_stiffness(linear)
        excess = solver.factorise(problem.pattern.matrix(data), problem.pattern.revision)
        excess = problem.excess(solver, linear, excess)
        solver.factorise(problem.pattern.matrix(linear.data), problem.pattern.revision)
    return Equilibrium(at, linear, iterations, force, excess, negative_eigenvalues_true_contact=as_it_is)
