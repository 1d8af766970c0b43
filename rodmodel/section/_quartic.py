"""A quartic polynomial of the curvature about the free state: the section law at one pressure."""

import itertools
from dataclasses import replace
from typing import final

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from rodmodel._components import Triple, apply, combine, contract, triple
from rodmodel.section._law import PAIRS, TRIPLES, CurvatureLaw, Expansion
from rodmodel.section._turned import INTO_TURNED

_AXES = range(3)
_QUADRUPLE_ROWS = tuple(
    tuple(tuple(sorted((*indices, axis))) for axis in _AXES) for indices in TRIPLES
)  # those of a triple and each axis


@final
class QuarticLaw(CurvatureLaw):
    """Quartic polynomial without a linear term, so that its moment vanishes exactly at the free curvature.

        Π(u) = E [a + ½ wᵀ K w + C₃[w, w, w] + C₄[w, w, w, w]],    w = (u − û)/u_s

    The tensors are symmetric in all their indices. E [J/m] and u_s [1/m] are scales that make the
    coefficients numbers near one.
    """

    constant: Float[Array, ""]
    free_curvature: Float[Array, "3"]
    quadratic: Float[Array, "3 3"]
    cubic: Float[Array, "3 3 3"]
    quartic: Float[Array, "3 3 3 3"]
    energy_scale: float = eqx.field(static=True)
    curvature_scale: float = eqx.field(static=True)

    def energy(self, curvature: Float[Array, "3"]) -> Float[Array, ""]:
        """Potential Π [J/m]."""
        w = self._distance(curvature)
        form = 0.5 * self.quadratic + _contract(self.cubic + _contract(self.quartic, w), w)
        return self.energy_scale * (self.constant + _contract(_contract(form, w), w))

    def moment(self, curvature: Float[Array, "3"]) -> Float[Array, "3"]:
        """Moment E/u_s (K + 3 C₃·w + 4 C₄·w·w) w [N m]."""
        w = self._distance(curvature)
        secant = self.quadratic + _contract(3.0 * self.cubic + 4.0 * _contract(self.quartic, w), w)
        return self.energy_scale / self.curvature_scale * _contract(secant, w)

    def stiffness(self, curvature: Float[Array, "3"]) -> Float[Array, "3 3"]:
        """Tangent stiffness E/u_s² (K + 6 C₃·w + 12 C₄·w·w) [N m²]."""
        w = self._distance(curvature)
        tangent = self.quadratic + _contract(6.0 * self.cubic + 12.0 * _contract(self.quartic, w), w)
        return self.energy_scale / self.curvature_scale**2 * tangent

    @eqx.filter_jit
    def expand(self, curvature: Triple) -> Expansion:
        """Moment, stiffness and its slope at a curvature [1/m], in scalars.

        With B = C₄·w, D = B·w and E = C₃·w: m = (K + 3E + 4D) w, ∂m/∂w = K + 6E + 12D, its slope 6C₃ + 24B.
        """
        distance = combine((1.0, curvature), (-1.0, triple(self.free_curvature)))
        w = combine((1.0 / self.curvature_scale, distance))
        cubic = tuple(self.cubic[indices] for indices in TRIPLES)
        b = tuple(
            self.quartic[i] * w[0] + self.quartic[j] * w[1] + self.quartic[k] * w[2]
            for i, j, k in _QUADRUPLE_ROWS
        )
        quadratic = tuple(self.quadratic[indices] for indices in PAIRS)
        d, e = (contract(b, w), contract(cubic, w))
        secant = tuple(k + 3.0 * x + 4.0 * y for k, x, y in zip(quadratic, e, d, strict=True))
        tangent = tuple(k + 6.0 * x + 12.0 * y for k, x, y in zip(quadratic, e, d, strict=True))
        slope = tuple(6.0 * x + 24.0 * y for x, y in zip(cubic, b, strict=True))
        first = self.energy_scale / self.curvature_scale
        second, third = first / self.curvature_scale, first / self.curvature_scale**2
        return Expansion(
            combine((first, apply(secant, w))),
            tuple(second * x for x in tangent),
            tuple(third * x for x in slope),
        )

    def turned(self, turns: int) -> "QuarticLaw":
        """Law of the same section seen from axes turned by −120° · `turns` about its own."""
        turn = jnp.asarray(INTO_TURNED[turns], self.quadratic.dtype)
        return replace(
            self,
            free_curvature=_turn(self.free_curvature, turn),
            quadratic=_turn(self.quadratic, turn),
            cubic=_turn(self.cubic, turn),
            quartic=_turn(self.quartic, turn),
        )

    def _distance(self, curvature: Float[Array, "3"]) -> Float[Array, "3"]:
        return (curvature - self.free_curvature) / self.curvature_scale


def _contract(tensor: Float[Array, "*n 3"], w: Float[Array, "3"]) -> Float[Array, "*n"]:
    """Contract the last axis with w; as a sum, which the compiler fuses as it does no matrix product."""
    return jnp.sum(tensor * w.reshape((1,) * (tensor.ndim - 1) + (3,)), axis=-1)


def _turn(tensor: Float[Array, "..."], turn: Float[Array, "3 3"]) -> Float[Array, "..."]:
    """Product of every axis of a tensor with the transpose of a matrix."""
    for axis in range(tensor.ndim):
        tensor = jnp.moveaxis(jnp.tensordot(tensor, turn, axes=(axis, 0)), -1, axis)
    return tensor


def symmetric_tensor(entries: Float[Array, " n"], indices: tuple[tuple[int, ...], ...]) -> Array:
    """Symmetric tensor from its independent entries.

    Parameters
    ----------
    entries : the tensor's entries at `indices`.
    indices : all non-decreasing index tuples of one length: `PAIRS`, `TRIPLES` or `QUADRUPLES`.

    Returns
    -------
    tensor : of shape (3, …, 3), one axis for each index of a tuple.
    """
    position = {index: n for n, index in enumerate(indices)}
    order = len(indices[0])
    where = [position[tuple(sorted(index))] for index in itertools.product(_AXES, repeat=order)]
    return entries[np.array(where)].reshape((3,) * order)
