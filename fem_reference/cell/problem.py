"""The period cell as a problem for Newton's method: its loads, its steps, and what blocks them."""

from dataclasses import dataclass, fields, replace

import numpy as np
from jaxtyping import Float

from fem_reference.algebra import SymmetricSolver, negative_direction
from fem_reference.cell.contact import CellContact
from fem_reference.cell.equations import CellEquations
from fem_reference.cell.helical_periodicity import HelicalFrame
from fem_reference.cell.state import CellLinearisation, Configuration, Step
from fem_reference.cell.unknowns import GAUGES
from fem_reference.elements import ViscousSolid
from fem_reference.errors import NewtonError
from fem_reference.solver import Problem, Tolerances

# Largest turn of the top face in one step [rad].
_MAX_TURN = 0.05
_WALL_MARGIN = 0.9
# Share of the smallest element's size by which nodes may move before elements' volumes are checked.
_SAFE = 0.05
# Change of the strain that counts as contact noise: of u [1/mm], 0.007° over 60 mm; of the stretch, the same
# at the wall's radius.
_CONTACT_STRAIN_STEP = np.array([2e-6, 2e-6, 2e-6, 1e-5])


@dataclass(frozen=True)
class CellTarget:
    """Loads to solve for.

    Parameters
    ----------
    pressure : of the chambers [MPa].
    moment : external moment [N mm], in free bending.
    curvature : imposed u [1/mm], instead of a moment.
    """

    pressure: Float[np.ndarray, "3"]
    moment: Float[np.ndarray, "3"] | None = None
    curvature: Float[np.ndarray, "3"] | None = None

    def between(self, other: "CellTarget", fraction: float) -> "CellTarget":
        """The target a fraction of the way from this one to ``other``, of the same kind."""

        def mix(a: np.ndarray | None, b: np.ndarray | None) -> np.ndarray | None:
            return None if a is None or b is None else a + fraction * (b - a)

        pressure = self.pressure + fraction * (other.pressure - self.pressure)
        return CellTarget(pressure, mix(self.moment, other.moment), mix(self.curvature, other.curvature))

    def to(self, other: "CellTarget") -> Float[np.ndarray, " loads"]:
        """Change of load in units that strain the cell about equally: 1 kPa, 0.05 N mm and 1 1/m."""
        parts = [(other.pressure - self.pressure) / 1e-3]
        if self.moment is not None and other.moment is not None:
            parts.append((other.moment - self.moment) / 0.05)
        if self.curvature is not None and other.curvature is not None:
            parts.append((other.curvature - self.curvature) / 1e-3)
        return np.concatenate(parts)


@dataclass(frozen=True)
class _StrainColumns:
    """K⁻¹ times the coupling of nodes and strain, kept for modified Newton steps with the same factors."""

    solver: SymmetricSolver
    factors: int
    node_strain: Float[np.ndarray, "q 4"]
    unknown: slice
    columns: Float[np.ndarray, "q unknowns"]

    def serves(self, solver: SymmetricSolver, linear: CellLinearisation, unknown: slice) -> bool:
        """Whether the columns belong to these factors, this coupling and these components."""
        same = solver is self.solver and solver.factors == self.factors
        return same and linear.node_strain is self.node_strain and unknown == self.unknown


