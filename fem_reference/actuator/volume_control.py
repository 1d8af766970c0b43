"""Volume control: equilibria of the actuator under a given volume of its chambers, the pressure unknown.

Under pressures that rise in proportion, the actuator becomes so soft that a small error in forces moves it by
millimetres, and it may reach a limit point. Under a given volume it is stiff, as if filled with water.

With pressures p = p₀ + π n along a heading n of unit length, the pressures' work is π per volume
v = Σ n_k V_k. Either v is given and π is unknown, or the target volume depends on π (`StopCondition`). With
g = ∂v/∂x the system is bordered by its own symmetric column,

    [ K  −g ] [ dx ]   [ −r           ]
    [ gᵀ  0 ] [ dπ ] = [ v_target − v ],

and solved by the factors of K, which may have one negative eigenvalue: with g K⁻¹ g < 0 the bordered matrix
has the inertia of a minimum (Haynsworth's additivity).

References
----------
Crisfield (1991), Non-linear Finite Element Analysis of Solids and Structures, vol. 1, §9.3, for two solves in
place of a bordered one. Haynsworth (1968), Determination of the inertia of a partitioned Hermitian matrix.
"""

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float

from fem_reference.actuator.load import ActuatorTarget
from fem_reference.actuator.model import ActuatorLinearisation, Deformation
from fem_reference.actuator.problem import ActuatorProblem, ActuatorStep, BodyProblem
from fem_reference.algebra import SymmetricSolver, scatter
from fem_reference.elements import ViscousSolid

# Volume that counts as a path's length of one, as a share of the chambers' volume at rest. A kPa in one
# chamber adds 1.6 % at rest, and 4 % at 50 kPa.
_UNIT = 0.02
# Pressure [MPa], and work of the volume [N mm], that count as contact noise: 1 Pa bends the actuator by
# 0.004° at most.
_NOISE = 1e-6
# Relative difference of the path's slope dv/dπ and the compliance of the stiffness at hand, up to which the
# stiffness serves for the step of π.
_ACCURATE = 0.25
# Share of the path's slope below which the stiffness at hand is much too stiff.
_TOO_STIFF = 0.6


@dataclass(frozen=True)
class VolumeState:
    """A deformation and the pressure π along the heading [MPa]."""

    deformation: Deformation
    pressure: float

    def with_deformation(self, deformation: Deformation) -> "VolumeState":
        """See `BodyState.with_deformation`."""
        return VolumeState(deformation, self.pressure)


@dataclass(frozen=True)
class Volume:
    """A volume v to hold [mm³]."""

    value: float

    def missing(self, volume: float, pressure: float) -> float:
        """Target volume less the volume [mm³]."""
        return self.value - volume

    def pressure_step(self, linear: "VolumeLinearisation", filled: float, compliance: float) -> float:
        """Step of π [MPa], if the points' own step adds the volume ``filled`` [mm³]."""
        return (linear.missing - filled) / compliance

    def imbalance(self, missing: float) -> float:
        """The missing volume as the work of 1 kPa [N mm]."""
        return 1e-3 * abs(missing)


@dataclass(frozen=True)
class StopCondition:
    """A pressure π at which the path stops [MPa]; the target volume follows from π by the path's slope dv/dπ.

    An exact stiffness has the right compliance dv/dπ too. With convexified contact it is too stiff, and steps
    to the pressure would hardly shrink.
    """

    pressure: float
    slope: float

    def missing(self, volume: float, pressure: float) -> float:
        """Volume that the missing pressure stands for [mm³]."""
        return self.slope * (self.pressure - pressure)

    def pressure_step(self, linear: "VolumeLinearisation", filled: float, compliance: float) -> float:
        """See `Volume.pressure_step`; the whole missing pressure, if the stiffness at hand is accurate.

        If the stiffness is much too stiff, as with viscosity, the volume is held: with such a stiffness, the
        pressure step that fills the body would lead away.
        """
        if not linear.walls_touch and abs(compliance / self.slope - 1.0) < _ACCURATE:
            return linear.missing / self.slope
        missing = linear.missing if compliance > _TOO_STIFF * self.slope else 0.0
        return (missing - filled) / compliance

    def imbalance(self, missing: float) -> float:
        """The missing pressure as work over 1 mm³ [N mm]."""
        return abs(missing / self.slope)


@dataclass(frozen=True)
class VolumeLinearisation(ActuatorLinearisation):
    """The actuator's linearisation with the volume's gradient g [mm²] and the missing volume [mm³]."""

    gradient: Float[np.ndarray, " q"]
    missing: float


@dataclass(frozen=True)
class VolumeStep(ActuatorStep):
    """A step of all points and of the pressure [MPa], and the imbalance before it [MPa or N mm]."""

    pressure: float
    imbalance: float = 0.0


