"""A sum of ridge functions of the curvature: the section law at one pressure."""

import functools
import operator
from dataclasses import replace
from typing import Any, cast, final

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax.custom_derivatives import SymbolicZero
from jaxtyping import Array, Float

from rodmodel._components import Symmetric, Triple, apply, combine, dot, inverse, triple
from rodmodel._kernel import one_kernel
from rodmodel.section._law import PAIRS, TRIPLES, CurvatureLaw, Expansion

# Newton's method for the free curvature: its longest step, in units of the law's curvature scale, and most.
_LONGEST = 0.2
_MOST = 60

_FIRST, _SECOND = np.transpose(PAIRS)
_INDICES = np.transpose(TRIPLES)


@final
class RidgeLaw(CurvatureLaw):
    """Ridge functions on a quadratic.

        Π(u) = E [a + g·x + ½ xᵀ A x + Σ_j c_j φ(d_j·x + b_j)],    x = u/u_s

    with φ = ½ [z/(1 + z²) + arctan z], whose slope is (1 + z²)⁻². E [J/m] and u_s [1/m] are scales that make
    the coefficients numbers near one. φ is bounded, and its slopes cost one division; far from all ridges the
    law is linear, with stiffness A.
    """

    free_curvature: Float[Array, "3"]
    constant: Float[Array, ""]
    slope: Float[Array, "3"]
    quadratic: Float[Array, "3 3"]
    directions: Float[Array, "ridges 3"]
    pairs: Float[Array, "ridges 6"]
    """d_j ⊗ d_j of each ridge, entries as of a stiffness: `expand` is called at every stage along a rod."""
    triples: Float[Array, "ridges 10"]
    """d_j ⊗ d_j ⊗ d_j, the entries of non-decreasing indices."""
    offsets: Float[Array, " ridges"]
    weights: Float[Array, " ridges"]
    energy_scale: float = eqx.field(static=True)
    curvature_scale: float = eqx.field(static=True)

    def energy(self, curvature: Float[Array, "3"]) -> Float[Array, ""]:
        """Potential Π [J/m]."""
        x = curvature / self.curvature_scale
        z = self.directions @ x + self.offsets
        smooth = self.constant + jnp.dot(self.slope + 0.5 * self.quadratic @ x, x)
        return self.energy_scale * (smooth + jnp.dot(self.weights, ridge(z)))

    def moment(self, curvature: Float[Array, "3"]) -> Float[Array, "3"]:
        """Moment ∂Π/∂u [N m]."""
        x = curvature / self.curvature_scale
        ridges = (self.weights * ridge_slope(self.directions @ x + self.offsets)) @ self.directions
        return self.energy_scale / self.curvature_scale * (self.slope + self.quadratic @ x + ridges)

    def stiffness(self, curvature: Float[Array, "3"]) -> Float[Array, "3 3"]:
        """Tangent stiffness ∂²Π/∂u² [N m²]."""
        z = self.directions @ (curvature / self.curvature_scale) + self.offsets
        bend = -4.0 * self.weights * z * (1.0 + z**2) ** -3
        ridges = self.directions.T @ (bend[:, None] * self.directions)
        return self.energy_scale / self.curvature_scale**2 * (self.quadratic + ridges)

    @eqx.filter_jit
    def expand(self, curvature: Triple) -> Expansion:
        """Moment, stiffness and its slope at a curvature [1/m], in scalars.

        With r = 1/(1 + z²): φ' = r², φ'' = −4 z r³, φ''' = (20 − 24 r) r³.
        """
        x = combine((1.0 / self.curvature_scale, curvature))
        lift, bend, jerk = self._slopes(x)
        third = self.energy_scale / self.curvature_scale**3
        slope = weighted_sum(jerk, self.triples)
        moment, stiffness = self._linear_part(x, lift, bend)
        return Expansion(moment, stiffness, tuple(third * slope[n] for n in range(len(TRIPLES))))

    @eqx.filter_jit
    def linearise(self, curvature: Triple) -> tuple[Triple, Symmetric]:
        """Moment and stiffness at a curvature [1/m], in scalars."""
        x = combine((1.0 / self.curvature_scale, curvature))
        lift, bend, _ = self._slopes(x)
        return self._linear_part(x, lift, bend)

    def _linear_part(self, x: Triple, lift: Array, bend: Array) -> tuple[Triple, Symmetric]:
        first = self.energy_scale / self.curvature_scale
        a, b, c, d, e, f = (first / self.curvature_scale * entry for entry in self._tangent(bend))
        return combine((first, self._balance(x, lift))), (a, b, c, d, e, f)

    @eqx.filter_jit
    def _slopes(self, x: Triple) -> tuple[Array, Array, Array]:
        """Of all ridges, c φ', c φ'' and c φ'''."""
        d = self.directions
        z = d[:, 0] * x[0] + d[:, 1] * x[1] + d[:, 2] * x[2] + self.offsets
        r = 1.0 / (1.0 + z * z)
        lift = self.weights * r * r
        cube = lift * r
        return lift, -4.0 * z * cube, (20.0 - 24.0 * r) * cube

    def _balance(self, x: Triple, lift: Float[Array, " ridges"]) -> Triple:
        """Moment over E/u_s."""
        q, ridges = self.quadratic, weighted_sum(lift, self.directions)
        a, b, c = (self.slope[i] + dot(triple(q[i]), x) + ridges[i] for i in range(3))
        return a, b, c

    def _tangent(self, bend: Float[Array, " ridges"]) -> Symmetric:
        """Stiffness over E/u_s²."""
        ridges = weighted_sum(bend, self.pairs)
        a, b, c, d, e, f = (self.quadratic[pair] + ridges[n] for n, pair in enumerate(PAIRS))
        return a, b, c, d, e, f

    def seen_in(self, axes: np.ndarray) -> "RidgeLaw":
        """Law of curvatures u whose components in this law's axes are Q u, Q orthogonal: Π(Q u)."""
        turn = jnp.asarray(axes, self.quadratic.dtype)
        directions = turned_rows(self.directions, turn)
        pairs, triples = powers(directions)
        return replace(
            self,
            free_curvature=self.free_curvature @ turn,
            slope=self.slope @ turn,
            quadratic=turn.T @ self.quadratic @ turn,
            directions=directions,
            pairs=pairs,
            triples=triples,
        )

    def settled(self) -> "RidgeLaw":
        """The same law with the root of its moment near the free curvature that it came with.

        Derivatives follow from the implicit function theorem. Where no root is found, it is not a number.
        """
        return replace(self, free_curvature=self.curvature_scale * _root_of(self))

    def balance(self, x: Float[Array, "3"]) -> Float[Array, "3"]:
        """Moment over E/u_s at x = u/u_s."""
        return jnp.stack(self._balance(triple(x), self._slopes(triple(x))[0]))

    def slopes_by(self, curvature: Triple, change: CurvatureLaw) -> Float[Array, "9"]:
        """See `CurvatureLaw.slopes_by`: of a law of ridges, pressures change the offsets alone."""
        x = combine((1.0 / self.curvature_scale, curvature))
        _, bend, jerk = self._slopes(x)
        first = self.energy_scale / self.curvature_scale
        offsets = cast(RidgeLaw, change).offsets
        moment = first * weighted_sum(bend * offsets, self.directions)
        return jnp.concatenate(
            [moment, first / self.curvature_scale * weighted_sum(jerk * offsets, self.pairs)]
        )

    def _root(self, start: Float[Array, "3"]) -> Float[Array, "3"]:
        """Newton's method for no moment, steps limited; x = u/u_s."""
        # After such a change the next would be a rounding, as it is about the square.
        limit = float(jnp.finfo(start.dtype).eps) ** 0.5

        def unfinished(at: tuple[Array, Array, Array]) -> Array:
            return (jnp.max(jnp.abs(at[1])) > limit) & (at[2] < _MOST)

        def advance(at: tuple[Array, Array, Array]) -> tuple[Array, Array, Array]:
            x = triple(at[0])
            lift, bend, _ = self._slopes(x)
            change = jnp.stack(apply(inverse(self._tangent(bend)), self._balance(x, lift)))
            change = change * jnp.minimum(1.0, _LONGEST / jnp.max(jnp.abs(change)))
            return at[0] - change, change, at[2] + 1

        x, change, _ = jax.lax.while_loop(unfinished, advance, (start, start + jnp.inf, jnp.array(0)))
        return jnp.where(jnp.max(jnp.abs(change)) <= limit, x, jnp.nan)


