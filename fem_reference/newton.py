"""Newton's method for the period cell: mixed unknowns for its stiff parts, a shift where it is unstable.

Two parts are stiff beyond comparison with the silicone's shear: the thread's stretch and the elements'
volume. Both are quadratic in small rotations, so that a plain Newton step from a displacement-only form
overshoots by orders of magnitude. Their forces (segment tension, element pressure) are therefore unknowns of
their own while iterating; they are condensed locally, so the linear system keeps its size, and the solution
is that of the displacement form.

Far from equilibrium a matrix with the wrong inertia would lead to a saddle or round in circles; a multiple of
the identity is then added until the inertia is that of a minimum. Close to equilibrium the matrix is left as
it is.

References
----------
Magisano, Leonetti, Garcea (2017), Advantages of the mixed format in geometrically nonlinear analysis of beams
and shells using solid finite elements, Int. J. Numer. Meth. Eng. 109, §3. Nocedal and Wright (2006),
Numerical Optimization, §3.4, for the shift.
"""

import logging
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float

from fem_reference.cell_equations import GAUGES, CellEquations
from fem_reference.configuration import Configuration, Linearisation, Step
from fem_reference.linear_solver import SingularMatrixError, SymmetricSolver
from fem_reference.screw import screw_series

_LOG = logging.getLogger(__name__)

# Residual forces [N] and moments [N mm]: chamber pressures give nodal forces of 1e-3 to 1e-2 N, round-off of
# the stiff parts about 1e-11 N.
FORCE_TOLERANCE = 1e-9
MOMENT_TOLERANCE = 1e-8
# Where walls touch, the barrier's gradient jumps a little as contact pairs change kind, and Newton's method
# may end in a cycle about such a jump. It is accepted once the whole step is as small as this [mm] and moves
# u by no more than that [1/mm], which bounds what is lost: 1e-3 mm at a wall's node, 1e-4 1/m of curvature.
CONTACT_STEP = 1e-3
CONTACT_CURVATURE_STEP = 1e-7
CONTACT_FORCE_TOLERANCE = 1e-3
MAX_ITERATIONS = 30

_MAX_BACKTRACKS = 12
_WALL_MARGIN = 0.9
# Largest turn of the top face in one step [rad].
_MAX_TURN = 0.05
# Iterations before a residual that does not fall is answered with half steps, or taken for the contact's
# noise.
_SETTLING = 5
_PATIENCE = 5
# Shift of the stiffness [N/mm]: applied above this residual [N], from the first value upwards by factors.
_SHIFT_ABOVE = 1e-4
_FIRST_SHIFT = 1e-3
_SHIFT_FACTOR = 4.0
_MAX_SHIFTS = 8


class NewtonError(ArithmeticError):
    """Newton's method gave up; the message says why."""


@dataclass(frozen=True)
class Target:
    """What the cell is asked for.

    Parameters
    ----------
    pressure : of the chambers [MPa].
    moment : external moment [N mm], in free bending.
    curvature : imposed u [1/mm]; exactly one of the two is given.
    """

    pressure: Float[np.ndarray, "3"]
    moment: Float[np.ndarray, "3"] | None = None
    curvature: Float[np.ndarray, "3"] | None = None

    def between(self, other: "Target", fraction: float) -> "Target":
        """The target a fraction of the way from this one to ``other``, which is of the same mode."""

        def mix(a: np.ndarray | None, b: np.ndarray | None) -> np.ndarray | None:
            return None if a is None or b is None else a + fraction * (b - a)

        pressure = self.pressure + fraction * (other.pressure - self.pressure)
        return type(self)(pressure, mix(self.moment, other.moment), mix(self.curvature, other.curvature))


@dataclass(frozen=True)
class Equilibrium:
    """A converged configuration with the linearisation there.

    Parameters
    ----------
    residual : largest nodal force left [N].
    excess_negative : negative pivots of the stiffness at fixed u beyond those of the gauge; above zero the
        cell is at a
        saddle of its energy. None where the linear solver does not tell.
    """

    configuration: Configuration
    linear: Linearisation
    iterations: int
    residual: float
    excess_negative: int | None


