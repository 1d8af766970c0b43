"""The period cell: one winding period of the actuator under pressure, bent freely or to a given curvature.

Units are SI here; the body's own (`Units`) are used behind this file only.
"""

import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field

import numpy as np
from jaxtyping import Float

from fem_reference.algebra import SymmetricSolver, default_solver
from fem_reference.cell.condensation import condense
from fem_reference.cell.equations import CellEquations
from fem_reference.cell.load import Load, load_of
from fem_reference.cell.problem import CellProblem, CellTarget
from fem_reference.cell.state import CellLinearisation, Configuration
from fem_reference.design import Design
from fem_reference.errors import NewtonError
from fem_reference.geometry import (
    ActuatorGeometry,
    Core,
    DoubleHelix,
    Thread,
    Winding,
    refuse_curvature_beyond,
    refuse_implausible,
    refuse_moment_beyond,
    refuse_pressure_beyond,
)
from fem_reference.materials import Material, Ogden
from fem_reference.mesh import MeshLevel, converged_level, mesh_level
from fem_reference.solver import Equilibrium, PathError, PathFollower, SolverOptions, solve_equilibrium

# First step of a path from rest, in units of `CellTarget.to`: mostly it converges, in fewer iterations than
# several shorter steps. A path from another start begins with a short step.
_FIRST_STEP, _STEP_FROM_A_START = 10.0, 1.0
_UNLOADED = CellTarget(np.zeros(3), moment=np.zeros(3))

CellEquilibrium = Equilibrium[Configuration, CellLinearisation]


@dataclass(frozen=True)
class CellState:
    """Equilibrium of the cell, with the section potential Π's derivatives. SI units.

    Parameters
    ----------
    load : pressures, and moment or curvature.
    pressure : of the chambers [Pa].
    curvature : u, body frame, per length at rest [1/m]; moment : ∂Π/∂u, body frame [N m].
    stretch : of the silicone along the core.
    energy : Π(u, p) − Π(0, 0) [J/m].
    volume : of each chamber per length, −∂Π/∂p [m²].
    hessian : ∂²Π in (u, p), 6 by 6, symmetric; of a symmetric cell, for changes in its plane, and zero for
        others.
    iterations : Newton iterations spent since the state before.
    residual : largest nodal force left [N].
    stable : whether the cell is at a minimum of its energy under this load; None if not known, as where
        pairs of walls in contact are about to change kind, and only their stiffness is negative.
    negative_directions : number of independent directions in which the energy falls to second order: of nodes
        and stretch, and in free bending of the curvature; None if the linear solver does not count them.
    jumped : whether walls lost their balance since the state before, so that this state is on another branch.
    converged : always true: a failure raises `CellError`.
    configuration : unknowns, to start from or to draw.
    """

    load: Load
    pressure: Float[np.ndarray, "3"]
    curvature: Float[np.ndarray, "3"]
    moment: Float[np.ndarray, "3"]
    stretch: float
    energy: float
    volume: Float[np.ndarray, "3"]
    hessian: Float[np.ndarray, "6 6"]
    iterations: int
    residual: float
    stable: bool | None
    negative_directions: int | None
    jumped: bool
    configuration: Configuration = field(repr=False)
    converged: bool = True

    def bending(self, length: float) -> tuple[float, float]:
        """Bending angle of a uniformly bent body of this length [m], and bending plane from −π to π [rad].

        The plane of bending by chamber 1 alone, which turns a section about −y, is 0.
        """
        u1, u2, _ = self.curvature
        return length * math.hypot(u1, u2), math.atan2(u1, -u2)


class CellError(ArithmeticError):
    """The solver did not reach the load.

    Parameters
    ----------
    message : why.
    last_good : last converged state on the way, or None.
    unstable : whether walls lose their balance, on a path that was to end there.
    """

    def __init__(self, message: str, last_good: CellState | None, unstable: bool = False) -> None:
        super().__init__(message)
        self.last_good = last_good
        self.unstable = unstable

    @property
    def reached(self) -> Load | None:
        """Load of the last converged state."""
        return None if self.last_good is None else self.last_good.load


