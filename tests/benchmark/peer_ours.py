"""The common problem by this package: every setting of its solvers."""

from collections.abc import Callable

import jax
import jax.numpy as jnp
import numpy as np

from rodmodel import Actuator, Adaptive, Domain, FixedStep, LinearLaw, Rod, Solution
from tests.benchmark.common_problem import (
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


def rod() -> Rod:
    """Rod of the problem: linear law, no cap, each chamber bends it to its own side."""
    azimuth = 2.0 * np.pi / 3.0 * np.arange(3)
    sides = np.stack([np.sin(azimuth), -np.cos(azimuth), np.zeros(3)])
    law = LinearLaw(
        section_stiffness=jnp.diag(jnp.array([BENDING_STIFFNESS, BENDING_STIFFNESS, TORSION_STIFFNESS])),
        curvature_by_pressure=jnp.asarray(sides * abs(FREE_CURVATURE[1]) / PRESSURE),
    )
    actuator = Actuator(
        body_length=LENGTH,
        cap_length=0.0,
        body_diameter=0.012,
        mass_per_length=WEIGHT / (GRAVITY * LENGTH),
        cap_mass=0.0,
    )
    return Rod(law, actuator, Domain((1e5, 1e5, 1e5), 3e5, 1.0), 0.0)


class Control:
    """`Predictor`, as a control loop uses it: fixed steps, from the free shape or from its last solution."""

    def __init__(self, solver: FixedStep) -> None:
        self.pressure, self.gravity = np.array([PRESSURE, 0.0, 0.0]), np.array([0.0, 0.0, GRAVITY])
        # Two, so that the one that starts warm has seen no other than the neighbouring force.
        self.cold, self.warm = (rod().predictor(("tip_force", "gravity"), solver=solver) for _ in range(2))

    def __call__(self, force: np.ndarray, start: Start | None) -> tuple[np.ndarray, Start]:
        if start is None:
            self.cold.reset()
        predictor = self.cold if start is None else self.warm
        prediction = predictor(self.pressure, tip_force=force, gravity=self.gravity)
        if not prediction.converged:
            raise RuntimeError("Predictor: not converged")
        return prediction.tip_position, prediction


class Reference:
    """`Rod.solve` with adaptive steps, from the free shape or from a solution."""

    def __init__(self, solver: Adaptive) -> None:
        problem = rod()
        pressure, gravity = jnp.array([PRESSURE, 0.0, 0.0]), jnp.array([0.0, 0.0, GRAVITY])

        def solve(force: jax.Array, start: Solution | None) -> Solution:
            loads = {"tip_force": force, "gravity": gravity}
            return problem.solve(pressure, **loads, throw=False, start=start, solver=solver)

        self.solve = jax.jit(solve)

    def __call__(self, force: np.ndarray, start: Start | None) -> tuple[np.ndarray, Start]:
        solution = self.solve(force, start)
        if not solution.converged:
            raise RuntimeError(f"Rod.solve: {solution.result}")
        return np.asarray(solution.tip_position), solution


def settings() -> list[Setting]:
    """Every setting that is timed."""

    def control(solver: FixedStep) -> Callable[[], Solver]:
        return lambda: Control(solver)

    def reference(solver: Adaptive) -> Callable[[], Solver]:
        return lambda: Reference(solver)

    made = [
        Setting("rodmodel, fixed steps", f"{steps} steps", control(FixedStep(steps, tolerance)))
        for steps, tolerance in ((3, 1e-5), (4, 1e-5), (6, 1e-6), (8, 1e-7), (16, 1e-8), (32, 1e-9))
    ]
    made += [
        Setting("rodmodel, adaptive", f"tolerance {tolerance:.0e}", reference(Adaptive(tolerance)))
        for tolerance in (1e-4, 1e-6, 1e-8, 1e-10, 1e-12)
    ]
    return made