def solve_equilibrium(
    equations: CellEquations, solver: SymmetricSolver, target: Target, start: Configuration
) -> Equilibrium:
    """Iterate from ``start`` to equilibrium under ``target``; the solver is left with the factors there.

    Raises
    ------
    NewtonError
        When it does not converge.
    """
    at = start if target.curvature is None else replace(start, curvature=target.curvature)
    if not equations.rod.admissible(equations.all_positions(at), screw_series(at.curvature, equations.reach)):
        raise NewtonError("the start has the cavity's wall inside the rod")
    history: list[float] = []
    for iteration in range(MAX_ITERATIONS):
        linear = equations.linearise(at, target.pressure)
        moment_residual = None
        if target.moment is not None:
            moment_residual = linear.curvature_residual - equations.period * target.moment
        force = float(np.abs(linear.residual).max())
        moment = 0.0 if moment_residual is None else float(np.abs(moment_residual).max()) / equations.period
        history.append(force)
        if not np.isfinite(force + moment):
            raise NewtonError(f"the residual is not finite at iteration {iteration}")
        try:
            negative = solver.factorise(equations.pattern.matrix(linear.data), equations.pattern.revision)
            excess = None if negative is None else negative - GAUGES
            _LOG.debug(
                "iteration %d: force %.2e N, moment %.2e N mm, excess %s", iteration, force, moment, excess
            )
            if force <= FORCE_TOLERANCE and moment <= MOMENT_TOLERANCE:
                return Equilibrium(at, linear, iteration, force, excess)
            shifted = bool(excess) and force > _SHIFT_ABOVE
            if shifted:
                _factorise_shifted(equations, solver, linear)
            step = _newton_step(solver, linear, moment_residual)
        except SingularMatrixError as error:
            raise NewtonError(f"iteration {iteration}: {error}") from error
        if iteration >= _PATIENCE and linear.walls_touch and not shifted and _at_contact_noise(step, force):
            return Equilibrium(at, linear, iteration, force, excess)
        stalled = len(history) > _SETTLING and history[-1] > 0.5 * history[-3]
        at = _admissible_part(equations, at, step, linear, 0.5 if stalled else 1.0)
    raise NewtonError(
        f"no convergence in {MAX_ITERATIONS} iterations; the last residual forces are "
        + ", ".join(f"{r:.1e}" for r in history[-3:])
        + " N"
    )


def _at_contact_noise(step: Step, force: float) -> bool:
    return (
        force <= CONTACT_FORCE_TOLERANCE
        and float(np.abs(step.positions).max()) <= CONTACT_STEP
        and float(np.abs(step.curvature).max()) <= CONTACT_CURVATURE_STEP
    )


def _factorise_shifted(equations: CellEquations, solver: SymmetricSolver, linear: Linearisation) -> None:
    """Factorise the stiffness plus the first tried multiple of the identity that makes it a minimum's."""
    shift = _FIRST_SHIFT
    diagonal = equations.pattern.diagonal[:-GAUGES]
    for _ in range(_MAX_SHIFTS):
        data = linear.data.copy()
        data[diagonal] += shift
        if solver.factorise(equations.pattern.matrix(data), equations.pattern.revision) == GAUGES:
            return
        shift *= _SHIFT_FACTOR
    raise NewtonError(f"the stiffness stays indefinite under a shift of {shift / _SHIFT_FACTOR:g} N/mm")


def _newton_step(
    solver: SymmetricSolver, linear: Linearisation, moment_residual: Float[np.ndarray, "3"] | None
) -> Step:
    """Step of nodes, multipliers and, in free bending, of u by its Schur complement."""
    if moment_residual is None:
        dq, du = solver.solve(-linear.residual[:, None])[:, 0], np.zeros(3)
    else:
        solution = solver.solve(np.column_stack([-linear.residual, linear.node_curvature]))
        schur = linear.curvature_curvature - linear.node_curvature.T @ solution[:, 1:]
        du = np.linalg.solve(schur, -moment_residual - linear.node_curvature.T @ solution[:, 0])
        dq = solution[:, 0] - solution[:, 1:] @ du
    return Step(dq[:-GAUGES].reshape(-1, 3), du, dq[-GAUGES:])


def _admissible_part(
    equations: CellEquations, at: Configuration, step: Step, linear: Linearisation, longest: float
) -> Configuration:
    """The longest admissible part of a step: no wall crossed, no node in the rod, no element inverted."""
    turn = float(np.linalg.norm(step.curvature)) * equations.period
    fraction = min(longest, _MAX_TURN / turn) if turn > 0.0 else longest
    for _ in range(_MAX_BACKTRACKS):
        trial = equations.advance(at, step, fraction, linear)
        x = equations.all_positions(trial)
        limit = equations.walls.step_limit(linear.frame.positions, x)
        if limit < 1.0:
            fraction *= _WALL_MARGIN * limit
            continue
        series = screw_series(trial.curvature, equations.reach)
        if equations.rod.admissible(x, series) and equations.solid.dilatation(x).min() > 0.1:
            if fraction < 1.0:
                _LOG.debug("step cut to %.3g", fraction)
            return trial
        fraction *= 0.5
    raise NewtonError(
        f"no admissible step: a wall, the rod or an element blocks it at {fraction:.1e} of its length"
    )
