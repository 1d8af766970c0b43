"""Compiled loops over the Gauss points of some hexahedra: forces, tangents and dilatations.

Stress and tangent are evaluated in the principal frame at each point and integrated there, with the shape
functions' gradients turned into it: the tangent is never turned back. Only its blocks of directions i ≤ k are
integrated, as it is symmetric. Components come first and elements last, so that the innermost loops, over
elements, are vectorised. See `solid` for the mechanics. Lengths mm, stresses MPa.
"""

from typing import NamedTuple

import jax
import jax.numpy as jnp
from jax import Array
from jaxtyping import ArrayLike, Float

from fem_reference.elements.ogden import (
    BLOCKS,
    DyadModuli,
    Moduli,
    dot,
    half_turned,
    isochoric_energy,
    isochoric_response,
    isochoric_stress,
    pressure_moduli,
    principal,
    stored,
)

# Up to here a sum over points that is written out, vectorised over elements, takes half as long as a product
# of matrices; with the 27 nodes of a quadratic element it takes twice as long.
_FEW_NODES = 8


class ElementChunk(NamedTuple):
    """Elements at rest: ∂N_a/∂X_J at every Gauss point, weights, pressure modes and volumes."""

    gradients: Float[Array, "nodes 3 points elements"]
    weights: Float[Array, "points elements"]
    modes: Float[Array, "modes points elements"]
    volume: Float[Array, " elements"]


def response(
    chunk: ElementChunk,
    moduli: Moduli,
    bulk_modulus: Array,
    local: Float[ArrayLike, "nodes 3 elements"],
    pressure: Float[ArrayLike, "modes elements"] | None,
) -> tuple[
    Float[Array, "nodes 3 elements"],
    Float[Array, "modes nodes 3 elements"],
    Float[Array, "nodes 3 nodes 3 elements"],
    Float[Array, "modes elements"],
]:
    """Forces, V_e ∂ϑ_j/∂x, stiffness with the pressures condensed, and κ ϑ_j.

    Parameters
    ----------
    chunk, moduli, bulk_modulus : the elements and their material.
    local : positions of each element's nodes.
    pressure : π_j of the tangent's geometric part; κ ϑ_j where none is given.
    """
    at_points = _at_points(chunk, moduli, bulk_modulus, local, pressure)
    force, volume_gradient, turned, tangent, constitutive = at_points
    blocks = _integrated(turned, tangent)
    return force, volume_gradient, _condensed(chunk, bulk_modulus, volume_gradient, blocks), constitutive


# Compiled apart, here and below: in one piece XLA works out anew, for every use, what the next one reads.
@jax.jit
def _at_points(
    chunk: ElementChunk, moduli: Moduli, bulk_modulus: Array, local: Array, pressure: Array | None
) -> tuple[
    Float[Array, "nodes 3 elements"],
    Float[Array, "modes nodes 3 elements"],
    Float[Array, "3 nodes points elements"],
    Float[Array, "6 3 3 points elements"],
    Float[Array, "modes elements"],
]:
    """Forces, V_e ∂ϑ_j/∂x, gradients and weighted tangent in the principal frame at each point, and κ ϑ_j."""
    F = stored(_deformation_gradient(chunk, local))
    at, growth = stored((principal(F), _growth(F)))
    constitutive = bulk_modulus * _mean(chunk, growth)
    stress, dyads = isochoric_response(moduli, at)
    kept = constitutive if pressure is None else pressure
    volumetric = pressure_moduli(at, 1.0 + growth, (chunk.modes * kept[:, None]).sum(axis=0))
    alone, across, crossed = dyads.alone, dyads.across + volumetric, dyads.crossed - volumetric
    dyads = stored(DyadModuli(*(chunk.weights * part for part in (alone, across, crossed))))
    tangent = half_turned(dyads, at.after)
    turned = stored(_turned(chunk, at.before))
    cofactor = (1.0 + growth) / at.stretch
    volume_gradient = stored(
        jnp.stack([_pull(turned, at.after * (chunk.weights * mode * cofactor)) for mode in chunk.modes])
    )
    force = _pull(turned, at.after * (chunk.weights * stress))
    force += (constitutive[:, None, None] * volume_gradient).sum(axis=0)
    return force, volume_gradient, turned, tangent, constitutive


@jax.jit
def _condensed(
    chunk: ElementChunk, bulk_modulus: Array, volume_gradient: Array, blocks: Array
) -> Float[Array, "nodes 3 nodes 3 elements"]:
    """Matrices of all directions, with what the pressures add."""
    stiffness = _from_blocks(blocks)
    for gradient in volume_gradient:
        stiffness += bulk_modulus / chunk.volume * gradient[:, :, None, None] * gradient
    return stiffness


@jax.jit
def force(
    chunk: ElementChunk, moduli: Moduli, bulk_modulus: Array, local: Float[Array, "nodes 3 elements"]
) -> tuple[Float[Array, "nodes 3 elements"], Float[Array, "modes elements"]]:
    """Forces and κ ϑ_j alone, those of `response`."""
    F = stored(_deformation_gradient(chunk, local))
    at, growth = stored((principal(F), _growth(F)))
    constitutive = bulk_modulus * _mean(chunk, growth)
    pressure = (chunk.modes * constitutive[:, None]).sum(axis=0)
    stress = isochoric_stress(moduli, at) + pressure * (1.0 + growth) / at.stretch
    force = _pull(stored(_turned(chunk, at.before)), at.after * (chunk.weights * stress))
    return force, constitutive


