"""A quartic polynomial of the curvature about the free state: the section law at one pressure."""

import itertools
from typing import final

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from rodmodel.section._law import CurvatureLaw

_AXES = range(3)
PAIRS, TRIPLES, QUADRUPLES = (tuple(itertools.combinations_with_replacement(_AXES, n)) for n in (2, 3, 4))


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

    def _distance(self, curvature: Float[Array, "3"]) -> Float[Array, "3"]:
        return (curvature - self.free_curvature) / self.curvature_scale


def _contract(tensor: Float[Array, "*n 3"], w: Float[Array, "3"]) -> Float[Array, "*n"]:
    """Contract the last axis with w; as a sum, which the compiler fuses as it does no matrix product."""
    return jnp.sum(tensor * w.reshape((1,) * (tensor.ndim - 1) + (3,)), axis=-1)


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
