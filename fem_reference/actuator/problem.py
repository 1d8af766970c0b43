"""The full actuator as a problem for Newton's method, under given pressures.

The tip load's own stiffness, of rank three and not symmetric, enters by the Woodbury formula.
"""

from dataclasses import dataclass, replace
from typing import TypeVar

import numpy as np
from jaxtyping import Float

from fem_reference.actuator.contact import ActuatorContact, Body, BodyLinear
from fem_reference.actuator.equations import ActuatorEquations
from fem_reference.actuator.load import ActuatorTarget
from fem_reference.actuator.model import ActuatorLinearisation, Deformation, with_positions
from fem_reference.actuator.motion import BodyMotion
from fem_reference.algebra import SymmetricSolver
from fem_reference.elements import ViscousSolid
from fem_reference.errors import NewtonError
from fem_reference.solver import Problem, Tolerances

# Displacement above which a step follows the core's turns instead of straight lines [mm], and the share of
# the step that gives its tangent.
_STRAIGHT = 0.02
_TANGENT = 1e-3
# Mean dilatation of an element below which a step, or a start of Newton's method, is not admissible.
_LEAST_DILATATION, _LEAST_AT_START = -0.9, -0.5


@dataclass(frozen=True)
class ActuatorStep:
    """Displacement of every point [mm], zero where clamped."""

    positions: Float[np.ndarray, "points 3"]


Target = TypeVar("Target")
BodyStep = TypeVar("BodyStep", bound=ActuatorStep)


class BodyProblem(Problem[Body, Target, BodyLinear, BodyStep, ViscousSolid]):
    """What the actuator's problems share, whatever they take for given.

    Parameters
    ----------
    equations, motion : of the actuator.
    """

    tolerances = Tolerances(
        max_step=1.5, modified_newton_step=0.05, contact_noise=5e-3, exact_stiffness=False, desired_step=0.1
    )

    def __init__(self, equations: ActuatorEquations, motion: BodyMotion) -> None:
        self.equations, self.motion = equations, motion
        self.kilopascals = 1e-3 * equations.units.megapascal
        self.pattern = equations.pattern
        self.contact: ActuatorContact[Body, BodyLinear] = ActuatorContact(equations, motion)

    def begin(self, start: Body, target: Target) -> Body:
        """The start; a NewtonError if the cavity's wall is inside the core."""
        if not self.equations.contact.admissible(start.deformation.positions):
            raise NewtonError("the start has the cavity's wall inside the rod")
        return start

    def keeps(self, linear: BodyLinear, at: Body) -> bool:
        """See `Equations.keeps`."""
        return bool((self.equations.thread.slack(at.deformation.segment_tension) == linear.slack).all())

    def viscous(self, at: Body, rate: float) -> ViscousSolid:
        """See `ViscousSolid`."""
        return ViscousSolid(self.equations.solid, at.deformation.positions, rate)

    def stiffened(
        self, data: Float[np.ndarray, " nonzeros"], resistance: ViscousSolid, linear: BodyLinear
    ) -> Float[np.ndarray, " nonzeros"]:
        """See `Equations.stiffened`."""
        stiffer = data.copy()
        self.pattern.add_group(stiffer, "solid", resistance.matrices)
        return stiffer

    def keep_core_apart(self, at: Body, trial: Body) -> Body:
        """See `BodyMotion.keep_core_apart`."""
        start, end = at.deformation.positions, trial.deformation.positions
        return with_positions(trial, self.motion.keep_core_apart(start, end))

    def allowed(self, linear: BodyLinear, trial: Body) -> float:
        """See `BodyMotion.allowed`."""
        return self.motion.allowed(linear.positions, trial.deformation.positions, _LEAST_DILATATION)

    def distance(self, at: Body, other: Body) -> float:
        """See `Equations.distance`."""
        first, second = (state.deformation.positions for state in (at, other))
        before, after = self.motion.candidate_positions(first, second)
        return float(np.abs(after - before).max())

    def may_start(self, at: Body, guess: Body) -> bool:
        """See `Equations.may_start`."""
        return self.start_share(at, guess) >= 1.0

    def start_share(self, at: Body, guess: Body) -> float:
        """Share of the way to an extrapolated state from which Newton's method may start."""
        start, end = at.deformation.positions, guess.deformation.positions
        return self.motion.allowed(start, end, _LEAST_AT_START)