@jax.jit
def energy(
    chunk: ElementChunk, moduli: Moduli, bulk_modulus: Array, local: Float[Array, "nodes 3 elements"]
) -> Float[Array, " elements"]:
    """Strain energy of each element."""
    F = _deformation_gradient(chunk, local)
    at, squares = principal(F), (_mean(chunk, _growth(F)) ** 2).sum(axis=0)
    isochoric = (chunk.weights * isochoric_energy(moduli, at)).sum(axis=0)
    return isochoric + 0.5 * bulk_modulus * chunk.volume * squares


@jax.jit
def dilatation(
    chunk: ElementChunk, local: Float[Array, "nodes 3 elements"]
) -> Float[Array, "modes elements"]:
    """ϑ_j of each element."""
    return _mean(chunk, _growth(_deformation_gradient(chunk, local)))


def viscosity(
    chunk: ElementChunk, modulus: float, local: Float[ArrayLike, "nodes 3 elements"]
) -> Float[Array, "nodes 3 nodes 3 elements"]:
    """Matrices of ∫ 2μ D:D dV, D the deviator of the rate of strain where the body is now."""
    tangent = _viscous_tangent(chunk, modulus, local)
    return _from_blocks(_integrated(jnp.swapaxes(chunk.gradients, 0, 1), tangent))


@jax.jit
def _viscous_tangent(
    chunk: ElementChunk, modulus: Array, local: Array
) -> Float[Array, "6 3 3 points elements"]:
    """With its weights, in the frame of the body at rest, for each pair of `BLOCKS`."""
    F = _deformation_gradient(chunk, local)
    cofactor = jnp.stack([jnp.cross(F[(i + 1) % 3], F[(i + 2) % 3], axis=0) for i in range(3)])
    inverse = cofactor / (F[0] * cofactor[0]).sum(axis=0)  # (F⁻¹)_Ji as [i, J]
    square = (inverse[:, :, None] * inverse[:, None, :]).sum(axis=0)

    # 2 D:D = |δF F⁻¹|² + δF F⁻¹ : (δF F⁻¹)ᵀ − ⅔ (tr δF F⁻¹)².
    def block(i: int, k: int) -> Array:
        crossed = inverse[k][:, None] * inverse[i][None, :]
        across = inverse[i][:, None] * inverse[k][None, :]
        return float(i == k) * square + crossed - 2.0 / 3.0 * across

    return modulus * chunk.weights * jnp.stack([block(i, k) for i, k in BLOCKS])


def _deformation_gradient(chunk: ElementChunk, local: Array) -> Float[Array, "3 3 points elements"]:
    gradients = chunk.gradients
    return jnp.stack(
        [
            jnp.stack([sum(local[a, i] * gradients[a, J] for a in range(len(local))) for J in range(3)])
            for i in range(3)
        ]
    )


def _growth(F: Float[Array, "3 3 points elements"]) -> Float[Array, "points elements"]:
    """Growth det F − 1 of the volume."""
    return dot(F[0], jnp.cross(F[1], F[2], axis=0)) - 1.0


def _mean(chunk: ElementChunk, growth: Float[Array, "points elements"]) -> Float[Array, "modes elements"]:
    return (chunk.modes * (chunk.weights * growth)).sum(axis=1) / chunk.volume


def _turned(chunk: ElementChunk, frame: Array) -> Float[Array, "3 nodes points elements"]:
    """Gradients along the columns of ``frame``."""
    return jnp.stack([dot(frame[:, a, None], jnp.swapaxes(chunk.gradients, 0, 1)) for a in range(3)])


def _pull(turned: Array, stress: Float[Array, "3 3 points elements"]) -> Float[Array, "nodes 3 elements"]:
    """Σ_q dN_a·T_i, the directions of both turned alike."""
    points = range(turned.shape[2])
    # Point by point: a sum over an axis in the middle is not vectorised.
    sums = [sum(dot(stress[i, :, None, q], turned[:, :, q]) for q in points) for i in range(3)]
    return jnp.stack(sums, axis=1)


@jax.jit
def _integrated(
    gradients: Float[Array, "3 nodes points elements"], tangent: Float[Array, "6 3 3 points elements"]
) -> Float[Array, "6 nodes nodes elements"]:
    """Σ_q dN_aJ A_iJkL dN_bL for each pair (i, k) of `BLOCKS`, both in one frame at each point."""
    nodes, points = gradients.shape[1:3]
    right = stored(sum(tangent[:, :, L, None] * gradients[L] for L in range(3)))
    if nodes > _FEW_NODES:
        return jnp.einsum("Jaqe,nJbqe->nabe", gradients, right)
    return sum(gradients[J, :, None, q] * right[:, J, None, :, q] for q in range(points) for J in range(3))


@jax.jit
def _from_blocks(blocks: Float[Array, "6 nodes nodes elements"]) -> Float[Array, "nodes 3 nodes 3 elements"]:
    """Symmetric matrices from what `BLOCKS` says of them."""
    of = {}
    for (i, k), block in zip(BLOCKS, blocks, strict=True):
        of[k, i], of[i, k] = jnp.swapaxes(block, 0, 1), block
    return jnp.stack([jnp.stack([of[i, k] for k in range(3)], axis=2) for i in range(3)], axis=1)