class PeriodCell:
    """One period of a wound actuator, helically periodic (the helical Cauchy–Born rule).

    Parameters
    ----------
    geometry, material, winding, thread, core : the actuator; by default the paper's. `PeriodCell.of` takes
        them from a design.
    level : name of a mesh level, or element counts of your own; by default the winding's own
        (`converged_level`), on which free bending is near its limit. ``coarse`` takes a fifth of the time.
    end_compliance : elongation of the silicone along the core per newton of the core's pull on the closed
        ends [m/N]. By default the ends are rigid.
    solver : linear solver; by default MKL PARDISO where it is installed.
    options : of the nonlinear solvers.
    symmetric : whether the cell keeps its plane of symmetry, y = 0, through the middle of chamber 1. That
        halves the unknowns, and a path goes on where the section would lean to one side, as an actuator's
        does that is held upright. Loads must be in the plane, and so are the derivatives of its states.

    Raises
    ------
    ValueError
        For an unknown mesh level, a negative compliance, or a plane of symmetry that geometry or winding do
        not have.
    """

    def __init__(
        self,
        geometry: ActuatorGeometry | None = None,
        winding: Winding | None = None,
        level: str | MeshLevel | None = None,
        material: Material | None = None,
        thread: Thread | None = None,
        end_compliance: float = 0.0,
        solver: SymmetricSolver | None = None,
        options: SolverOptions | None = None,
        core: Core | None = None,
        symmetric: bool = False,
    ) -> None:
        if not (np.isfinite(end_compliance) and end_compliance >= 0.0):
            raise ValueError(
                f"end_compliance: got {end_compliance!r}, expected a finite number [m/N], not negative"
            )
        refuse_implausible("end_compliance", end_compliance)
        self.geometry = geometry or ActuatorGeometry()
        self.winding = winding or DoubleHelix()
        self.level = mesh_level(converged_level(self.winding) if level is None else level)
        self.material = material or Ogden()
        self.thread = thread or Thread()
        self.core = core or Core()
        self.end_compliance = end_compliance
        self.equations = CellEquations(
            self.geometry,
            self.material,
            self.winding,
            self.thread,
            self.level,
            self.geometry.body_length / end_compliance if end_compliance > 0.0 else None,
            self.core,
            symmetric,
        )
        self.symmetric = symmetric
        self._problem = CellProblem(self.equations)
        self._solver = solver or default_solver(definite=True, single=True)
        self.options = options or SolverOptions()
        self._rest: CellEquilibrium | None = None
        self._rest_energy = 0.0

    @classmethod
    def of(
        cls,
        design: Design,
        level: str | MeshLevel | None = None,
        end_compliance: float | None = None,
        solver: SymmetricSolver | None = None,
        options: SolverOptions | None = None,
        symmetric: bool = False,
    ) -> "PeriodCell":
        """Return the cell of a design.

        Parameters
        ----------
        design : actuator.
        level, solver, options, symmetric : see `PeriodCell`.
        end_compliance : see `PeriodCell`; by default that of the design, or rigid ends where it has none.
        """
        own = design.end_compliance or 0.0
        return cls(
            **design.body,
            level=level,
            end_compliance=own if end_compliance is None else end_compliance,
            solver=solver,
            options=options,
            symmetric=symmetric,
        )

    @property
    def elements(self) -> int:
        """Number of hexahedra."""
        return len(self.equations.solid)

    @property
    def unknowns(self) -> int:
        """Number of unknowns of the linear system."""
        return self.equations.size

    def refuse(self, load: Load) -> None:
        """Raise a ValueError for a load so large that no such body holds it, or it seems in another unit.

        Likewise for a load that leaves the plane of symmetry, if the cell keeps it.
        """
        if self.symmetric and not load.in_plane:
            raise ValueError(
                f"load: got {load} for a symmetric cell, expected equal pressures in chambers 2 and 3, and "
                "moment or curvature about y alone"
            )
        diameter = self.geometry.body_diameter
        refuse_pressure_beyond(load.pressure, self.material.shear_modulus)
        if load.moment is not None:
            refuse_moment_beyond("moment", load.moment, self.material.shear_modulus, diameter)
        if load.curvature is not None:
            refuse_curvature_beyond("curvature", load.curvature, diameter)

    def solve(self, load: Load, start: CellState | None = None) -> CellState:
        """Equilibrium under ``load``, reached by continuation from rest or from ``start``.

        Raises
        ------
        ValueError
            See `refuse`.
        CellError
            If the load is not reached; it carries the last good state.
        """
        return next(iter(follow(self, [load], start)))

    def _at_rest(self) -> CellEquilibrium:
        """Equilibrium without load, solved once."""
        if self._rest is None:
            rest = self.equations.rest()
            self._rest = solve_equilibrium(self._problem, self._solver, _UNLOADED, rest, options=self.options)
            self._rest_energy = self.equations.energy(self._rest.configuration)
        return self._rest

    def _in_doubt(self, found: CellEquilibrium) -> bool:
        """Whether the negative pivots of the nodes are not known, or may be those of contact's noise."""
        negative = found.negative_eigenvalues_true_contact
        if negative is None:
            return True
        in_noise = found.residual > self.options.convergence.round_off_force
        return negative > 0 and found.excess_negative == 0 and in_noise

    def _state(
        self, load: Load, found: CellEquilibrium, target: CellTarget, iterations: int, jumped: bool
    ) -> CellState:
        equations, units = self.equations, self.equations.units
        period = equations.period
        section = condense(equations, self._solver, found)
        volume = found.own_linear.volume / period
        energy = (equations.energy(found.configuration) - self._rest_energy) / period - float(
            target.pressure @ volume
        )
        # Π per length is in N mm/mm = N; u in 1/mm, p in MPa, so that m is in N mm and V in mm².
        scale = np.array([1.0 / units.metre] * 3 + [1.0 / units.megapascal] * 3)
        held = target.curvature is not None
        outer = section.negative_at_curvature if held else section.negative_in_bending
        inner = found.negative_eigenvalues_true_contact
        negative = None if inner is None else inner + outer
        return CellState(
            load=load,
            pressure=np.asarray(target.pressure) * units.megapascal,
            curvature=found.configuration.curvature * units.metre,
            moment=section.moment * units.newton / units.metre,
            stretch=float(found.configuration.strain[3]),
            energy=energy * units.newton,
            volume=volume / units.metre**2,
            hessian=section.hessian * np.outer(scale, scale) * units.newton,
            iterations=iterations,
            residual=found.residual * units.newton,
            stable=None if self._in_doubt(found) else negative == 0,
            negative_directions=negative,
            jumped=jumped,
            configuration=found.configuration,
        )


