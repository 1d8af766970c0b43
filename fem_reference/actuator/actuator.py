"""The full actuator: body, cap, core, winding and closed chambers under pressures, tip loads and gravity.

Units are SI here; the body's own (`Units`) are used behind this file only.
"""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field, replace

import numpy as np
from jaxtyping import Float

from fem_reference.actuator.equations import ActuatorEquations
from fem_reference.actuator.load import ActuatorLoad, ActuatorTarget
from fem_reference.actuator.model import ActuatorLinearisation, ActuatorModel, Deformation
from fem_reference.actuator.pose import AxisShape, axis_shape, bending
from fem_reference.actuator.problem import ActuatorProblem
from fem_reference.actuator.volume_continuation import VolumePathFollower
from fem_reference.algebra import SymmetricSolver, default_solver
from fem_reference.design import DENSITY, Design, refuse_unknown_bond
from fem_reference.errors import NewtonError
from fem_reference.geometry import (
    ActuatorGeometry,
    Core,
    DoubleHelix,
    Thread,
    Winding,
    refuse_force_beyond,
    refuse_implausible,
    refuse_moment_beyond,
    refuse_pressure_beyond,
)
from fem_reference.materials import Material, Ogden
from fem_reference.mesh import MeshLevel, mesh_level
from fem_reference.solver import Equilibrium, PathError, PathMemory, SolverOptions, solve_equilibrium

# Length of the first step of a path, in units of volume: about 0.015 shear moduli in one chamber.
_FIRST_STEP = 4.0


@dataclass(frozen=True)
class ActuatorState:
    """Equilibrium of the actuator. SI units, world frame: base at the origin, +z along the core at rest.

    Parameters
    ----------
    load : pressures and tip loads.
    tip_position : centre of the cap's outer face [m]; tip_rotation : of that face from rest.
    bending_angle : θ, angle of the face's normal from +z, continued past 180° along the axis [rad].
    bending_plane : γ in [0, 2π) [rad]; 0 is the plane of bending by chamber 1 alone, and of a straight axis.
    chamber_volume : of each chamber [m³].
    shape : of the core's axis.
    strain_energy : of all parts [J].
    rod_pressure : largest contact pressure on the core [Pa].
    thread_tension : largest tension of the thread [N]; zero without one.
    wall_distance : smallest distance between chamber walls within the contact's range [m]; else infinite.
    deformation : unknowns, to start from or to draw.
    settled : results of the solver beside the unknowns.
    converged : always true: a failure raises `ActuatorError`.
    """

    load: ActuatorLoad
    tip_position: Float[np.ndarray, "3"]
    tip_rotation: Float[np.ndarray, "3 3"]
    bending_angle: float
    bending_plane: float
    chamber_volume: Float[np.ndarray, "3"]
    shape: AxisShape
    strain_energy: float
    rod_pressure: float
    thread_tension: float
    wall_distance: float
    settled: "Settled"
    deformation: Deformation = field(repr=False)
    converged: bool = True


@dataclass(frozen=True)
class Settled:
    """Results of the solver at an equilibrium beside the unknowns.

    Parameters
    ----------
    base_force, base_moment : reaction at the clamped base, about the origin [N, N m].
    iterations : of Newton's method since the state before.
    residual : largest nodal force left [N].
    stable : whether the equilibrium is a minimum of the energy under its pressures: the stiffness has no
        negative pivot. None if the linear solver does not count them, or if there are some that are gone
        where each pair of walls in contact has a convex potential: such pairs may have their own.
    limit_pressure : last pressures before the body jumps on the way from the state before [Pa]; None if it
        does not jump.
    memory : of the path that led here.
    """

    base_force: Float[np.ndarray, "3"]
    base_moment: Float[np.ndarray, "3"]
    iterations: int
    residual: float
    stable: bool | None
    limit_pressure: Float[np.ndarray, "3"] | None
    memory: PathMemory = field(repr=False)

    @property
    def jumped(self) -> bool:
        """Whether the body jumps here when loads rise from the state before.

        Walls lost their balance, or the path passed a limit point of the pressures.
        """
        return self.limit_pressure is not None


class ActuatorError(ArithmeticError):
    """The solver did not reach the load.

    Parameters
    ----------
    message : why.
    last_good : last converged state on the way, or None.
    """

    def __init__(self, message: str, last_good: ActuatorState | None) -> None:
        super().__init__(message)
        self.last_good = last_good


