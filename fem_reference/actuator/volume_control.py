"""Equilibria of the actuator under a given volume of its chambers, which find the pressure that holds it.

Under pressures that rise in proportion, the actuator grows so soft that a small error in forces moves it by
millimetres, and it may come to a limit point. Under a given volume it is stiff, as one that is filled with
water. With pressures p = p₀ + π n along a heading n of unit length, the pressures' work is π per volume
v = Σ n_k V_k; v is given and π is an unknown, or what is asked of v depends on π (`StopCondition`). With
g = ∂v/∂x the system is bordered by its own symmetric column,

    [ K  −g ] [ dx ]   [ −r           ]
    [ gᵀ  0 ] [ dπ ] = [ v_asked − v ],

and solved by the factors of K, which may have one negative eigenvalue: with g K⁻¹ g < 0 the bordered matrix
has the inertia of a minimum (Haynsworth's additivity).

References
----------
Crisfield (1991), Non-linear Finite Element Analysis of Solids and Structures, vol. 1, §9.3, for two solves in
place of a bordered one. Haynsworth (1968), Determination of the inertia of a partitioned Hermitian matrix.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from fem_reference.actuator.load import ActuatorTarget
from fem_reference.actuator.model import ActuatorLinearisation, Deformation
from fem_reference.actuator.problem import ActuatorProblem, ActuatorStep
from fem_reference.algebra import SymmetricSolver, scatter
from fem_reference.elements import ViscousSolid
from fem_reference.solver import Linearisation, Problem

# Volume that counts as a path's length of one, as a share of the chambers' at rest: a kPa in one of them adds
# 1.6 % of it at rest, and 4 % at 50 kPa.
_UNIT = 0.02
# Pressure, and work of the volume [N mm], that pass for the contact's noise [MPa]: of 1 Pa, with which the
# actuator bends by some 0.004° at most.
_NOISE = 1e-6
# Difference of the path's slope and the stiffness' own, as a share, up to which the latter is believed.
_BELIEVED = 0.25
# Share of the path's slope below which the stiffness at hand is much too stiff.
_TOO_STIFF = 0.6


@dataclass(frozen=True)
class VolumeState:
    """A deformation and the pressure π along the heading that goes with it [MPa]."""

    deformation: Deformation
    pressure: float


@dataclass(frozen=True)
class Volume:
    """A volume v to hold [mm³]."""

    value: float

    def missing(self, volume: float, pressure: float) -> float:
        """What the volume lacks [mm³]."""
        return self.value - volume

    def pressure_step(self, linear: "VolumeLinearisation", filled: float, compliance: float) -> float:
        """Step of π [MPa] beside one of the points that would fill by ``filled`` [mm³]."""
        return (linear.missing - filled) / compliance

    def imbalance(self, missing: float) -> float:
        """The same as the work of 1 kPa [N mm]."""
        return 1e-3 * abs(missing)


@dataclass(frozen=True)
class StopCondition:
    """A pressure π to arrive at [MPa]: the volume follows what is left to it with the path's dv/dπ.

    The stiffness at hand would know dv/dπ too, where it is exact; with convex contact it is too stiff, and
    the pressure would be arrived at by steps that hardly shrink.
    """

    pressure: float
    slope: float

    def missing(self, volume: float, pressure: float) -> float:
        """What the volume lacks, going by the pressure [mm³]."""
        return self.slope * (self.pressure - pressure)

    def pressure_step(self, linear: "VolumeLinearisation", filled: float, compliance: float) -> float:
        """See `Volume.pressure_step`; all that is left, where the stiffness at hand is to be believed.

        Where it is much too stiff, as with viscosity, the volume is held: the pressure that such a stiffness
        asks for to fill the body would lead away.
        """
        if not linear.walls_touch and abs(compliance / self.slope - 1.0) < _BELIEVED:
            return linear.missing / self.slope
        missing = linear.missing if compliance > _TOO_STIFF * self.slope else 0.0
        return (missing - filled) / compliance

    def imbalance(self, missing: float) -> float:
        """What is left to the pressure, over 1 mm³ [N mm]."""
        return abs(missing / self.slope)


@dataclass(frozen=True)
class VolumeLinearisation(Linearisation):
    """The actuator's linearisation with the volume's gradient g [mm²] and what the volume lacks [mm³]."""

    actuator: ActuatorLinearisation
    gradient: Float[np.ndarray, " q"]
    missing: float


class VolumeStep:
    """A step of all points and of the pressure [MPa], with what the target lacks before it [MPa or N mm]."""

    def __init__(self, actuator: ActuatorStep, pressure: float, imbalance: float = 0.0) -> None:
        self.actuator = actuator
        self.positions = actuator.positions
        self.pressure = pressure
        self.imbalance = imbalance


class VolumeControlledProblem(Problem):
    """The actuator's problem with the volume given in place of pressures, on a straight path of these.

    Configurations are `VolumeState`, targets `Volume` or `StopCondition`.

    Parameters
    ----------
    problem : the actuator's.
    origin, goal : ends of the path; they differ in pressures.
    """

    def __init__(self, problem: ActuatorProblem, origin: ActuatorTarget, goal: ActuatorTarget) -> None:
        self.problem = problem
        self.pattern = problem.pattern
        self.constraints = problem.constraints
        self.reach, self.noise, self.nearby = problem.reach, problem.noise, problem.nearby
        self.exact, self.stride = problem.exact, problem.stride
        self._origin, self.goal = origin, goal
        change = goal.pressure - origin.pressure
        self._length = float(np.linalg.norm(change))
        self._heading = change / self._length
        #: π at both ends [MPa]; the same scale on every path with this heading.
        self.start, self.end = self.along_heading(origin), self.along_heading(goal)
        rest = problem.equations.volumes(problem.equations.rest())
        #: Volume that counts as a path's length of one [mm³].
        self.unit = _UNIT * float(np.abs(self._heading) @ rest)

    def along_heading(self, target: ActuatorTarget) -> float:
        """π of a target [MPa]."""
        return float(self._heading @ target.pressure)

    def target(self, pressure: float) -> ActuatorTarget:
        """The loads at π."""
        return self._origin.between(self.goal, (pressure - self.start) / self._length)

    def volume(self, at: VolumeState) -> float:
        """Of the chambers, each by its share in the heading: v [mm³]."""
        return float(self._heading @ self.problem.equations.volumes(at.deformation))

    def _gradient(self, x: Float[np.ndarray, "points 3"]) -> Float[np.ndarray, " q"]:
        """∂v/∂x of what is free [mm²]."""
        equations, gradient = self.problem.equations, np.zeros_like(x)
        for weight, chamber in zip(self._heading, equations.chambers, strict=True):
            if weight != 0.0:
                for patch in chamber.patches:
                    gradient += scatter(patch.connectivity, weight * patch.gradient(x), len(x))
        return equations.fold @ gradient.ravel()

    def compliance(self, solver: SymmetricSolver, linear: VolumeLinearisation) -> tuple[np.ndarray, float]:
        """∂x/∂π and ∂v/∂π by the factors that ``solver`` holds."""
        softness = self.problem.solve(solver, linear.actuator, linear.gradient[:, None])[:, 0]
        return softness, float(linear.gradient @ softness)

    def along(self, solver: SymmetricSolver, linear: VolumeLinearisation, volume: float) -> VolumeStep:
        """The step along the path's tangent that fills by ``volume`` [mm³]."""
        softness, compliance = self.compliance(solver, linear)
        pressure = volume / compliance
        return VolumeStep(self.problem.step(pressure * softness, linear.actuator), pressure)

    def begin(self, start: VolumeState, target: Volume | StopCondition) -> VolumeState:
        """See `ActuatorProblem.begin`."""
        return VolumeState(self.problem.begin(start.deformation, self.target(start.pressure)), start.pressure)

    def _bordered(
        self, linear: ActuatorLinearisation, at: VolumeState, target: Volume | StopCondition
    ) -> VolumeLinearisation:
        return VolumeLinearisation(
            residual=linear.residual,
            data=linear.data,
            walls_touch=linear.walls_touch,
            pairs=linear.pairs,
            slack=linear.slack,
            actuator=linear,
            gradient=self._gradient(at.deformation.positions),
            missing=target.missing(self.volume(at), at.pressure),
        )

    def linearise(
        self,
        at: VolumeState,
        target: Volume | StopCondition,
        viscous: ViscousSolid | None = None,
        before: VolumeLinearisation | None = None,
    ) -> VolumeLinearisation:
        """See `Problem.linearise`."""
        last = None if before is None else before.actuator
        loads = self.target(at.pressure)
        return self._bordered(self.problem.linearise(at.deformation, loads, viscous, last), at, target)

    def update_forces(
        self,
        linear: VolumeLinearisation,
        at: VolumeState,
        target: Volume | StopCondition,
        viscous: ViscousSolid | None = None,
    ) -> VolumeLinearisation:
        """See `Problem.update_forces`."""
        loads = self.target(at.pressure)
        return self._bordered(
            self.problem.update_forces(linear.actuator, at.deformation, loads, viscous), at, target
        )

    def keeps(self, linear: VolumeLinearisation, at: VolumeState) -> bool:
        """See `Problem.keeps`."""
        return self.problem.keeps(linear.actuator, at.deformation)

    def convexified_contact(self, linear: VolumeLinearisation) -> Float[np.ndarray, " nonzeros"]:
        """See `Problem.convexified_contact`."""
        return self.problem.convexified_contact(linear.actuator)

    def core_curvature_stiffness(self, linear: VolumeLinearisation) -> Float[np.ndarray, " nonzeros"]:
        """See `Problem.core_curvature_stiffness`."""
        return self.problem.core_curvature_stiffness(linear.actuator)

    def viscous(self, at: VolumeState, rate: float) -> ViscousSolid:
        """See `Problem.viscous`."""
        return self.problem.viscous(at.deformation, rate)

    def stiffened(
        self, data: Float[np.ndarray, " nonzeros"], resistance: ViscousSolid, linear: VolumeLinearisation
    ) -> Float[np.ndarray, " nonzeros"]:
        """See `Problem.stiffened`."""
        return self.problem.stiffened(data, resistance, linear.actuator)

    def excess(
        self, solver: SymmetricSolver, linear: VolumeLinearisation, negative: int | None
    ) -> int | None:
        """Negative pivots of the bordered matrix beyond the constraint's own."""
        excess = super().excess(solver, linear, negative)
        if not excess:
            return excess
        _, compliance = self.compliance(solver, linear)
        return excess - int(compliance < 0.0)

    def imbalance(self, linear: VolumeLinearisation, target: Volume | StopCondition) -> float:
        """Of volume or pressure, as work [N mm]."""
        return target.imbalance(linear.missing)

    def newton_step(
        self, solver: SymmetricSolver, linear: VolumeLinearisation, target: Volume | StopCondition
    ) -> VolumeStep:
        """Step of the bordered system."""
        right = np.column_stack([-linear.residual, linear.gradient])
        solution = self.problem.solve(solver, linear.actuator, right)
        filled, compliance = linear.gradient @ solution
        pressure = float(target.pressure_step(linear, float(filled), float(compliance)))
        step = solution[:, 0] + pressure * solution[:, 1]
        imbalance = self.imbalance(linear, target)
        return VolumeStep(self.problem.step(step, linear.actuator), pressure, imbalance)

    def size(self, step: VolumeStep, linear: VolumeLinearisation) -> float:
        """Root-mean-square displacement in a step [mm]."""
        return self.problem.size(step.actuator, linear.actuator)

    def is_small(self, step: VolumeStep) -> bool:
        """Whether pressure and volume are found."""
        return max(abs(step.pressure), step.imbalance) <= _NOISE

    def longest(self, step: VolumeStep) -> float:
        """See `Problem.longest`."""
        return self.problem.longest(step.actuator)

    def advance(
        self, at: VolumeState, step: VolumeStep, fraction: float, linear: VolumeLinearisation
    ) -> VolumeState:
        """See `ActuatorProblem.advance`."""
        moved = self.problem.advance(at.deformation, step.actuator, fraction, linear.actuator)
        return VolumeState(moved, at.pressure + fraction * step.pressure)

    def keep_core_apart(self, at: VolumeState, trial: VolumeState) -> VolumeState:
        """See `ActuatorProblem.keep_core_apart`."""
        return VolumeState(self.problem.keep_core_apart(at.deformation, trial.deformation), trial.pressure)

    def keep_walls_apart(self, at: VolumeState, trial: VolumeState) -> VolumeState:
        """See `Problem.keep_walls_apart`."""
        held = self.problem.keep_walls_apart(at.deformation, trial.deformation)
        return trial if held is trial.deformation else VolumeState(held, trial.pressure)

    def allowed(self, linear: VolumeLinearisation, trial: VolumeState) -> float:
        """See `Problem.allowed`."""
        return self.problem.allowed(linear.actuator, trial.deformation)

    def mean(self, states: list[VolumeState], weights: list[float]) -> VolumeState:
        """See `Problem.mean`."""
        mean = self.problem.mean([state.deformation for state in states], weights)
        return VolumeState(mean, sum(w * state.pressure for w, state in zip(weights, states, strict=True)))

    def may_start(self, at: VolumeState, guess: VolumeState) -> bool:
        """See `Problem.may_start`."""
        return self.problem.may_start(at.deformation, guess.deformation)

    def start_share(self, at: VolumeState, guess: VolumeState) -> float:
        """See `ActuatorProblem.start_share`."""
        return self.problem.start_share(at.deformation, guess.deformation)
