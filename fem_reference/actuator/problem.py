"""The full actuator as a problem for Newton's method: its steps, and what blocks them.

The tip load's own stiffness, of rank three and not symmetric, enters by the Woodbury formula.
"""

from dataclasses import replace

import numpy as np
from jaxtyping import Float, Int
from scipy.spatial import cKDTree

from fem_reference.actuator.equations import ActuatorEquations
from fem_reference.actuator.load import ActuatorTarget
from fem_reference.actuator.model import ActuatorLinearisation, Deformation
from fem_reference.algebra import SymmetricSolver
from fem_reference.cell import SOLID
from fem_reference.central_rod import PRESSED, CoreCoordinates
from fem_reference.elements import ViscousSolid
from fem_reference.errors import NewtonError
from fem_reference.solver import Problem
from fem_reference.walls import ContactPath

_WALL_MARGIN = 0.6
# Displacement by which walls are held back at most [mm].
_MOST_HELD = 0.05
# Displacement above which a step follows the rod's turns instead of straight lines [mm], and the share of it
# that stands for its tangent.
_STRAIGHT = 0.02
_TANGENT = 1e-3


class ActuatorStep:
    """Displacement of every point [mm], zero where clamped."""

    def __init__(self, positions: Float[np.ndarray, "points 3"]) -> None:
        self.positions = positions