class Actuator:
    """The whole actuator, clamped at its base.

    Parameters
    ----------
    geometry, material, winding, thread, core : by default the paper's. `Actuator.of` takes a design's.
    level : ``coarse``, ``medium``, ``paper``, or element counts of your own.
    density : of silicone and rod, for gravity [kg/m³].
    bonded : where the cavity is bonded to the core: in the ``cap``, as in the paper; at the ``tip`` only,
        over the core's diameter; or ``all`` along. Elsewhere it slides without friction and may leave the
        core.
    cap_wound : whether the thread continues over the cap.
    symmetric : whether the body keeps its plane of symmetry, y = 0, through the middle of chamber 1. That
        halves the unknowns; geometry, winding and loads must be symmetric too. Then ``stable`` is judged
        among symmetric states only.
    solver : linear solver; by default MKL PARDISO where it is installed.
    options : of the nonlinear solvers.

    Raises
    ------
    ValueError
        For an unknown mesh level or bond, a density that is not positive, impossible geometry, and a
        symmetric body whose geometry or winding is not symmetric.
    """

    def __init__(
        self,
        geometry: ActuatorGeometry | None = None,
        winding: Winding | None = None,
        level: str | MeshLevel = "coarse",
        material: Material | None = None,
        thread: Thread | None = None,
        density: float = DENSITY,
        bonded: str = "cap",
        cap_wound: bool = False,
        symmetric: bool = False,
        solver: SymmetricSolver | None = None,
        options: SolverOptions | None = None,
        core: Core | None = None,
    ) -> None:
        if not (np.isfinite(density) and density > 0.0):
            raise ValueError(f"density: got {density!r}, expected a positive finite number [kg/m³]")
        refuse_implausible("density", density)
        refuse_unknown_bond(bonded)
        self.model = ActuatorModel(
            geometry=geometry or ActuatorGeometry(),
            material=material or Ogden(),
            winding=winding or DoubleHelix(),
            thread=thread or Thread(),
            level=mesh_level(level),
            density=density,
            bonded=bonded,
            cap_wound=cap_wound,
            symmetric=symmetric,
            core=core or Core(),
        )
        self.equations = ActuatorEquations(self.model)
        self._problem = ActuatorProblem(self.equations)
        self._solver = solver or default_solver(definite=True, elimination=self.equations.elimination)
        self.options = options or SolverOptions()

    @classmethod
    def of(
        cls,
        design: Design,
        level: str | MeshLevel = "coarse",
        symmetric: bool = False,
        solver: SymmetricSolver | None = None,
        options: SolverOptions | None = None,
    ) -> "Actuator":
        """Return the actuator of a design.

        Parameters
        ----------
        design : actuator.
        level, symmetric, solver, options : see `Actuator`.
        """
        return cls(
            **design.body,
            level=level,
            density=design.density,
            bonded=design.bonded,
            cap_wound=design.cap_wound,
            symmetric=symmetric,
            solver=solver,
            options=options,
        )

    @property
    def elements(self) -> int:
        """Number of hexahedra."""
        return len(self.equations.mesh.elements)

    @property
    def unknowns(self) -> int:
        """Number of unknowns of the linear system."""
        return self.equations.size

    def solve(self, load: ActuatorLoad, start: ActuatorState | None = None) -> ActuatorState:
        """Equilibrium under ``load``, reached by continuation from rest or from ``start``.

        Raises
        ------
        ActuatorError
            If the load is not reached; it carries the last good state.
        """
        return next(iter(self.follow([load], start)))

    def follow(
        self, loads: Iterable[ActuatorLoad], start: ActuatorState | None = None
    ) -> Iterator[ActuatorState]:
        """Follow a path of loads by continuation and yield the state at each.

        Raises
        ------
        ValueError
            See `refuse`.
        ActuatorError
            If a load is not reached; the states before have been yielded.
        """
        state = start
        try:
            follower = self._follower(start)
            for load in loads:
                self.refuse(load)
                before, target = follower.iterations, load.target(self.equations.units)
                found = follower.follow(target)
                settled = self._settled(found, target, follower.iterations - before, follower)
                state = self.state(load, found.configuration, settled)
                yield state
        except NewtonError as error:
            raise ActuatorError(f"the actuator did not converge at the start: {error}", state) from error
        except PathError as error:
            raise ActuatorError(
                f"the actuator did not converge: {error}", self._last(error, follower)
            ) from error

    def refuse(self, load: ActuatorLoad) -> None:
        """Raise a ValueError for a load that the body cannot have.

        It is not symmetric, as the body is to stay; or so large that it seems to be in another unit.
        """
        modulus, geometry = self.model.material.shear_modulus, self.model.geometry
        diameter, length = geometry.body_diameter, geometry.body_length
        refuse_pressure_beyond(load.pressure, modulus)
        refuse_moment_beyond("tip_moment", load.tip_moment, modulus, diameter)
        refuse_force_beyond("tip_force", load.tip_force, modulus, diameter, length)
        if self.model.symmetric and not load.in_plane:
            raise ValueError(f"symmetric: got {load}, expected the same loads on both sides of y = 0")

    def _follower(self, start: ActuatorState | None) -> VolumePathFollower:
        if start is None:
            target = ActuatorLoad().target(self.equations.units)
            rest = self.equations.rest()
            here = solve_equilibrium(self._problem, self._solver, target, rest, options=self.options)
            return VolumePathFollower(
                self._problem, self._solver, here, target, _FIRST_STEP, options=self.options
            )
        here = Equilibrium[Deformation, ActuatorLinearisation](
            start.deformation, None, 0, start.settled.residual / self.equations.units.newton, None
        )
        return VolumePathFollower(
            self._problem,
            self._solver,
            here,
            start.load.target(self.equations.units),
            start.settled.memory,
            options=self.options,
        )

    def _last(self, error: PathError, follower: VolumePathFollower) -> ActuatorState:
        last = error.last
        if last.linear is None:
            last = replace(last, linear=self._problem.linearise(last.configuration, error.target))
        settled = self._settled(last, error.target, 0, follower)
        return self.state(ActuatorLoad.of(error.target, self.equations.units), last.configuration, settled)

    def _settled(
        self,
        found: Equilibrium[Deformation, ActuatorLinearisation],
        target: ActuatorTarget,
        iterations: int,
        follower: VolumePathFollower,
    ) -> Settled:
        linear, units = found.own_linear, self.equations.units
        reaction = self.equations.reaction(linear, target) * units.newton
        return Settled(
            base_force=reaction.sum(axis=0),
            base_moment=np.cross(linear.positions, reaction).sum(axis=0) / units.metre,
            iterations=iterations,
            residual=found.residual * units.newton,
            stable=self._stable(linear),
            limit_pressure=None if follower.limit is None else follower.limit.pressure * units.megapascal,
            memory=follower.memory,
        )

    def _stable(self, linear: ActuatorLinearisation) -> bool | None:
        """Whether the energy is at a minimum under these pressures; None if that cannot be told.

        Pairs of walls in contact may have negative pivots of their own: nodes slide off the edges of facets.
        With their contact convex the stiffness is larger in every direction: what is negative then is so.
        """
        pattern = self.equations.pattern
        negative = self._solver.factorise(pattern.matrix(linear.data), pattern.revision)
        if not negative:
            return None if negative is None else True
        convex = self._problem.contact.convexified(linear)
        return False if self._solver.factorise(pattern.matrix(convex), pattern.revision) else None

    def state(self, load: ActuatorLoad, deformation: Deformation, settled: Settled) -> ActuatorState:
        """`ActuatorState` of an equilibrium under ``load``."""
        equations, units = self.equations, self.equations.units
        x = deformation.positions
        frame = equations.tip.frame(x)
        shape = axis_shape(equations, x)
        tangents = np.concatenate([shape.rotations[:, :, 2], frame.rotation[None, :, 2]])
        body = np.searchsorted(shape.arc_length, (equations.body_length - 1e-6) / units.metre)
        angle, plane = bending(tangents, shape.positions[body])
        return ActuatorState(
            load=load,
            tip_position=frame.position / units.metre,
            tip_rotation=frame.rotation,
            bending_angle=angle,
            bending_plane=plane,
            chamber_volume=equations.volumes(deformation) / units.metre**3,
            shape=shape,
            strain_energy=equations.strain_energy(deformation) * units.newton / units.metre,
            rod_pressure=float(equations.contact.pressure(x).max(initial=0.0)) * units.megapascal,
            thread_tension=float(equations.thread.tension(x).max(initial=0.0)) * units.newton,
            wall_distance=equations.walls.minimum_distance(x) / units.metre,
            deformation=deformation,
            settled=settled,
        )