def follow(
    cell: PeriodCell, loads: Iterable[Load], start: CellState | None = None, jumps: bool = True
) -> Iterator[CellState]:
    """Follow a path of loads by continuation and yield the state at each.

    Where the kind of load changes, from moment to imposed curvature or back, the path continues from the
    present state, whose moment and curvature belong together.

    Parameters
    ----------
    cell, loads : the cell and its path of loads.
    start : state of the cell to start from; the unloaded cell by default.
    jumps : whether the path continues on another branch where walls lose their balance; if not, it ends.

    Raises
    ------
    ValueError
        See `PeriodCell.refuse`.
    CellError
        If a load is not reached; the states before have been yielded.
    """
    problem, solver, units = cell._problem, cell._solver, cell.equations.units
    state = start
    try:
        here, target, step = cell._at_rest(), _UNLOADED, _FIRST_STEP
        if start is not None:
            target, step = start.load.target(units), _STEP_FROM_A_START
            begun = cell.equations.symmetrised(start.configuration)
            here = solve_equilibrium(problem, solver, target, begun, options=cell.options)
        follower = PathFollower(problem, solver, here, target, step, creeps=jumps, options=cell.options)
        for load in loads:
            cell.refuse(load)
            before = follower.iterations
            goal = load.target(units)
            follower.target = _restated(follower.target, follower.equilibrium, goal, cell.equations.period)
            found = follower.follow(goal)
            state = cell._state(load, found, goal, follower.iterations - before, follower.jumped)
            yield state
    except NewtonError as error:
        raise CellError(f"the cell did not converge at the start: {error}", state) from error
    except PathError as error:
        message = f"the cell did not converge: {error}"
        try:
            last = solve_equilibrium(
                problem, solver, error.target, error.last.configuration, options=cell.options
            )
        except NewtonError:
            # Near an instability even the last equilibrium may not converge again.
            raise CellError(message, state, error.unstable) from error
        reached = cell._state(load_of(error.target, units), last, error.target, 0, follower.jumped)
        raise CellError(message, reached, error.unstable) from error


def _restated(here: CellTarget, at: CellEquilibrium, goal: CellTarget, period: float) -> CellTarget:
    """The present target as one of the goal's kind: by its curvature, or by its moment."""
    if (goal.curvature is None) == (here.curvature is None):
        return here
    if goal.curvature is not None:
        return CellTarget(here.pressure, curvature=at.configuration.curvature)
    return CellTarget(here.pressure, moment=at.own_linear.strain_residual[:3] / period)
