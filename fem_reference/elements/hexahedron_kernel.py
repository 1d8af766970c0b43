"""Compiled loops over the Gauss points of a chunk of hexahedra: forces, tangents and dilatations.

Stress and tangent are evaluated and integrated in the principal frame at each point. The shape functions'
gradients are rotated into that frame, so the tangent is never rotated back. It is symmetric: only blocks of
directions i ≤ k are integrated. Components come first and elements last, so that the innermost loops, over
elements, are vectorised. See `solid` for the mechanics. Lengths mm, stresses MPa.
"""

from typing import NamedTuple

import jax
import jax.numpy as jnp
from jax import Array
from jaxtyping import ArrayLike, Float

from fem_reference.materials import (
    BLOCKS,
    DyadModuli,
    Isochoric,
    dot,
    half_turned,
    materialised,
    pressure_moduli,
    principal,
)

# Up to this many nodes an unrolled sum over points, vectorised over elements, takes half the time of a matrix
# product; with the 27 nodes of a quadratic element it takes twice the time.
_FEW_NODES = 8


class ElementChunk(NamedTuple):
    """Elements at rest: ∂N_a/∂X_J, weights and pressure modes at every Gauss point, and volumes."""

    gradients: Float[Array, "nodes 3 points elements"]
    weights: Float[Array, "points elements"]
    modes: Float[Array, "modes points elements"]
    volume: Float[Array, " elements"]


def response(
    chunk: ElementChunk,
    law: Isochoric,
    bulk_modulus: Array,
    local: Float[ArrayLike, "nodes 3 elements"],
    pressure: Float[ArrayLike, "modes elements"] | None,
) -> tuple[
    Float[Array, "nodes 3 elements"],
    Float[Array, "modes nodes 3 elements"],
    Float[Array, "nodes 3 nodes 3 elements"],
    Float[Array, "modes elements"],
]:
    """Return forces, V_e ∂ϑ_j/∂x, stiffness with the pressures condensed, and κ ϑ_j.

    Parameters
    ----------
    chunk, law, bulk_modulus : elements and their material.
    local : positions of each element's nodes.
    pressure : π_j in the geometric part of the tangent; κ ϑ_j if None.
    """
    at_points = _at_points(chunk, law, bulk_modulus, local, pressure)
    force, volume_gradient, turned, tangent, constitutive = at_points
    blocks = _integrated(turned, tangent)
    return force, volume_gradient, _condensed(chunk, bulk_modulus, volume_gradient, blocks), constitutive


# The stages are compiled separately: in one program XLA would recompute intermediate arrays at every use.
@jax.jit
def _at_points(
    chunk: ElementChunk, law: Isochoric, bulk_modulus: Array, local: Array, pressure: Array | None
) -> tuple[
    Float[Array, "nodes 3 elements"],
    Float[Array, "modes nodes 3 elements"],
    Float[Array, "3 nodes points elements"],
    Float[Array, "6 3 3 points elements"],
    Float[Array, "modes elements"],
]:
    """Return forces, V_e ∂ϑ_j/∂x, gradients and weighted tangent in the principal frames, and κ ϑ_j."""
    F = materialised(_deformation_gradient(chunk, local))
    at, growth = materialised((principal(F), _growth(F)))
    constitutive = bulk_modulus * _mean(chunk, growth)
    stress, dyads = law.response(at)
    kept = constitutive if pressure is None else pressure
    volumetric = pressure_moduli(at, 1.0 + growth, (chunk.modes * kept[:, None]).sum(axis=0))
    alone, across, crossed = dyads.alone, dyads.across + volumetric, dyads.crossed - volumetric
    dyads = materialised(DyadModuli(*(chunk.weights * part for part in (alone, across, crossed))))
    tangent = half_turned(dyads, at.after)
    turned = materialised(_turned(chunk, at.before))
    cofactor = (1.0 + growth) / at.stretch
    volume_gradient = materialised(
        jnp.stack([_pull(turned, at.after * (chunk.weights * mode * cofactor)) for mode in chunk.modes])
    )
    force = _pull(turned, at.after * (chunk.weights * stress))
    force += (constitutive[:, None, None] * volume_gradient).sum(axis=0)
    return force, volume_gradient, turned, tangent, constitutive


@jax.jit
def _condensed(
    chunk: ElementChunk, bulk_modulus: Array, volume_gradient: Array, blocks: Array
) -> Float[Array, "nodes 3 nodes 3 elements"]:
    """Return the full element matrices, with the condensed pressures' contribution."""
    stiffness = _from_blocks(blocks)
    for gradient in volume_gradient:
        stiffness += bulk_modulus / chunk.volume * gradient[:, :, None, None] * gradient
    return stiffness


