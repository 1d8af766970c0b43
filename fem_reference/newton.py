"""Newton's method for equilibria: mixed unknowns for the stiff parts, a shift where it is unstable, damping.

Two parts are stiff beyond comparison with the silicone's shear: the thread's stretch and the elements'
volume. Both are quadratic in small rotations, so that a plain Newton step from a displacement-only form
overshoots by orders of magnitude. Their forces (segment tension, element pressure) are therefore unknowns of
their own while iterating; they are condensed locally, so the linear system keeps its size, and the solution
is that of the displacement form.

Far from equilibrium a matrix with the wrong inertia would lead to a saddle or round in circles; a multiple of
the identity is then added until the inertia is that of a minimum. Close to equilibrium the matrix is left as
it is.

Globalisation is a line search whose merit is the size of the Newton step itself: a step may not be much
longer than the one before (the ordinary monotonicity test), or that one is taken again at half its length; no
step is longer than the problem's reach. The energy would not do for a merit: a good step swings the
inextensible thread, and its energy jumps by orders of magnitude before it falls. Nor would the residual
forces, for the same reason.

References
----------
Magisano, Leonetti, Garcea (2017), Advantages of the mixed format in geometrically nonlinear analysis of beams
and shells using solid finite elements, Int. J. Numer. Meth. Eng. 109, §3. Nocedal and Wright (2006),
Numerical Optimization, §3.4, for the shift. Deuflhard (2011), Newton Methods for Nonlinear Problems, §3.1,
for the test.
"""

import abc
import logging
from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Float

from fem_reference.assembly import SparsePattern
from fem_reference.linear_solver import SingularMatrixError, SymmetricSolver

_LOG = logging.getLogger(__name__)

# Residual forces [N] and moments [N mm]: chamber pressures give nodal forces of 1e-3 to 1e-2 N, round-off of
# the stiff parts about 1e-11 N.
FORCE_TOLERANCE = 1e-9
# A step of this size [mm] under forces below that [N] is round-off of a large mesh.
_ROUND_OFF_STEP, _ROUND_OFF_FORCE = 1e-12, 1e-7
MOMENT_TOLERANCE = 1e-8
# Where walls touch, the barrier's gradient jumps a little as contact pairs change kind, and Newton's method
# may end in a cycle about such a jump. It is accepted below this force [N] once the whole step is within the
# problem's noise, which bounds what is lost.
CONTACT_FORCE_TOLERANCE = 1e-3
MAX_ITERATIONS = 30

_MAX_BACKTRACKS = 12
# Iterations before steps that contract by less than this are halved, or taken for the contact's noise.
_SETTLING = 5
_CONTRACTION = 0.7
_PATIENCE = 5
# Line search: a step may be this much larger than the one before; how often one is halved; and the share of
# the problem's reach below which growth is let pass.
_GROWTH = 2.0
_MAX_HALVINGS = 2
_FLOOR = 0.1
# Shift of the stiffness [N/mm]: applied above this residual [N], from the first value upwards by factors.
_SHIFT_ABOVE = 1e-4
_FIRST_SHIFT = 1e-4
_SHIFT_FACTOR = 3.0
_LAST_SHIFT = 10.0


class NewtonError(ArithmeticError):
    """Newton's method gave up; the message says why."""


@dataclass(frozen=True)
class Linearisation:
    """Residual and stiffness of a problem at a configuration.

    Parameters
    ----------
    residual : forces on the unknowns of the sparse system [N].
    data : of the stiffness, in the problem's pattern.
    walls_touch : whether chamber walls are in contact.
    """

    residual: Float[np.ndarray, " q"]
    data: Float[np.ndarray, " nonzeros"]
    walls_touch: bool


@dataclass(frozen=True)
class Equilibrium:
    """A converged configuration with the linearisation there.

    Parameters
    ----------
    residual : largest nodal force left [N].
    excess_negative : negative pivots of the stiffness beyond those of the constraints, with the walls'
        contact taken as convex; above zero the body is at a saddle of its energy. None where the linear
        solver does not tell.
    """

    configuration: Any
    linear: Any
    iterations: int
    residual: float
    excess_negative: int | None


