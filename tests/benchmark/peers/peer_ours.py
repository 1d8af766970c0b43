"""The common problem by the compiled rod, as a control loop calls it, at every setting."""

from collections.abc import Callable

import numpy as np

from rodmodel import Actuator, CoreRod, Domain
from tests.benchmark.peers.common_problem import (
    BENDING_STIFFNESS,
    FREE_CURVATURE,
    GRAVITY,
    LENGTH,
    TORSION_STIFFNESS,
    WEIGHT,
    Setting,
    Solver,
    Start,
)

PRESSURE = 30e3
"""Of chamber 1, at which the rod below has the problem's intrinsic curvature [Pa]."""

_AZIMUTH = 2.0 * np.pi / 3.0 * np.arange(3)
STIFFNESS = np.diag([BENDING_STIFFNESS, BENDING_STIFFNESS, TORSION_STIFFNESS])
#: Each chamber bends the rod to its own side.
CURVATURE_BY_PRESSURE = (
    np.stack([np.sin(_AZIMUTH), -np.cos(_AZIMUTH), np.zeros(3)]) * abs(FREE_CURVATURE[1]) / PRESSURE
)
ACTUATOR = Actuator(
    body_length=LENGTH,
    cap_length=0.0,
    body_diameter=0.012,
    mass_per_length=WEIGHT / (GRAVITY * LENGTH),
    cap_mass=0.0,
)
DOMAIN = Domain((1e5, 1e5, 1e5), 3e5, 1.0)
#: Steps along the rod, and Newton's tolerance [rad], below what they leave.
_SETTINGS = (
    (3, 1e-5),
    (4, 1e-5),
    (6, 1e-6),
    (7, 1e-6),
    (8, 1e-7),
    (12, 1e-7),
    (16, 1e-8),
    (24, 1e-8),
    (32, 1e-9),
    (40, 1e-9),
    (64, 1e-10),
    (128, 1e-11),
)


class Control:
    """`Predictor`, as a control loop uses it: fixed steps, from the free shape or from its last solution."""

    def __init__(self, steps: int, tolerance: float) -> None:
        rod = CoreRod.linear(STIFFNESS, CURVATURE_BY_PRESSURE, ACTUATOR, DOMAIN)
        self.pressure, self.gravity = np.array([PRESSURE, 0.0, 0.0]), np.array([0.0, 0.0, GRAVITY])
        # Two, so that the one that starts warm has seen no other than the neighbouring force.
        self.cold, self.warm = (
            rod.predictor(("tip_force", "gravity"), steps=steps, tolerance=tolerance) for _ in range(2)
        )

    def __call__(self, force: np.ndarray, start: Start | None) -> tuple[np.ndarray, Start]:
        if start is None:
            self.cold.reset()
        predictor = self.cold if start is None else self.warm
        prediction = predictor(self.pressure, tip_force=force, gravity=self.gravity)
        if not prediction.converged:
            raise RuntimeError("Predictor: not converged")
        return prediction.tip_position, prediction


def settings() -> list[Setting]:
    """Every setting that is timed."""

    def control(steps: int, tolerance: float) -> Callable[[], Solver]:
        return lambda: Control(steps, tolerance)

    return [
        Setting("rodmodel", f"{steps} steps", control(steps, tolerance)) for steps, tolerance in _SETTINGS
    ]
