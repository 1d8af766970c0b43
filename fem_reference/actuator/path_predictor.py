"""Predictors of the next state in volume continuation: by the states behind, or by the stiffness."""

from dataclasses import dataclass

from fem_reference.actuator.volume_control import (
    VolumeControlledProblem,
    VolumeLinearisation,
    VolumeState,
    VolumeStep,
)
from fem_reference.errors import NewtonError
from fem_reference.solver import admissible_part, weights

# Cuts of a prediction before the present state replaces it.
_CUTS = 8


@dataclass(frozen=True)
class Polynomial:
    """Polynomial through the present state and those behind, at their distances along the path."""

    leg: VolumeControlledProblem
    states: list[VolumeState]
    back: list[float]

    def pressure(self, step: float) -> float:
        """π a step ahead [MPa]."""
        shares = weights(step, self.back)
        return sum(w * state.pressure for w, state in zip(shares, self.states, strict=True))

    def state(self, step: float) -> VolumeState:
        """A start for Newton's method: walls are kept apart, and if that does not do, the step is shorter."""
        here, share = self.states[0], 1.0
        for _ in range(_CUTS):
            plain = self.leg.mean(self.states, weights(share * step, self.back))
            plain = self.leg.keep_core_apart(here, plain)
            guess, allowed = plain, self.leg.start_share(here, plain)
            if allowed < 1.0:
                guess = self.leg.contact.keep_walls_apart(here, plain)
                if guess is not plain:
                    allowed = self.leg.start_share(here, guess)
            if allowed >= 1.0:
                return guess
            share *= allowed
        return here


@dataclass(frozen=True)
class Tangent:
    """Tangent of the path by a linearisation: ``direction`` is the step for a length of one."""

    leg: VolumeControlledProblem
    here: VolumeState
    linear: VolumeLinearisation
    direction: VolumeStep

    def pressure(self, step: float) -> float:
        """π a step ahead [MPa]."""
        return self.here.pressure + step * self.direction.pressure

    def state(self, step: float) -> VolumeState:
        """A start for Newton's method, as far as nothing blocks the step."""
        try:
            guess, _ = admissible_part(self.leg, self.here, self.direction, self.linear, step)
        except NewtonError:
            return self.here
        return guess
