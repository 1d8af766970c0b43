"""The common problem by soromox: geometric variable strain, Newton on its own forces and its own Jacobian.

A segment with bending and twist as Legendre polynomials of the arc length; stretch and shear are left out, as
in the problem. With q the coefficients, soromox gives the elastic and the gravitational force and, at the
tip, the geometric Jacobian J of the position; equilibrium is

    f(q) = f_elastic(q) + f_gravity(q) − Jᵀ F = 0

Newton's method on it, with ∂f/∂q by forward differentiation of soromox' own code, is compiled whole.
"""

import math
from collections.abc import Callable

import jax
import jax.numpy as jnp
import numpy as np
from soromox.systems.components import JointSpec, LinkSpec
from soromox.systems.gvs import GVS, GVSSegment, StrainBasisSpec

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

# A solid round section of any radius has the problem's stiffnesses with these moduli and this density.
_RADIUS = 5e-3
_AREA = math.pi * _RADIUS**2
_SECOND_MOMENT = 0.25 * math.pi * _RADIUS**4

_MAX_ITERATIONS = 30
# Of the last correction of q, which is a curvature [1/m] near 30. Newton's method is quadratic: what is left
# then is below 1e-5.
_TOLERANCE = 1e-2


def _robot(order: int, gauss_points: int) -> GVS:
    """Rod along its own x, which the base turns to the world's +z."""
    link = LinkSpec.circular(
        length=LENGTH,
        radius=_RADIUS,
        density=WEIGHT / (GRAVITY * _AREA * LENGTH),
        young_modulus=BENDING_STIFFNESS / _SECOND_MOMENT,
        shear_modulus=TORSION_STIFFNESS / (2.0 * _SECOND_MOMENT),
        reference_strain=[0.0, float(FREE_CURVATURE[1]), 0.0, 1.0, 0.0, 0.0],
    )
    basis = StrainBasisSpec("legendre", ("kappa_x", "kappa_y", "kappa_z"), order)
    segment = GVSSegment(link, JointSpec("fixed"), basis, gauss_points)
    half = math.sqrt(0.5)
    return GVS.from_segments(
        [segment],
        gravity=jnp.array([0.0, 0.0, GRAVITY]),
        # A turn by −90° about y, scalar last, takes x to z and leaves y.
        base_pose=jnp.array([0.0, -half, 0.0, half, 0.0, 0.0, 0.0]),
    )


class StrainNewton:
    """Newton's method for the coefficients of the strain."""

    def __init__(self, order: int, gauss_points: int) -> None:
        robot = _robot(order, gauss_points)
        self.free = jnp.zeros(robot.num_coordinates)
        tip = jnp.asarray(LENGTH)

        def force(q: jax.Array, tip_force: jax.Array) -> jax.Array:
            # Angular rows first.
            pull = robot.jacobian(q, tip)[3:].T @ tip_force
            return robot.elastic_force(q) + robot.gravitational_force(q) - pull

        def solve(q: jax.Array, tip_force: jax.Array) -> tuple[jax.Array, jax.Array, jax.Array]:
            def advance(state: tuple[jax.Array, jax.Array, jax.Array]) -> tuple[jax.Array, ...]:
                q, _, n = state
                correction = jnp.linalg.solve(jax.jacfwd(force)(q, tip_force), -force(q, tip_force))
                return q + correction, jnp.max(jnp.abs(correction)), n + 1

            def unfinished(state: tuple[jax.Array, jax.Array, jax.Array]) -> jax.Array:
                return (state[1] > _TOLERANCE) & (state[2] < _MAX_ITERATIONS)

            start = (q, jnp.asarray(jnp.inf), jnp.asarray(0))
            q, correction, _ = jax.lax.while_loop(unfinished, advance, start)
            return robot.forward_kinematics(q, tip)[:3, 3], q, correction

        self.solve = jax.jit(solve)

    def __call__(self, force: np.ndarray, start: Start | None) -> tuple[np.ndarray, Start]:
        position, q, correction = self.solve(self.free if start is None else start, force)
        if not correction <= _TOLERANCE:
            raise RuntimeError(f"Newton's method stopped with a correction of {correction}")
        return np.asarray(position), q


def settings() -> list[Setting]:
    """Every setting that is timed."""

    def newton(order: int, gauss_points: int) -> Callable[[], Solver]:
        return lambda: StrainNewton(order, gauss_points)

    return [
        Setting("soromox GVS + Newton", f"order {order}, {points} Gauss points", newton(order, points))
        for order, points in [(1, 5), (2, 5), (3, 5), (3, 7), (4, 7), (5, 9), (6, 12)]
    ]
