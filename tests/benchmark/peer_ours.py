"""The common problem by this package: every setting of its solvers."""

from collections.abc import Callable
from functools import partial
from typing import final

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from rodmodel import Actuator, CurvatureLaw, SectionLaw
from rodmodel._equilibrium import Equilibrium, Loads
from rodmodel._shooting import shoot
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

ACTUATOR = Actuator(
    body_length=LENGTH,
    cap_length=0.0,
    body_diameter=0.012,
    mass_per_length=WEIGHT / (GRAVITY * LENGTH),
    cap_mass=0.0,
)
PRESSURE = 30e3
"""Of chamber 1, at which the law below has the problem's intrinsic curvature [Pa]."""

_STIFFNESS = np.array([BENDING_STIFFNESS, BENDING_STIFFNESS, TORSION_STIFFNESS])


@final
class LinearCurvatureLaw(CurvatureLaw):
    """Π = ½ (u − û)ᵀ K (u − û) with K = diag(EI, EI, GJ)."""

    free_curvature: Float[Array, "3"]

    def energy(self, curvature: Float[Array, "3"]) -> Float[Array, ""]:
        """Potential Π [J/m]."""
        return 0.5 * jnp.sum(_STIFFNESS.astype(curvature.dtype) * (curvature - self.free_curvature) ** 2)

    def moment(self, curvature: Float[Array, "3"]) -> Float[Array, "3"]:
        """Moment K (u − û) [N m]."""
        return _STIFFNESS.astype(curvature.dtype) * (curvature - self.free_curvature)

    def stiffness(self, curvature: Float[Array, "3"]) -> Float[Array, "3 3"]:
        """Tangent stiffness K [N m²]."""
        return jnp.diag(jnp.asarray(_STIFFNESS, curvature.dtype))


@final
class LinearLaw(SectionLaw):
    """Intrinsic curvature in proportion to pressure, each chamber to its side."""

    def at(self, pressure: Float[Array, "3"]) -> LinearCurvatureLaw:
        """Contract the law to a function of the curvature."""
        azimuth = 2.0 * np.pi / 3.0 * np.arange(3)
        each = np.stack([np.sin(azimuth), -np.cos(azimuth), np.zeros(3)]) * abs(FREE_CURVATURE[1]) / PRESSURE
        return LinearCurvatureLaw(jnp.asarray(each, pressure.dtype) @ pressure)


class Adaptive:
    """Adaptive integration and shooting from the free shape; it takes no start."""

    def __init__(self, tolerance: float) -> None:
        law = LinearLaw()

        @partial(jax.jit)
        def solve(pressure: Array, force: Array) -> Array:
            loads = Loads(tip_force=force, tip_moment=None, gravity=jnp.array([0.0, 0.0, GRAVITY]))
            shot = shoot(Equilibrium(law.at(pressure), loads, ACTUATOR), tolerance)
            return jnp.where(shot.load_fraction == 1.0, LENGTH * shot.states[-1, :3], jnp.nan)

        self.solve = solve
        self.pressure = np.array([PRESSURE, 0.0, 0.0])

    def __call__(self, force: np.ndarray, start: Start | None) -> tuple[np.ndarray, Start]:
        return np.asarray(self.solve(self.pressure, force)), None


def settings() -> list[Setting]:
    """Every setting that is timed."""

    def adaptive(tolerance: float) -> Callable[[], Solver]:
        return lambda: Adaptive(tolerance)

    return [
        Setting("rodmodel, diffrax", f"tolerance {tolerance:.0e}", adaptive(tolerance))
        for tolerance in (1e-3, 1e-4, 1e-6, 1e-8, 1e-10, 1e-12)
    ]
