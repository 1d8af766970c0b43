"""The common problem by PyElastica: the rod's motion, damped until it rests.

PyElastica integrates the motion of a rod that stretches and shears. Its mass is free, as only the rest state
is wanted: it is set to one gram, and gravity so that the weight is that of the problem. The radius is free
too, at given bending and torsion stiffness: a thinner rod is stiffer against stretch and shear, the less it
misses the inextensible rod and the shorter are its time steps. Damping is twice the lowest bending frequency.

The clamp holds the orientation of the first element, which is that at its middle. So the rod is made half an
element longer and reaches behind the clamp; held at its end it would be met to first order only.
"""

import math
from collections.abc import Callable

import elastica
import numpy as np

from tests.benchmark.peers.common_problem import (
    BENDING_STIFFNESS,
    FREE_CURVATURE,
    LENGTH,
    TORSION_STIFFNESS,
    WEIGHT,
    Setting,
    Solver,
    Start,
)

_MASS_PER_LENGTH = 1e-3 / LENGTH  # [kg/m]
_MAX_STEPS = 400_000
# Fraction of the time in which a wave of stretch crosses an element, or one of shear turns it.
_COURANT = 0.8


class _Simulator(elastica.BaseSystemCollection, elastica.Constraints, elastica.Forcing, elastica.Damping):
    """What a clamped, loaded and damped rod needs."""


class DampedMotion:
    """Position Verlet with an analytical damper, to rest."""

    def __init__(self, elements: int, radius: float, rest: float) -> None:
        self.rest = rest
        size = LENGTH / (elements - 0.5)
        area, second_moment = math.pi * radius**2, 0.25 * math.pi * radius**4
        young = BENDING_STIFFNESS / second_moment
        rod = elastica.CosseratRod.straight_rod(
            elements,
            np.array([0.0, 0.0, -0.5 * size]),
            np.array([0.0, 0.0, 1.0]),
            np.array([1.0, 0.0, 0.0]),
            elements * size,
            radius,
            _MASS_PER_LENGTH / area,
            youngs_modulus=young,
            shear_modulus=TORSION_STIFFNESS / (2.0 * second_moment),
        )
        # PyElastica measures curvature with the sign of the rotation from the section to the world.
        rod.rest_kappa[...] = FREE_CURVATURE[:, None]
        self.frequency = 3.516 * math.sqrt(BENDING_STIFFNESS / _MASS_PER_LENGTH) / LENGTH**2
        self.time_step = _COURANT * min(size, radius) / math.sqrt(young * area / _MASS_PER_LENGTH)
        self.force = np.zeros(3)
        simulator = _Simulator()
        simulator.append(rod)
        simulator.constrain(rod).using(
            elastica.OneEndFixedBC, constrained_position_idx=(0,), constrained_director_idx=(0,)
        )
        gravity = WEIGHT / (_MASS_PER_LENGTH * LENGTH)
        simulator.add_forcing_to(rod).using(elastica.GravityForces, acc_gravity=np.array([0.0, 0.0, gravity]))
        simulator.add_forcing_to(rod).using(
            elastica.EndpointForces, np.zeros(3), self.force, ramp_up_time=1e-12
        )
        simulator.dampen(rod).using(
            elastica.AnalyticalLinearDamper,
            uniform_damping_constant=2.0 * self.frequency,
            time_step=self.time_step,
        )
        simulator.finalize()
        self.rod, self.simulator = rod, simulator
        self.stepper = elastica.PositionVerlet()
        self.free = _arc(elements, size)
        self.steps = 0

    def __call__(self, force: np.ndarray, start: Start | None) -> tuple[np.ndarray, Start]:
        positions, directors = self.free if start is None else start
        rod = self.rod
        rod.position_collection[...] = positions
        rod.director_collection[...] = directors
        rod.velocity_collection[...] = 0.0
        rod.omega_collection[...] = 0.0
        self.force[...] = force
        time, step = np.float64(1.0), np.float64(self.time_step)
        for self.steps in range(1, _MAX_STEPS + 1):
            time = self.stepper.step(self.simulator, time, step)
            # A speed v is a way of v/ω still to go. It is looked at now and then, and not at a turning point
            # alone: with this damping there is none.
            if self.steps % 100 == 0:
                left = float(np.max(np.abs(rod.velocity_collection))) / self.frequency
                if not math.isfinite(left):
                    raise RuntimeError(f"PyElastica: the motion is unstable after {self.steps} steps")
                if left <= self.rest * LENGTH:
                    break
        else:
            raise RuntimeError(f"PyElastica: the rod still moves after {_MAX_STEPS} steps")
        return rod.position_collection[:, -1].copy(), (
            rod.position_collection.copy(),
            rod.director_collection.copy(),
        )


def _arc(elements: int, size: float) -> tuple[np.ndarray, np.ndarray]:
    """Positions (3, n + 1) and directors (3, 3, n), as rows, of the free arc, its first element along z."""
    angle = FREE_CURVATURE[1] * size * np.arange(elements)
    zero, one = np.zeros_like(angle), np.ones_like(angle)
    directors = np.stack(
        [
            np.stack([np.cos(angle), zero, -np.sin(angle)]),
            np.stack([zero, one, zero]),
            np.stack([np.sin(angle), zero, np.cos(angle)]),
        ]
    )
    start = np.array([[0.0], [0.0], [-0.5 * size]])
    positions = start + size * np.hstack([np.zeros((3, 1)), np.cumsum(directors[2], axis=1)])
    return positions, directors


def settings() -> list[Setting]:
    """Every setting that is timed."""

    def motion(elements: int, radius: float, rest: float) -> Callable[[], Solver]:
        return lambda: DampedMotion(elements, radius, rest)

    return [
        Setting(
            "PyElastica, damped",
            f"{elements} elements, radius {1e3 * radius:g} mm",
            motion(elements, radius, rest),
        )
        for elements, radius, rest in [
            (8, 4e-3, 1e-4),
            (16, 2e-3, 1e-4),
            (24, 2e-3, 1e-4),
            (32, 1e-3, 1e-5),
            (64, 0.6e-3, 1e-5),
        ]
    ]