class Problem(abc.ABC):
    """What Newton's method and the path follower ask of the equations.

    Configurations, targets, linearisations and steps are the problem's own types; a linearisation extends
    `Linearisation`, and a step has ``positions``, the nodes' part of it [mm].
    """

    #: Sparsity of the stiffness, and how many of its unknowns are multipliers with a negative pivot each.
    pattern: SparsePattern
    constraints: int
    #: Root-mean-square displacement that a step may have [mm].
    reach: float
    #: Displacement of any node that the contact's jumps may leave open [mm].
    noise: float

    @abc.abstractmethod
    def begin(self, start: Any, target: Any) -> Any:
        """The configuration to iterate from; raises a NewtonError where it is not admissible."""

    @abc.abstractmethod
    def linearise(self, at: Any, target: Any) -> Any:
        """Residual and stiffness."""

    @abc.abstractmethod
    def convex_walls(self, linear: Any) -> Float[np.ndarray, " nonzeros"]:
        """The stiffness' data with the walls' contact made convex, pair by pair."""

    @abc.abstractmethod
    def imbalance(self, linear: Any, target: Any) -> float:
        """Largest residual moment of unknowns outside the sparse system [N mm]."""

    @abc.abstractmethod
    def newton_step(self, solver: SymmetricSolver, linear: Any, target: Any) -> Any:
        """Step from the factors that ``solver`` holds."""

    @abc.abstractmethod
    def size(self, step: Any, linear: Any) -> float:
        """Root-mean-square displacement of the nodes in a step [mm]."""

    @abc.abstractmethod
    def is_small(self, step: Any) -> bool:
        """Whether the unknowns other than nodes move by no more than the contact's noise may move them."""

    @abc.abstractmethod
    def longest(self, step: Any) -> float:
        """Largest share of a step that its linearisation stands for, at most 1."""

    @abc.abstractmethod
    def advance(self, at: Any, step: Any, fraction: float, linear: Any) -> Any:
        """The configuration after a share of a step, stiff forces included."""

    @abc.abstractmethod
    def allowed(self, linear: Any, trial: Any) -> float:
        """Share of a trial step that nothing blocks; 1 where it is admissible in full."""

    @abc.abstractmethod
    def mean(self, states: list[Any], weights: list[float]) -> Any:
        """Weighted mean of configurations, weights adding up to one; negative ones extrapolate."""

    @abc.abstractmethod
    def may_start(self, at: Any, guess: Any) -> bool:
        """Whether ``guess``, extrapolated from the equilibrium ``at``, is one to iterate from."""


def solve_equilibrium(
    problem: Problem, solver: SymmetricSolver, target: Any, start: Any, inertia: int = 0
) -> Equilibrium:
    """Iterate from ``start`` to equilibrium under ``target``; the solver is left with the factors there.

    Parameters
    ----------
    problem, solver, target : what, by what, and under which loads.
    start : configuration to iterate from.
    inertia : negative eigenvalues of the branch of equilibria that is followed: 0 for minima of the energy. A
        matrix with more of them is damped.

    Raises
    ------
    NewtonError
        When it does not converge.
    """
    at = problem.begin(start, target)
    history: list[float] = []
    last: _Taken | None = None
    shift = 0.0
    for iteration in range(MAX_ITERATIONS):
        linear = problem.linearise(at, target)
        force = float(np.abs(linear.residual).max())
        moment = problem.imbalance(linear, target)
        if not np.isfinite(force + moment):
            raise NewtonError(f"the residual is not finite at iteration {iteration}")
        try:
            negative = solver.factorise(problem.pattern.matrix(linear.data), problem.pattern.revision)
            excess = None if negative is None else negative - problem.constraints
            if force <= FORCE_TOLERANCE and moment <= MOMENT_TOLERANCE:
                return _settled(problem, solver, at, linear, iteration, force, excess)
            damped = excess is not None and excess > inertia and force > _SHIFT_ABOVE
            if damped:
                shift = _factorise_damped(problem, solver, linear, shift, inertia)
            step = problem.newton_step(solver, linear, target)
            size = problem.size(step, linear)
            if not damped and last is not None and last.overshot(size, problem.reach):
                _LOG.debug("the step would grow to %.2e mm: the last one is halved", size)
                last = last.halved()
                at = _admissible_part(problem, last.origin, last.step, last.linear, last.fraction)
                continue
        except SingularMatrixError as error:
            raise NewtonError(f"iteration {iteration}: {error}") from error
        _LOG.debug(
            "iteration %d: force %.2e N, moment %.2e N mm, step %.2e mm, excess %s%s",
            *(iteration, force, moment, size, excess, ", damped" if damped else ""),
        )
        if size <= _ROUND_OFF_STEP and force <= _ROUND_OFF_FORCE and moment <= MOMENT_TOLERANCE:
            return _settled(problem, solver, at, linear, iteration, force, excess)
        raised = damped and shift > 0.0
        if iteration >= _PATIENCE and linear.walls_touch and not raised and _at_noise(problem, step, force):
            return _settled(problem, solver, at, linear, iteration, force, excess)
        history.append(force)
        stalled = iteration >= _SETTLING and last is not None and size > _CONTRACTION * last.size
        longest = min(problem.longest(step), problem.reach / max(size, problem.reach))
        fraction = min(longest, 0.5 if stalled else 1.0)
        last = None if damped else _Taken(at, step, linear, size, fraction)
        at = _admissible_part(problem, at, step, linear, fraction)
    raise NewtonError(
        f"no convergence in {MAX_ITERATIONS} iterations; the last residual forces are "
        + ", ".join(f"{r:.1e}" for r in history[-3:])
        + " N"
    )


