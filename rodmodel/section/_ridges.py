"""A sum of ridge functions of the curvature: the section law at one pressure."""

from dataclasses import replace
from typing import final

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from rodmodel._components import Triple, combine
from rodmodel.section._law import PAIRS, TRIPLES, CurvatureLaw, Expansion
from rodmodel.section._turned import INTO_TURNED

# Newton's method for the free curvature, in units of the law's curvature scale: when it has converged, the
# longest step, and how many it may take.
_CONVERGED = 1e-13
_LONGEST = 0.2
_MOST = 60


@final
class RidgeLaw(CurvatureLaw):
    """Ridge functions on a quadratic.

        Π(u) = E [a + g·x + ½ xᵀ A x + Σ_j c_j φ(d_j·x + b_j)],    x = u/u_s,    φ(z) = z/√(1 + z²)

    E [J/m] and u_s [1/m] are scales that make the coefficients numbers near one. φ is bounded and costs a
    square root; far from all ridges the law is linear, with stiffness A.
    """

    free_curvature: Float[Array, "3"]
    constant: Float[Array, ""]
    slope: Float[Array, "3"]
    quadratic: Float[Array, "3 3"]
    directions: Float[Array, "ridges 3"]
    offsets: Float[Array, " ridges"]
    weights: Float[Array, " ridges"]
    energy_scale: float = eqx.field(static=True)
    curvature_scale: float = eqx.field(static=True)

    def energy(self, curvature: Float[Array, "3"]) -> Float[Array, ""]:
        """Potential Π [J/m]."""
        x = curvature / self.curvature_scale
        z = self.directions @ x + self.offsets
        smooth = self.constant + jnp.dot(self.slope + 0.5 * self.quadratic @ x, x)
        return self.energy_scale * (smooth + jnp.dot(self.weights, z / jnp.sqrt(1.0 + z**2)))

    def moment(self, curvature: Float[Array, "3"]) -> Float[Array, "3"]:
        """Moment ∂Π/∂u [N m]."""
        x = curvature / self.curvature_scale
        inverse = 1.0 / jnp.sqrt(1.0 + (self.directions @ x + self.offsets) ** 2)
        ridges = (self.weights * inverse**3) @ self.directions
        return self.energy_scale / self.curvature_scale * (self.slope + self.quadratic @ x + ridges)

    def stiffness(self, curvature: Float[Array, "3"]) -> Float[Array, "3 3"]:
        """Tangent stiffness ∂²Π/∂u² [N m²]."""
        z = self.directions @ (curvature / self.curvature_scale) + self.offsets
        bend = -3.0 * self.weights * z * (1.0 + z**2) ** -2.5
        ridges = self.directions.T @ (bend[:, None] * self.directions)
        return self.energy_scale / self.curvature_scale**2 * (self.quadratic + ridges)

    @eqx.filter_jit
    def expand(self, curvature: Triple) -> Expansion:
        """Moment, stiffness and its slope at a curvature [1/m], in scalars.

        With r = (1 + z²)^−½: φ' = r³, φ'' = −3 z r⁵, φ''' = r⁵ (15 z² r² − 3).
        """
        x = combine((1.0 / self.curvature_scale, curvature))
        d = tuple(self.directions[:, axis] for axis in range(3))
        z = d[0] * x[0] + d[1] * x[1] + d[2] * x[2] + self.offsets
        square = 1.0 / (1.0 + z * z)
        cube = self.weights * square * jnp.sqrt(square)
        bend = -3.0 * z * square * cube
        jerk = square * cube * (15.0 * z * z * square - 3.0)
        # Sums, which the compiler fuses into one kernel as it does no matrix product.
        q, (a, b, c) = self.quadratic, x
        first = self.energy_scale / self.curvature_scale
        second, third = first / self.curvature_scale, first / self.curvature_scale**2
        moment = tuple(
            first * (self.slope[i] + q[i, 0] * a + q[i, 1] * b + q[i, 2] * c + jnp.sum(cube * d[i]))
            for i in range(3)
        )
        k11, k12, k13, k22, k23, k33 = (second * (q[i, j] + jnp.sum(bend * d[i] * d[j])) for i, j in PAIRS)
        slope = tuple(third * jnp.sum(jerk * d[i] * d[j] * d[k]) for i, j, k in TRIPLES)
        return Expansion((moment[0], moment[1], moment[2]), (k11, k12, k13, k22, k23, k33), slope)

    def turned(self, turns: int) -> "RidgeLaw":
        """Law of the same section seen from axes turned by −120° · `turns` about its own."""
        turn = jnp.asarray(INTO_TURNED[turns], self.quadratic.dtype)
        return replace(
            self,
            free_curvature=self.free_curvature @ turn,
            slope=self.slope @ turn,
            quadratic=turn.T @ self.quadratic @ turn,
            directions=self.directions @ turn,
        )

    def settled(self) -> "RidgeLaw":
        """The same law with the root of its moment near the free curvature that it came with.

        Derivatives follow from the implicit function theorem. Where no root is found, it is not a number.
        """

        def imbalance(x: Array) -> Array:
            return self.moment(x * self.curvature_scale) * (self.curvature_scale / self.energy_scale)

        def step(x: Array) -> Array:
            stiffness = self.stiffness(x * self.curvature_scale)
            return _solve(stiffness * (self.curvature_scale**2 / self.energy_scale), imbalance(x))

        def newton(_: object, start: Array) -> Array:
            def unfinished(at: tuple[Array, Array, Array]) -> Array:
                return (jnp.max(jnp.abs(at[1])) > _CONVERGED) & (at[2] < _MOST)

            def advance(at: tuple[Array, Array, Array]) -> tuple[Array, Array, Array]:
                change = step(at[0])
                change = change * jnp.minimum(1.0, _LONGEST / jnp.max(jnp.abs(change)))
                return at[0] - change, change, at[2] + 1

            x, change, _ = jax.lax.while_loop(unfinished, advance, (start, start + jnp.inf, jnp.array(0)))
            limit = jnp.sqrt(jnp.asarray(jnp.finfo(start.dtype).eps, start.dtype))
            return jnp.where(jnp.max(jnp.abs(change)) <= limit, x, jnp.nan)

        start = self.free_curvature / self.curvature_scale
        root = jax.lax.custom_root(
            imbalance, start, newton, lambda linear, right: _solve(jax.jacobian(linear)(0.0 * start), right)
        )
        return replace(self, free_curvature=root * self.curvature_scale)


def _solve(matrix: Float[Array, "3 3"], right: Float[Array, "3"]) -> Float[Array, "3"]:
    """By Cramer's rule, which the compiler fuses as it does no factorisation."""
    a, b, c = (matrix[:, axis] for axis in range(3))
    scale = 1.0 / jnp.dot(a, jnp.cross(b, c))
    return scale * jnp.stack(
        [
            jnp.dot(right, jnp.cross(b, c)),
            jnp.dot(a, jnp.cross(right, c)),
            jnp.dot(a, jnp.cross(b, right)),
        ]
    )