@jax.jit
def force(
    chunk: ElementChunk, law: Isochoric, bulk_modulus: Array, local: Float[Array, "nodes 3 elements"]
) -> tuple[Float[Array, "nodes 3 elements"], Float[Array, "modes elements"]]:
    """Return only the forces and κ ϑ_j of `response`."""
    F = materialised(_deformation_gradient(chunk, local))
    at, growth = materialised((principal(F), _growth(F)))
    constitutive = bulk_modulus * _mean(chunk, growth)
    pressure = (chunk.modes * constitutive[:, None]).sum(axis=0)
    stress = law.stress(at) + pressure * (1.0 + growth) / at.stretch
    force = _pull(materialised(_turned(chunk, at.before)), at.after * (chunk.weights * stress))
    return force, constitutive


@jax.jit
def energy(
    chunk: ElementChunk, law: Isochoric, bulk_modulus: Array, local: Float[Array, "nodes 3 elements"]
) -> Float[Array, " elements"]:
    """Return the strain energy of each element."""
    F = _deformation_gradient(chunk, local)
    at, squares = principal(F), (_mean(chunk, _growth(F)) ** 2).sum(axis=0)
    isochoric = (chunk.weights * law.energy(at)).sum(axis=0)
    return isochoric + 0.5 * bulk_modulus * chunk.volume * squares


@jax.jit
def dilatation(
    chunk: ElementChunk, local: Float[Array, "nodes 3 elements"]
) -> Float[Array, "modes elements"]:
    """Return ϑ_j of each element."""
    return _mean(chunk, _growth(_deformation_gradient(chunk, local)))


def viscosity(
    chunk: ElementChunk, modulus: float, local: Float[ArrayLike, "nodes 3 elements"]
) -> Float[Array, "nodes 3 nodes 3 elements"]:
    """Return the matrices of ∫ 2μ D:D dV, with D the deviatoric strain rate in the current configuration."""
    tangent = _viscous_tangent(chunk, modulus, local)
    return _from_blocks(_integrated(jnp.swapaxes(chunk.gradients, 0, 1), tangent))


@jax.jit
def _viscous_tangent(
    chunk: ElementChunk, modulus: Array, local: Array
) -> Float[Array, "6 3 3 points elements"]:
    """Return the weighted tangent in the reference frame, for each pair of `BLOCKS`."""
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
    """Return the relative volume change det F − 1."""
    return dot(F[0], jnp.cross(F[1], F[2], axis=0)) - 1.0


def _mean(chunk: ElementChunk, growth: Float[Array, "points elements"]) -> Float[Array, "modes elements"]:
    return (chunk.modes * (chunk.weights * growth)).sum(axis=1) / chunk.volume


def _turned(chunk: ElementChunk, frame: Array) -> Float[Array, "3 nodes points elements"]:
    """Return the gradients along the columns of ``frame``."""
    return jnp.stack([dot(frame[:, a, None], jnp.swapaxes(chunk.gradients, 0, 1)) for a in range(3)])


def _pull(turned: Array, stress: Float[Array, "3 3 points elements"]) -> Float[Array, "nodes 3 elements"]:
    """Return the nodal forces Σ_q dN_a·T_i, with gradients and stresses in the same frame."""
    points = range(turned.shape[2])
    # Unrolled over points: XLA does not vectorise a sum over an inner axis.
    sums = [sum(dot(stress[i, :, None, q], turned[:, :, q]) for q in points) for i in range(3)]
    return jnp.stack(sums, axis=1)


@jax.jit
def _integrated(
    gradients: Float[Array, "3 nodes points elements"], tangent: Float[Array, "6 3 3 points elements"]
) -> Float[Array, "6 nodes nodes elements"]:
    """Return Σ_q dN_aJ A_iJkL dN_bL for each pair (i, k) of `BLOCKS`, all in the same frame at each point."""
    nodes, points = gradients.shape[1:3]
    right = materialised(sum(tangent[:, :, L, None] * gradients[L] for L in range(3)))
    if nodes > _FEW_NODES:
        return jnp.einsum("Jaqe,nJbqe->nabe", gradients, right)
    return sum(gradients[J, :, None, q] * right[:, J, None, :, q] for q in range(points) for J in range(3))


@jax.jit
def _from_blocks(blocks: Float[Array, "6 nodes nodes elements"]) -> Float[Array, "nodes 3 nodes 3 elements"]:
    """Return symmetric matrices from their `BLOCKS`."""
    full = {}
    for (i, k), block in zip(BLOCKS, blocks, strict=True):
        full[k, i], full[i, k] = jnp.swapaxes(block, 0, 1), block
    return jnp.stack([jnp.stack([full[i, k] for k in range(3)], axis=2) for i in range(3)], axis=1)