class CellProblem(Problem[Configuration, CellTarget, CellLinearisation, Step, ViscousSolid]):
    """Equilibria of one period.

    Parameters
    ----------
    equations : of the cell.
    """

    constraints = GAUGES
    tolerances = Tolerances(
        max_step=0.3, modified_newton_step=0.01, contact_noise=5e-3, exact_stiffness=True, desired_step=np.inf
    )

    def __init__(self, equations: CellEquations) -> None:
        self.equations = equations
        self.kilopascals = 1e-3 * equations.units.megapascal
        self.pattern = equations.pattern
        self.contact = CellContact(equations)
        self._kept: _StrainColumns | None = None
        # A move of nodes that inverts no element.
        self._safe = _SAFE * float(np.cbrt(equations.solid.volume.min()))

    def begin(self, start: Configuration, target: CellTarget) -> Configuration:
        """The start with the imposed curvature, if there is one."""
        equations = self.equations
        at = start
        if target.curvature is not None:
            at = replace(start, strain=np.append(target.curvature, start.strain[3]))
        if not equations.core_contact.admissible(equations.all_positions(at), equations.series(at)):
            raise NewtonError("the start has the cavity's wall inside the rod")
        return at

    def linearise(
        self,
        at: Configuration,
        target: CellTarget,
        viscous: ViscousSolid | None = None,
        before: CellLinearisation | None = None,
    ) -> CellLinearisation:
        """See `CellEquations.linearise`."""
        return self.equations.linearise(at, target.pressure, viscous=viscous, before=before)

    def update_forces(
        self,
        linear: CellLinearisation,
        at: Configuration,
        target: CellTarget,
        viscous: ViscousSolid | None = None,
    ) -> CellLinearisation:
        """See `CellEquations.update_forces`."""
        return self.equations.update_forces(linear, at, target.pressure, viscous)

    def keeps(self, linear: CellLinearisation, at: Configuration) -> bool:
        """See `Equations.keeps`."""
        return bool((self.equations.thread.slack(at.segment_tension) == linear.slack).all())

    def viscous(self, at: Configuration, rate: float) -> ViscousSolid:
        """See `ViscousSolid`."""
        return ViscousSolid(self.equations.solid, self.equations.all_positions(at), rate)

    def stiffened(
        self, data: Float[np.ndarray, " nonzeros"], resistance: ViscousSolid, linear: CellLinearisation
    ) -> Float[np.ndarray, " nonzeros"]:
        """A stiffness' data plus the matrix of a viscous ``resistance``, at fixed strain."""
        stiffer = data.copy()
        nodes = self.equations.solid.connectivity
        blocks = linear.frame.rotate_blocks(nodes, resistance.matrices.copy())
        self.pattern.add_group(stiffer, "solid", blocks)
        return stiffer

    def imbalance(self, linear: CellLinearisation, target: CellTarget) -> float:
        """Residual moment [N mm] in free bending, and residual pull of the core [N] where the ends give."""
        lacking = self._strain_residual(linear, target)[self._unknown(target)] / self.equations.period
        return float(np.abs(lacking).max(initial=0.0))

    def _unknown(self, target: CellTarget) -> slice:
        """Unknown strain components: the curvature in free bending, the stretch where the ends give."""
        return slice(
            0 if target.moment is not None else 3, 3 if self.equations.axial_stiffness is None else 4
        )

    def _strain_residual(self, linear: CellLinearisation, target: CellTarget) -> Float[np.ndarray, "4"]:
        """Residual conjugate to the strain, less the external moment."""
        moment = np.zeros(3) if target.moment is None else target.moment
        return linear.strain_residual - self.equations.period * np.append(moment, 0.0)

    def newton_step(self, solver: SymmetricSolver, linear: CellLinearisation, target: CellTarget) -> Step:
        """Newton step of nodes and multipliers, and by the Schur complement of unknown strain components."""
        unknown = self._unknown(target)
        coupling, strain = linear.node_strain[:, unknown], np.zeros(4)
        if self._kept is not None and self._kept.serves(solver, linear, unknown):
            dq, softness = solver.solve(-linear.residual[:, None])[:, 0], self._kept.columns
        else:
            solution = solver.solve(np.column_stack([-linear.residual, coupling]))
            dq, softness = solution[:, 0], solution[:, 1:]
            self._kept = _StrainColumns(solver, solver.factors, linear.node_strain, unknown, softness)
        if coupling.size:
            schur = linear.strain_strain[unknown, unknown] - coupling.T @ softness
            lacking = -self._strain_residual(linear, target)[unknown] - coupling.T @ dq
            strain[unknown] = np.linalg.solve(schur, lacking)
            dq = dq - softness @ strain[unknown]
        return Step(self.equations.nodal.displacement(dq[:-GAUGES]), strain, dq[-GAUGES:])

    def size(self, step: Step, linear: CellLinearisation) -> float:
        """Root-mean-square displacement of the nodes in a step [mm], the turn of the top face included."""
        return float(np.sqrt(np.mean(linear.frame.motion(step.positions, step.strain) ** 2)))

    def is_small(self, step: Step) -> bool:
        """Whether the strain moves no more than contact noise may move it."""
        return bool((np.abs(step.strain) <= _CONTACT_STRAIN_STEP).all())

    def longest(self, step: Step) -> float:
        """Share of a step whose turn of the top face is small enough for the linearisation."""
        turn = float(np.linalg.norm(step.strain[:3])) * self.equations.period
        return min(1.0, _MAX_TURN / turn) if turn > 0.0 else 1.0

    def advance(
        self, at: Configuration, step: Step, fraction: float, linear: CellLinearisation
    ) -> Configuration:
        """See `CellEquations.advance`."""
        return self.equations.advance(at, step, fraction, linear)

    def allowed(self, linear: CellLinearisation, trial: Configuration) -> float:
        """Share of a trial step before walls meet; half if the core, an element or the bend blocks it."""
        equations = self.equations
        try:
            series = equations.series(trial)
        except ValueError:
            return 0.5
        x = HelicalFrame(equations.helical, trial.positions, series).positions
        limit = equations.walls.step_limit(linear.frame.positions, x)
        if limit < 1.0:
            return _WALL_MARGIN * limit
        if not equations.core_contact.admissible(x, series):
            return 0.5
        inverts = (
            np.abs(x - linear.frame.positions).max() > self._safe
            and equations.solid.dilatation(x)[:, 0].min() <= -0.9
        )
        return 0.5 if inverts else 1.0

    def mean(self, states: list[Configuration], weights: list[float]) -> Configuration:
        """Weighted mean of every unknown; a value that all states share is kept to the last bit."""
        first, *others = states

        def of(name: str) -> np.ndarray:
            value = getattr(first, name)
            pairs = zip(weights[1:], others, strict=True)
            return value + sum((w * (getattr(state, name) - value) for w, state in pairs), np.zeros(()))

        return Configuration(*(of(field.name) for field in fields(Configuration)))

    def pushed(
        self, solver: SymmetricSolver, at: Configuration, linear: CellLinearisation
    ) -> Configuration | None:
        """See `Equations.pushed`; at fixed strain, and no farther than contact's noise."""
        way = negative_direction(solver, len(linear.residual), self.constraints)
        if way is None:
            return None
        way = self.equations.nodal.displacement(way)
        way *= self.tolerances.contact_noise / np.abs(way).max()
        guess = replace(at, positions=at.positions + way)
        return guess if self.may_start(at, guess) else None

    def distance(self, at: Configuration, other: Configuration) -> float:
        """See `Equations.distance`."""
        return float(np.abs(self.equations.all_positions(other) - self.equations.all_positions(at)).max())

    def may_start(self, at: Configuration, guess: Configuration) -> bool:
        """See `Equations.may_start`."""
        equations = self.equations
        try:
            series = equations.series(guess)
        except ValueError:
            return False
        x = equations.all_positions(guess)
        return (
            equations.core_contact.admissible(x, series)
            and equations.solid.dilatation(x)[:, 0].min() > -0.5
            and equations.walls.step_limit(equations.all_positions(at), x) >= 1.0
        )