class VolumeControlledProblem(
    BodyProblem[VolumeState, Volume | StopCondition, VolumeLinearisation, VolumeStep]
):
    """The actuator on a straight path of pressures, its volume given in place of the pressure.

    Parameters
    ----------
    problem : the actuator's, under given pressures.
    origin, goal : ends of the path, with different pressures.
    """

    def __init__(self, problem: ActuatorProblem, origin: ActuatorTarget, goal: ActuatorTarget) -> None:
        super().__init__(problem.equations, problem.motion)
        self._inner = problem
        self._origin, self.goal = origin, goal
        change = goal.pressure - origin.pressure
        self._length = float(np.linalg.norm(change))
        self._heading = change / self._length
        #: π at both ends [MPa], on the same scale for every path with this heading.
        self.start, self.end = self.along_heading(origin), self.along_heading(goal)
        rest = self.equations.volumes(self.equations.rest())
        #: Volume that counts as a path's length of one [mm³].
        self.unit = _UNIT * float(np.abs(self._heading) @ rest)

    def along_heading(self, target: ActuatorTarget) -> float:
        """π of a target [MPa]."""
        return float(self._heading @ target.pressure)

    def target(self, pressure: float) -> ActuatorTarget:
        """The loads at π."""
        return self._origin.between(self.goal, (pressure - self.start) / self._length)

    def volume(self, at: VolumeState) -> float:
        """Volume v of the chambers, each weighted by its component of the heading [mm³]."""
        return float(self._heading @ self.equations.volumes(at.deformation))

    def _gradient(self, x: Float[np.ndarray, "points 3"]) -> Float[np.ndarray, " q"]:
        """∂v/∂x over the unknowns [mm²]."""
        gradient = np.zeros_like(x)
        for weight, chamber in zip(self._heading, self.equations.chambers, strict=True):
            if weight != 0.0:
                for patch in chamber.patches:
                    gradient += scatter(patch.connectivity, weight * patch.gradient(x), len(x))
        return np.asarray(self.equations.fold @ gradient.ravel())

    def compliance(self, solver: SymmetricSolver, linear: VolumeLinearisation) -> tuple[np.ndarray, float]:
        """∂x/∂π and ∂v/∂π by the factors that ``solver`` holds."""
        softness = self._inner.solve(solver, linear, linear.gradient[:, None])[:, 0]
        return softness, float(linear.gradient @ softness)

    def along(self, solver: SymmetricSolver, linear: VolumeLinearisation, volume: float) -> VolumeStep:
        """The step along the path's tangent that adds a ``volume`` [mm³]."""
        softness, compliance = self.compliance(solver, linear)
        pressure = volume / compliance
        return VolumeStep(self._inner.displacement(pressure * softness), pressure)

    def linearise(
        self,
        at: VolumeState,
        target: Volume | StopCondition,
        viscous: ViscousSolid | None = None,
        before: VolumeLinearisation | None = None,
    ) -> VolumeLinearisation:
        """See `Equations.linearise`."""
        linear = self._inner.linearise(at.deformation, self.target(at.pressure), viscous, before)
        return VolumeLinearisation(
            **vars(linear),
            gradient=self._gradient(linear.positions),
            missing=target.missing(self.volume(at), at.pressure),
        )

    def update_forces(
        self,
        linear: VolumeLinearisation,
        at: VolumeState,
        target: Volume | StopCondition,
        viscous: ViscousSolid | None = None,
    ) -> VolumeLinearisation:
        """See `Equations.update_forces`."""
        loads = self.target(at.pressure)
        return replace(
            self.equations.update_forces(linear, at.deformation, loads, viscous),
            gradient=self._gradient(at.deformation.positions),
            missing=target.missing(self.volume(at), at.pressure),
        )

    def excess(
        self, solver: SymmetricSolver, linear: VolumeLinearisation, negative: int | None
    ) -> int | None:
        """Negative pivots of the bordered matrix beyond the volume constraint's own."""
        excess = super().excess(solver, linear, negative)
        if not excess:
            return excess
        _, compliance = self.compliance(solver, linear)
        return excess - int(compliance < 0.0)

    def imbalance(self, linear: VolumeLinearisation, target: Volume | StopCondition) -> float:
        """Missing volume or pressure, as work [N mm]."""
        return target.imbalance(linear.missing)

    def newton_step(
        self, solver: SymmetricSolver, linear: VolumeLinearisation, target: Volume | StopCondition
    ) -> VolumeStep:
        """Step of the bordered system."""
        right = np.column_stack([-linear.residual, linear.gradient])
        solution = self._inner.solve(solver, linear, right)
        filled, compliance = linear.gradient @ solution
        pressure = float(target.pressure_step(linear, float(filled), float(compliance)))
        step = solution[:, 0] + pressure * solution[:, 1]
        return VolumeStep(self._inner.displacement(step), pressure, self.imbalance(linear, target))

    def is_small(self, step: VolumeStep) -> bool:
        """Whether the step of the pressure and the missing volume are contact noise."""
        return max(abs(step.pressure), step.imbalance) <= _NOISE

    def advance(
        self, at: VolumeState, step: VolumeStep, fraction: float, linear: VolumeLinearisation
    ) -> VolumeState:
        """See `ActuatorProblem.advance`."""
        moved = self._inner.advance(at.deformation, step, fraction, linear)
        return VolumeState(moved, at.pressure + fraction * step.pressure)

    def mean(self, states: list[VolumeState], weights: list[float]) -> VolumeState:
        """See `ActuatorProblem.mean`."""
        mean = self._inner.mean([state.deformation for state in states], weights)
        return VolumeState(mean, sum(w * state.pressure for w, state in zip(weights, states, strict=True)))