@jax.custom_jvp
def _root_of(law: RidgeLaw) -> Float[Array, "3"]:
    """Root of the moment near the law's free curvature; x = u/u_s."""
    return one_kernel(RidgeLaw._root, law, law.free_curvature / law.curvature_scale)


def _root_jvp(primals: tuple[RidgeLaw], tangents: tuple[RidgeLaw]) -> tuple[Array, Array]:
    """By the implicit function theorem; what does not change takes no part in it."""
    (law,), (change,) = primals, tangents
    root = _root_of(law)
    leaves, structure = jax.tree.flatten(law)
    dots = jax.tree.leaves(change, is_leaf=lambda x: isinstance(x, SymbolicZero))
    moving = [k for k, dot in enumerate(dots) if not isinstance(dot, SymbolicZero)]

    def balance(parts: list[Array]) -> Array:
        moved = list(leaves)
        for k, part in zip(moving, parts, strict=True):
            moved[k] = part
        return jax.tree.unflatten(structure, moved).balance(root)

    moved = jax.jvp(balance, ([leaves[k] for k in moving],), ([dots[k] for k in moving],))[1]
    flexibility = inverse(law._tangent(law._slopes(triple(root))[1]))
    return root, -jnp.stack(apply(flexibility, triple(moved)))


_root_of.defjvp(_root_jvp, symbolic_zeros=True)