class ActuatorProblem(BodyProblem[Deformation, ActuatorTarget, ActuatorLinearisation, ActuatorStep]):
    """Equilibria of the actuator under given pressures.

    Parameters
    ----------
    equations : of the actuator.
    """

    def __init__(self, equations: ActuatorEquations) -> None:
        super().__init__(equations, BodyMotion(equations))

    def linearise(
        self,
        at: Deformation,
        target: ActuatorTarget,
        viscous: ViscousSolid | None = None,
        before: ActuatorLinearisation | None = None,
    ) -> ActuatorLinearisation:
        """See `ActuatorEquations.linearise`."""
        return self.equations.linearise(at, target, viscous=viscous, before=before)

    def update_forces(
        self,
        linear: ActuatorLinearisation,
        at: Deformation,
        target: ActuatorTarget,
        viscous: ViscousSolid | None = None,
    ) -> ActuatorLinearisation:
        """See `ActuatorEquations.update_forces`."""
        return self.equations.update_forces(linear, at, target, viscous)

    def newton_step(
        self, solver: SymmetricSolver, linear: ActuatorLinearisation, target: ActuatorTarget
    ) -> ActuatorStep:
        """See `Equations.newton_step`."""
        return ActuatorStep(self.displacement(self.solve(solver, linear, -linear.residual[:, None])[:, 0]))

    def solve(
        self, solver: SymmetricSolver, linear: ActuatorLinearisation, right: Float[np.ndarray, "q columns"]
    ) -> Float[np.ndarray, "q columns"]:
        """Solve for every column, with the tip load's own stiffness."""
        if linear.load_columns is None or linear.load_rows is None:
            return solver.solve(right)
        count, rows = right.shape[1], linear.load_rows
        solution = solver.solve(np.column_stack([right, linear.load_columns]))
        bare, loaded = solution[:, :count], solution[:, count:]
        corrected: np.ndarray = bare + loaded @ np.linalg.solve(np.eye(3) - rows @ loaded, rows @ bare)
        return corrected

    def displacement(self, unknowns: Float[np.ndarray, " q"]) -> Float[np.ndarray, "points 3"]:
        """Displacement of every point when the unknowns change [mm]."""
        return np.asarray(self.equations.fold.T @ unknowns).reshape(-1, 3)

    def advance(
        self, at: Deformation, step: ActuatorStep, fraction: float, linear: ActuatorLinearisation
    ) -> Deformation:
        """See `ActuatorEquations.advance`; a long step is taken in the core's coordinates."""
        linearly = self.equations.advance(at, step.positions, fraction, linear)
        if fraction * float(np.abs(step.positions).max()) < _STRAIGHT:
            return linearly
        nearby = at.positions + _TANGENT * step.positions
        ratio = fraction / _TANGENT
        bent = self.motion.mean([at.positions, nearby], [1.0 - ratio, ratio])
        return self.keep_core_apart(at, replace(linearly, positions=bent))

    def mean(self, states: list[Deformation], weights: list[float]) -> Deformation:
        """Weighted mean, taken in the core's coordinates."""

        def mixed(name: str) -> np.ndarray:
            return sum(w * getattr(state, name) for w, state in zip(weights, states, strict=True))

        thread, tension, here = self.equations.thread, mixed("segment_tension"), states[0].segment_tension
        # The small tension of slack segments does not predict where they become taut.
        tension = np.where(thread.slack(here) & (tension > 0.0), here, tension)
        return Deformation(
            positions=self.motion.mean([state.positions for state in states], weights),
            element_pressure=mixed("element_pressure"),
            segment_tension=thread.loosened(tension),
            axis_tension=mixed("axis_tension"),
        )
