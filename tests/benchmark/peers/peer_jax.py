"""The common problem by this package's differentiable rod in JAX: adaptive steps, compiled."""

from collections.abc import Callable

import jax
import jax.numpy as jnp
import numpy as np

from rodmodel import Adaptive, LinearLaw, Rod, Solution
from tests.benchmark.peers.common_problem import GRAVITY, Setting, Solver, Start
from tests.benchmark.peers.peer_ours import ACTUATOR, CURVATURE_BY_PRESSURE, DOMAIN, PRESSURE, STIFFNESS


class Reference:
    """`Rod.solve` with adaptive steps, from the free shape or from a solution."""

    def __init__(self, solver: Adaptive) -> None:
        law = LinearLaw(jnp.asarray(STIFFNESS), jnp.asarray(CURVATURE_BY_PRESSURE))
        rod = Rod(law, ACTUATOR, DOMAIN, 0.0)
        pressure, gravity = jnp.array([PRESSURE, 0.0, 0.0]), jnp.array([0.0, 0.0, GRAVITY])

        def solve(force: jax.Array, start: Solution | None) -> Solution:
            loads = {"tip_force": force, "gravity": gravity}
            return rod.solve(pressure, **loads, throw=False, start=start, solver=solver)

        self.solve = jax.jit(solve)

    def __call__(self, force: np.ndarray, start: Start | None) -> tuple[np.ndarray, Start]:
        solution = self.solve(force, start)
        if not solution.converged:
            raise RuntimeError(f"Rod.solve: {solution.result}")
        return np.asarray(solution.tip_position), solution


def settings() -> list[Setting]:
    """Every setting that is timed."""

    def reference(solver: Adaptive) -> Callable[[], Solver]:
        return lambda: Reference(solver)

    return [
        Setting("rodmodel in JAX, adaptive", f"tolerance {tolerance:.0e}", reference(Adaptive(tolerance)))
        for tolerance in (1e-4, 1e-6, 1e-8, 1e-10, 1e-12)
    ]