@dataclass(frozen=True)
class _Taken:
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

    def halved(self) -> "_Taken":
        return _Taken(self.origin, self.step, self.linear, self.size, 0.5 * self.fraction, self.halvings + 1)


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
    if excess and linear.walls_touch:
        data = problem.convex_walls(linear)
        excess = solver.factorise(problem.pattern.matrix(data), problem.pattern.revision)
        excess = None if excess is None else excess - problem.constraints
        solver.factorise(problem.pattern.matrix(linear.data), problem.pattern.revision)
    return Equilibrium(at, linear, iterations, force, excess)


def _at_noise(problem: Problem, step: Any, force: float) -> bool:
    return (
        force <= CONTACT_FORCE_TOLERANCE
        and float(np.abs(step.positions).max()) <= problem.noise
        and problem.is_small(step)
    )


def _factorise_damped(
    problem: Problem, solver: SymmetricSolver, linear: Linearisation, last: float, inertia: int
) -> float:
    """Factorise a stiffness of the branch's inertia: walls made convex, then the diagonal raised.

    Returns the shift, to start from near ``last`` in the next iteration; zero where convex walls are enough.
    """
    base = problem.convex_walls(linear) if linear.walls_touch else linear.data
    diagonal = problem.pattern.diagonal[: problem.pattern.size - problem.constraints]
    shift = last / _SHIFT_FACTOR**2 if last > _FIRST_SHIFT else 0.0
    while shift <= _LAST_SHIFT:
        data = base.copy()
        data[diagonal] += shift
        negative = solver.factorise(problem.pattern.matrix(data), problem.pattern.revision)
        _LOG.debug("shift %.1e N/mm: %s negative pivots", shift, negative)
        if negative is not None and negative <= problem.constraints + inertia:
            return shift
        shift = max(_FIRST_SHIFT, _SHIFT_FACTOR * shift)
    raise NewtonError(f"the stiffness stays indefinite under a shift of {_LAST_SHIFT:g} N/mm")


def _admissible_part(problem: Problem, at: Any, step: Any, linear: Any, fraction: float) -> Any:
    """The longest admissible part of a step: no wall crossed, no node in the rod, no element inverted."""
    for _ in range(_MAX_BACKTRACKS):
        trial = problem.advance(at, step, fraction, linear)
        allowed = problem.allowed(linear, trial)
        if allowed >= 1.0:
            if fraction < 1.0:
                _LOG.debug("step cut to %.3g", fraction)
            return trial
        fraction *= allowed
    raise NewtonError(
        f"no admissible step: a wall, the rod or an element blocks it at {fraction:.1e} of its length"
    )
