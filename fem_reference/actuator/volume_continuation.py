"""Pressure continuation under volume control.

Steps are taken in the chambers' volume (`VolumeControlledProblem`), and the pressure follows. When the states
behind predict the goal's pressure within the next step, that step stops at it. Past a limit point the
pressure falls for a while, and the path continues to the first state with the goal's pressure. Under rising
pressures the body would jump there; the follower keeps the pressures of the jump. `PathFollower` treats other
loads, and walls that lose their balance under any volume.
"""

import logging
from typing import Any

import numpy as np
from scipy.optimize import brentq

from fem_reference.actuator.load import ActuatorTarget
from fem_reference.actuator.model import ActuatorLinearisation, Deformation
from fem_reference.actuator.path_predictor import Polynomial, Tangent
from fem_reference.actuator.problem import ActuatorProblem, ActuatorStep
from fem_reference.actuator.volume_control import (
    StopCondition,
    Volume,
    VolumeControlledProblem,
    VolumeLinearisation,
    VolumeState,
)
from fem_reference.elements import ViscousSolid
from fem_reference.solver import Equilibrium, PathFollower

_LOG = logging.getLogger(__name__)

# The next step may be this much longer if it then reaches the goal.
_REACH = 1.15
# Fall of the pressure [MPa] that counts as a limit point. States on the way are rough: on the medium mesh,
# two paths that are mirror images differ by 1.5e-4 at the same volume.
_FALL = 2e-4
# Share of a step over which the slope of the pressure is measured.
_SLOPE = 1e-3

LegEquilibrium = Equilibrium[VolumeState, VolumeLinearisation]


class VolumePathFollower(
    PathFollower[Deformation, ActuatorTarget, ActuatorLinearisation, ActuatorStep, ViscousSolid]
):
    """Equilibria of the actuator, one load after another; see `PathFollower`."""

    problem: ActuatorProblem

    def follow(self, goal: ActuatorTarget) -> Equilibrium[Deformation, ActuatorLinearisation]:
        """See `PathFollower.follow`."""
        change = self.target.to(goal)
        length = float(np.linalg.norm(change))
        if length == 0.0 or not self.target.differs_by_pressure(goal):
            return super().follow(goal)
        self.limit = None
        self._turn(change / length)
        leg = VolumeControlledProblem(self.problem, self.target, goal)
        here = VolumeState(self.equilibrium.configuration, leg.start)
        highest = self.target
        # Target and length of each step that failed from the present equilibrium.
        failed: list[tuple[Any, float]] = []
        while True:
            found, target, step = self._next(leg, here)
            if found is not None:
                gone = (leg.volume(found.configuration) - leg.volume(here)) / leg.unit
                _LOG.debug(
                    "a step of %.3g: %d iterations, the longest of %.2e mm, to %.4g kPa",
                    *(gone, found.iterations, found.longest, found.configuration.pressure * leg.kilopascals),
                )
                rise = found.configuration.pressure - leg.along_heading(highest)
                if rise >= 0.0:
                    highest = target
                elif rise < -_FALL:
                    self._jump(highest)
                plain = Equilibrium[Deformation, ActuatorLinearisation](
                    **{**vars(found), "configuration": found.configuration.deformation}
                )
                self._arrive(plain, target, here, gone)
                here, failed = found.configuration, []
            else:
                failed.append((target, step))
                if self._retreat(failed):
                    here = VolumeState(self.equilibrium.configuration, leg.along_heading(self.target))
                    failed = []
            if self.target is goal:
                return self.equilibrium

    def _next(
        self, leg: VolumeControlledProblem, here: VolumeState
    ) -> tuple[LegEquilibrium | None, ActuatorTarget, float]:
        """The next equilibrium, or None; its loads, or those for viscous relaxation; and the step tried."""
        ahead, step = self._ahead(leg, here), self.step
        farthest = max(step, min(_REACH * step, self._longest))
        if ahead.pressure(farthest) >= leg.end:
            step = float(brentq(lambda h: ahead.pressure(h) - leg.end, 0.0, farthest))
            return self._arrival(leg, ahead.state(step), _slope(leg, ahead, step)), leg.goal, step
        volume = Volume(leg.volume(here) + step * leg.unit)
        start = ahead.state(step)
        found = self._solve(leg, volume, start, on_the_way=True)
        if found is None:
            # Relaxation needs a pressure above the present one, even if the path's pressure falls.
            higher = here.pressure + abs(ahead.pressure(step) - here.pressure)
            return None, leg.target(higher) if higher < leg.end else leg.goal, step
        beyond = found.configuration
        if beyond.pressure < leg.end:
            return found, leg.target(beyond.pressure), step
        share = (leg.end - here.pressure) / (beyond.pressure - here.pressure)
        between = leg.mean([here, beyond], [1.0 - share, share])
        slope = (leg.volume(beyond) - leg.volume(here)) / (beyond.pressure - here.pressure)
        return self._arrival(leg, between, slope), leg.goal, step

    def _arrival(
        self, leg: VolumeControlledProblem, start: VolumeState, slope: float
    ) -> LegEquilibrium | None:
        return self._solve(leg, StopCondition(leg.end, slope), start, on_the_way=False)

    def _ahead(self, leg: VolumeControlledProblem, here: VolumeState) -> Polynomial | Tangent:
        """Predictor by as many states behind as can be trusted, or by the stiffness if there are none."""
        for degree in range(len(self._earlier), 0, -1):
            states, back = zip(*self._earlier[:degree], strict=True)
            polynomial = Polynomial(leg, [here, *states], list(back))
            if self._trusts(self.step, polynomial.back):
                return polynomial
        linear = leg.linearise(here, Volume(leg.volume(here)))
        if self.equilibrium.linear is None or self._factors != self.solver.factors:
            self.solver.factorise(leg.pattern.matrix(linear.data), leg.pattern.revision)
        return Tangent(leg, here, linear, leg.along(self.solver, linear, leg.unit))


def _slope(leg: VolumeControlledProblem, ahead: Polynomial | Tangent, step: float) -> float:
    """Slope dv/dπ of the predicted path [mm³/MPa]."""
    low, high = (1.0 - _SLOPE) * step, (1.0 + _SLOPE) * step
    return leg.unit * (high - low) / (ahead.pressure(high) - ahead.pressure(low))
