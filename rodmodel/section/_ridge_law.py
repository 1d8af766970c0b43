"""The ridge network at one pressure: a quadratic of the curvature and a sum of ridge functions."""

from dataclasses import replace
from typing import final

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from rodmodel.actuator import Number
from rodmodel.section._law import CurvatureLaw
from rodmodel.section._solve_3x3 import solve_3x3

# Longest first Newton step for the free curvature, over the law's curvature scale.
_LONGEST = 0.2
# Least shift of a stiffness that is not positive, over the size of its diagonal.
_SHIFTED = 1e-6
# Largest number of these steps.
_MOST = 100


@final
class RidgeLaw(CurvatureLaw):
    """Quadratic of the curvature with a sum of ridge functions.

        Π(u) = E [a + g·x + ½ xᵀ A x + Σ_j c_j φ(d_j·x + b_j)],    x = u/u_s

    with φ = ½ [z/(1 + z²) + arctan z], whose slope is (1 + z²)⁻². The scales E [J/m] and u_s [1/m] bring the
    coefficients near one. φ is bounded, and its derivatives need a single division; far from all ridges the
    law is linear, with stiffness A.
    """

    free_curvature: Float[Array, "3"]
    constant: Float[Array, ""]
    slope: Float[Array, "3"]
    quadratic: Float[Array, "3 3"]
    directions: Float[Array, "ridges 3"]
    offsets: Float[Array, " ridges"]
    weights: Float[Array, " ridges"]
    energy_scale: Number
    curvature_scale: Number

    def energy(self, curvature: Float[Array, "3"]) -> Float[Array, ""]:
        """Return the potential Π [J/m]."""
        x = curvature / self.curvature_scale
        smooth = self.constant + (self.slope + 0.5 * self.quadratic @ x) @ x
        return self.energy_scale * (smooth + self.weights @ ridge(self.directions @ x + self.offsets))

    def moment(self, curvature: Float[Array, "3"]) -> Float[Array, "3"]:
        """Return the moment ∂Π/∂u [N m]."""
        x = curvature / self.curvature_scale
        ridges = (self.weights * ridge_slope(self.directions @ x + self.offsets)) @ self.directions
        return self.energy_scale / self.curvature_scale * (self.slope + self.quadratic @ x + ridges)

    def stiffness(self, curvature: Float[Array, "3"]) -> Float[Array, "3 3"]:
        """Return the tangent stiffness ∂²Π/∂u² [N m²]."""
        z = self.directions @ (curvature / self.curvature_scale) + self.offsets
        bend = -4.0 * self.weights * z * (1.0 + z**2) ** -3
        ridges = self.directions.T @ (bend[:, None] * self.directions)
        return self.energy_scale / self.curvature_scale**2 * (self.quadratic + ridges)

    def settled(self) -> "RidgeLaw":
        """Return the law with its free curvature, the root of the moment near the present guess.

        Derivatives follow from the implicit function theorem. If no root is found, it is NaN.
        """
        return replace(self, free_curvature=_root(self))


@jax.custom_jvp
def _root(law: RidgeLaw) -> Float[Array, "3"]:
    """Find the root of the moment near the law's free curvature, by Newton's method with limited steps.

    From where the section would give way it goes down in energy, to one of the roots beside. The limit is
    halved when a step turns back, as steps over a soft stretch could go to and fro for ever.
    """
    # Newton's method converges quadratically: after a change of this size the next would be a rounding.
    limit = jnp.finfo(law.free_curvature.dtype).eps ** 0.5 * law.curvature_scale

    def unfinished(at: tuple[Array, Array, Array, Array]) -> Array:
        return (at[3] == 0) | (jnp.max(jnp.abs(at[1])) > limit) & (at[3] < _MOST)

    def advance(at: tuple[Array, Array, Array, Array]) -> tuple[Array, Array, Array, Array]:
        u, before, most, count = at
        change = solve_3x3(_descending(law.stiffness(u)), law.moment(u))
        most = jnp.where(change @ before < 0.0, 0.5 * most, most)
        change = change * jnp.minimum(1.0, most / jnp.max(jnp.abs(change)))
        return u - change, change, most, count + 1

    start = law.free_curvature
    longest = jnp.asarray(_LONGEST * law.curvature_scale, start.dtype)
    begin = (start, jnp.zeros_like(start), longest, jnp.zeros((), int))
    u, change, _, _ = jax.lax.while_loop(unfinished, advance, begin)
    return jnp.where(jnp.max(jnp.abs(change)) <= limit, u, jnp.nan)


def _descending(stiffness: Float[Array, "3 3"]) -> Float[Array, "3 3"]:
    """Return the stiffness, shifted where it is not positive so far that its least eigenvalue changes sign.

    A larger shift makes small steps beside a saddle.
    """
    a, b, c = stiffness
    positive = (a[0] > 0.0) & (a[0] * b[1] > a[1] * b[0]) & (a @ jnp.cross(b, c) > 0.0)
    least = _SHIFTED * jnp.sum(jnp.abs(jnp.diagonal(stiffness)))
    shift = jnp.maximum(-2.0 * _least_eigenvalue(stiffness), least)
    return stiffness + jnp.where(positive, 0.0, shift) * jnp.eye(3, dtype=stiffness.dtype)


def _least_eigenvalue(matrix: Float[Array, "3 3"]) -> Float[Array, ""]:
    """Return the least eigenvalue, the trigonometric root of the characteristic polynomial."""
    mean = jnp.trace(matrix) / 3.0
    a, b, c = matrix - mean * jnp.eye(3, dtype=matrix.dtype)
    half = (a @ a + b @ b + c @ c) / 6.0
    radius, cosine = jnp.sqrt(half), 0.5 * (a @ jnp.cross(b, c))
    sine = jnp.sqrt(jnp.maximum((half * radius) ** 2 - cosine**2, 0.0))
    return mean + 2.0 * radius * jnp.cos((jnp.arctan2(sine, cosine) + 2.0 * jnp.pi) / 3.0)


@_root.defjvp
def _root_jvp(primals: tuple[RidgeLaw], tangents: tuple[RidgeLaw]) -> tuple[Array, Array]:
    """Return the root and its tangent δu, with K δu = −δm."""
    root = _root(*primals)
    moment_dot = jax.jvp(lambda law: law.moment(root), primals, tangents)[1]
    return root, -solve_3x3(primals[0].stiffness(root), moment_dot)


def ridge(z: Float[Array, "*n"]) -> Float[Array, "*n"]:
    """Evaluate the ridge function φ."""
    return 0.5 * (z / (1.0 + z * z) + jnp.arctan(z))


def ridge_slope(z: Float[Array, "*n"]) -> Float[Array, "*n"]:
    """Evaluate the slope φ' of the ridge function."""
    return (1.0 + z * z) ** -2