def ridge(z: Any) -> Any:
    """φ of JAX or NumPy arrays."""
    arctan = np.arctan if isinstance(z, np.ndarray) else jnp.arctan
    return 0.5 * (z / (1.0 + z * z) + arctan(z))


def ridge_slope(z: Any) -> Any:
    """φ' of JAX or NumPy arrays."""
    return (1.0 + z * z) ** -2


@jax.jit
def weighted_sum(factors: Float[Array, " ridges"], rows: Float[Array, "ridges n"]) -> Float[Array, " n"]:
    """Sum Σ f_j rows_j.

    By halves: the compiler works on n numbers at a time or more, which it does in no sum of its own, and has
    few operations to compile, here and in what is differentiated. Also for it to be in a kernel under
    `jax.vmap`, where a product of a matrix becomes one of two, which cannot.
    """
    terms = factors[:, None] * rows
    left: list[Array] = []
    while terms.shape[0] > 1:
        half, odd = divmod(terms.shape[0], 2)
        first, second, *last = jax.lax.split(terms, [half, half] + [1] * odd)
        terms, left = first + second, left + last
    return functools.reduce(operator.add, [terms, *left])[0]


def turned_rows(rows: Any, axes: Any) -> Any:
    """Product of many rows and a (3, 3) matrix, NumPy's or JAX's, in sums: so it can be in a kernel."""
    xp: Any = np if isinstance(rows, np.ndarray) else jnp
    columns = [sum(rows[:, i] * axes[i, k] for i in range(3)) for k in range(3)]
    return xp.stack(columns, axis=1)


def powers(directions: Any) -> tuple[Any, Any]:
    """Products of two and of three components of each direction, as a `RidgeLaw` has them."""
    pairs = directions[:, _FIRST] * directions[:, _SECOND]
    return pairs, directions[:, _INDICES[0]] * directions[:, _INDICES[1]] * directions[:, _INDICES[2]]