class ActuatorProblem(Problem):
    """Equilibria of the actuator.

    Parameters
    ----------
    equations : of the actuator.
    """

    constraints = 0
    reach = 1.5
    noise = 5e-3
    nearby = 0.05
    exact = False
    stride = 0.1

    def __init__(self, equations: ActuatorEquations) -> None:
        self.equations = equations
        self.pattern = equations.pattern
        self._frame = CoreCoordinates(equations.basis, equations.mesh.points[:, 2])
        self._cavity = equations.sliding
        self._pressed = self._frame.distance(equations.rest_positions, self._cavity) - PRESSED
        self._behind = _behind(equations.mesh.points, self._cavity, equations.inner_radius)

    def begin(self, start: Deformation, target: ActuatorTarget) -> Deformation:
        """The start, which must keep the cavity's wall outside the rod."""
        if not self.equations.contact.admissible(start.positions):
            raise NewtonError("the start has the cavity's wall inside the rod")
        return start

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

    def keeps(self, linear: ActuatorLinearisation, at: Deformation) -> bool:
        """See `Problem.keeps`."""
        return bool((self.equations.thread.slack(at.segment_tension) == linear.slack).all())

    def convexified_contact(self, linear: ActuatorLinearisation) -> Float[np.ndarray, " nonzeros"]:
        """See `Problem.convexified_contact`."""
        return self.equations.convexified_contact(linear)

    def core_curvature_stiffness(self, linear: ActuatorLinearisation) -> Float[np.ndarray, " nonzeros"]:
        """See `Problem.core_curvature_stiffness`."""
        return self.equations.core_curvature_stiffness(linear)

    def viscous(self, at: Deformation, rate: float) -> ViscousSolid:
        """See `ViscousSolid`."""
        return ViscousSolid(self.equations.solid, at.positions, rate)

    def stiffened(
        self, data: Float[np.ndarray, " nonzeros"], resistance: ViscousSolid, linear: ActuatorLinearisation
    ) -> Float[np.ndarray, " nonzeros"]:
        """A stiffness' data with the matrix of a viscous ``resistance`` added."""
        stiffer = data.copy()
        self.pattern.add_group(stiffer, SOLID, resistance.matrices)
        return stiffer

    def imbalance(self, linear: ActuatorLinearisation, target: ActuatorTarget) -> float:
        """None: every unknown is in the sparse system."""
        return 0.0

    def newton_step(
        self, solver: SymmetricSolver, linear: ActuatorLinearisation, target: ActuatorTarget
    ) -> ActuatorStep:
        """See `Problem.newton_step`."""
        return self.step(self.solve(solver, linear, -linear.residual[:, None])[:, 0], linear)

    def solve(
        self,
        solver: SymmetricSolver,
        linear: ActuatorLinearisation,
        right: Float[np.ndarray, "q columns"],
    ) -> Float[np.ndarray, "q columns"]:
        """Solve for every column, with the tip load's own stiffness."""
        if linear.load_columns is None:
            return solver.solve(right)
        count, rows = right.shape[1], linear.load_rows
        solution = solver.solve(np.column_stack([right, linear.load_columns]))
        bare, loaded = solution[:, :count], solution[:, count:]
        return bare + loaded @ np.linalg.solve(np.eye(3) - rows @ loaded, rows @ bare)

    def step(self, free: Float[np.ndarray, " q"], linear: ActuatorLinearisation) -> ActuatorStep:
        """A step from the displacements of what is free."""
        return ActuatorStep((self.equations.fold.T @ free).reshape(-1, 3))

    def size(self, step: ActuatorStep, linear: ActuatorLinearisation) -> float:
        """Root-mean-square displacement in a step [mm]."""
        return float(np.sqrt(np.mean(step.positions**2)))

    def is_small(self, step: ActuatorStep) -> bool:
        """Whether unknowns other than positions are small: there are none."""
        return True

    def longest(self, step: ActuatorStep) -> float:
        """The whole step: its length is limited by ``reach``."""
        return 1.0

    def advance(
        self, at: Deformation, step: ActuatorStep, fraction: float, linear: ActuatorLinearisation
    ) -> Deformation:
        """See `ActuatorEquations.advance`; a long step is taken in the frame of the rod."""
        linearly = self.equations.advance(at, step.positions, fraction, linear)
        if fraction * float(np.abs(step.positions).max()) < _STRAIGHT:
            return linearly
        nearby = at.positions + _TANGENT * step.positions
        ratio = fraction / _TANGENT
        bent = replace(linearly, positions=self._mean([at.positions, nearby], [1.0 - ratio, ratio]))
        return self.keep_core_apart(at, bent)

    def keep_core_apart(self, at: Deformation, trial: Deformation) -> Deformation:
        """The trial with the cavity's wall no nearer to the rod than it was, or than walls pressed on it are.

        A step knows nothing of walls that it brings to the rod: where these go 0.03 mm too far, the contact's
        force is that of 3 MPa, and its matrix, as they slide off the rod, has hundreds of negative pivots.
        """
        least = np.minimum(self._frame.distance(at.positions, self._cavity), self._pressed)
        moved = self._frame.keep_core_apart(trial.positions, self._cavity, least)
        nodes, nearest, share = self._behind
        positions = trial.positions.copy()
        positions[nodes] += share[:, None] * moved[nearest]
        return replace(trial, positions=self.equations.symmetrised(positions))

    def allowed(self, linear: ActuatorLinearisation, trial: Deformation) -> float:
        """Share of a trial step before walls meet; half, where the rod or an element blocks it."""
        return self._share(linear.positions, trial.positions, -0.9)

    def keep_walls_apart(self, at: Deformation, trial: Deformation) -> Deformation:
        """The trial with walls that it lets pass through each other held apart.

        Itself where some would be held back by much: elements behind them would be crushed, which costs more
        iterations than a shorter step.
        """
        nodes = slice(self.equations.nodes)
        start, end = at.positions, trial.positions
        held = self.equations.walls.keep_walls_apart(start[nodes], end[nodes], self._seen(start, end))
        if held is None or float(np.abs(held).max()) > _MOST_HELD:
            return trial
        moved = end.copy()
        moved[nodes] += held
        return replace(trial, positions=self.equations.symmetrised(moved))

    def mean(self, states: list[Deformation], weights: list[float]) -> Deformation:
        """Weighted mean, taken in the frame of the rod."""

        def mixed(name: str) -> np.ndarray:
            return sum(w * getattr(state, name) for w, state in zip(weights, states, strict=True))

        thread, tension, here = self.equations.thread, mixed("segment_tension"), states[0].segment_tension
        # What is left of the tension in slack segments does not tell where they become taut.
        tension = np.where(thread.slack(here) & (tension > 0.0), here, tension)
        return Deformation(
            positions=self._mean([state.positions for state in states], weights),
            element_pressure=mixed("element_pressure"),
            segment_tension=thread.loosened(tension),
            axis_tension=mixed("axis_tension"),
        )

    def _mean(
        self, positions: list[Float[np.ndarray, "points 3"]], weights: list[float]
    ) -> Float[np.ndarray, "points 3"]:
        mean = self._frame.mean(positions, weights)
        held = self.equations.clamped
        mean[held] = self.equations.rest_positions[held]
        return mean

    def may_start(self, at: Deformation, guess: Deformation) -> bool:
        """Whether an extrapolated deformation is one that Newton's method can start from."""
        return self.start_share(at, guess) >= 1.0

    def start_share(self, at: Deformation, guess: Deformation) -> float:
        """Share of the way to an extrapolated deformation that Newton's method may start from."""
        return self._share(at.positions, guess.positions, -0.5)

    def _seen(self, start: Float[np.ndarray, "points 3"], end: Float[np.ndarray, "points 3"]) -> ContactPath:
        """A step seen from the rod.

        Sections move by millimetres, the walls in them by hundredths: the search for pairs that may touch has
        a hundredth of them to look at.
        """
        return self._frame.straightened(start), self._frame.straightened(end)

    def _share(
        self,
        start: Float[np.ndarray, "points 3"],
        end: Float[np.ndarray, "points 3"],
        least_dilatation: float,
    ) -> float:
        """Share of a step before walls meet; half, where the rod or an element blocks it."""
        equations = self.equations
        nodes = slice(equations.nodes)
        limit = equations.walls.step_limit(start[nodes], end[nodes], self._seen(start, end))
        if limit < 1.0:
            return _WALL_MARGIN * limit
        good = (
            equations.contact.admissible(end)
            and equations.solid.dilatation(end)[:, 0].min() > least_dilatation
        )
        return 1.0 if good else 0.5


def _behind(
    rest: Float[np.ndarray, "nodes 3"], cavity: Int[np.ndarray, " some"], inner_radius: float
) -> tuple[Int[np.ndarray, " inner"], Int[np.ndarray, " inner"], Float[np.ndarray, " inner"]]:
    """Nodes of the inner wall, which of the cavity's is in front of each, and its share of that one's motion.

    The share is one at the cavity and none where chambers begin: a wall that is moved off the rod does not
    crush the elements next to it.
    """

    def seen(points: Float[np.ndarray, "n 3"]) -> Float[np.ndarray, "n 3"]:
        # Sections are farther apart than any two places around the rod.
        return np.column_stack([points[:, :2] / np.hypot(*points[:, :2].T)[:, None], 100.0 * points[:, 2]])

    radius = np.hypot(*rest[:, :2].T)
    highest = rest[cavity, 2].max(initial=-np.inf)
    inner = np.flatnonzero((radius < inner_radius) & (rest[:, 2] <= highest))
    if len(inner) == 0:
        return inner, inner, np.zeros(0)
    _, nearest = cKDTree(seen(rest[cavity])).query(seen(rest[inner]))
    own = radius[cavity][nearest]
    return inner, nearest, (inner_radius - radius[inner]) / (inner_radius - own)
