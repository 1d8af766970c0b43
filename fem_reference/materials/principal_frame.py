"""Principal stretches and directions at many points at once, and stress and tangent in their frame.

Components come first and points last, so that compiled loops run over the points. Double precision is
required (`jax.enable_x64`).

References
----------
Ogden (1997), Non-linear Elastic Deformations, §6.1.4: moduli of an isotropic solid in the principal frame.
"""

from typing import NamedTuple

import jax
import jax.numpy as jnp
from jax import Array
from jaxtyping import Float

from fem_reference.materials.eigen3 import symmetric_eigen

#: Pairs i ≠ j of directions, in the order of the moduli between them.
PAIRS = ((0, 1), (1, 2), (2, 0))
#: Pairs i ≤ k of directions, one for each block of a tangent; block (k, i) is the transpose of (i, k).
BLOCKS = ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))
# Keeps intermediate results in memory; otherwise XLA recomputes them at every use.
materialised = jax.lax.optimization_barrier


class Principal(NamedTuple):
    """Spectral form F = Σ λ_i n_i ⊗ N_i.

    Parameters
    ----------
    stretch, strain : λ_i and ln λ_i.
    deviatoric : ln λ_i minus their mean.
    after, before : directions n_j and N_j as columns: the components of n_j are ``after[:, j]``.
    """

    stretch: Float[Array, "3 *points"]
    strain: Float[Array, "3 *points"]
    deviatoric: Float[Array, "3 *points"]
    after: Float[Array, "3 3 *points"]
    before: Float[Array, "3 3 *points"]


def principal(F: Float[Array, "3 3 *points"]) -> Principal:
    """Return principal stretches and directions of deformation gradients."""
    square = jnp.stack([jnp.stack([dot(F[:, i], F[:, j]) for j in range(3)]) for i in range(3)])
    squared, N = symmetric_eigen(square)
    stretch, strain = jnp.sqrt(squared), 0.5 * jnp.log(squared)
    n = jnp.stack([jnp.stack([dot(F[i], N[:, j]) / stretch[j] for j in range(3)]) for i in range(3)])
    return Principal(stretch, strain, strain - total(strain) / 3.0, n, N)


class DyadModuli(NamedTuple):
    """∂P/∂F in the basis n_i ⊗ N_j: a 3×3 block for the stretches and a 2×2 block for each pair i ≠ j.

    Parameters
    ----------
    alone : diagonal moduli; first those of n_i ⊗ N_i, then those of each pair of `PAIRS`.
    across : moduli between n_i ⊗ N_i and n_j ⊗ N_j.
    crossed : moduli between n_i ⊗ N_j and n_j ⊗ N_i.
    """

    alone: Float[Array, "6 *points"]
    across: Float[Array, "3 *points"]
    crossed: Float[Array, "3 *points"]


def dyad_moduli(
    at: Principal,
    kirchhoff: Float[Array, "3 *points"],
    own: Float[Array, "3 *points"],
    mutual: list[Array],
    shear: list[Array],
) -> DyadModuli:
    """Return the moduli of an isotropic solid.

    Parameters
    ----------
    at : principal stretches.
    kirchhoff : Kirchhoff stresses τ_i.
    own : ∂τ_i/∂(ln λ_i).
    mutual, shear : ∂τ_i/∂(ln λ_j) and (τ_i − τ_j)/(λ_i² − λ_j²) of each pair of `PAIRS`.
    """
    lam = at.stretch
    alone = [(own[i] - kirchhoff[i]) / lam[i] ** 2 for i in range(3)]
    across, crossed = [], []
    for k, (i, j) in enumerate(PAIRS):
        product = lam[i] * lam[j]
        mean_stress = 0.5 * (kirchhoff[i] + kirchhoff[j])
        mean_square = 0.5 * (lam[i] ** 2 + lam[j] ** 2)
        alone.append(shear[k])
        across.append(mutual[k] / product)
        crossed.append((mean_square * shear[k] - mean_stress) / product)
    return DyadModuli(jnp.stack(alone), jnp.stack(across), jnp.stack(crossed))


def pressure_moduli(
    at: Principal, determinant: Float[Array, "*points"], pressure: Float[Array, "*points"]
) -> Float[Array, "3 *points"]:
    """Return moduli ``across`` of p ∂²(det F)/∂F² = p ∂²(λ1 λ2 λ3)/∂λ_i ∂λ_j; ``crossed`` are −``across``."""
    work = pressure * determinant
    return jnp.stack([work / (at.stretch[i] * at.stretch[j]) for i, j in PAIRS])


def half_turned(moduli: DyadModuli, after: Float[Array, "3 3 *points"]) -> Float[Array, "6 3 3 *points"]:
    """Return the tangent N_Ja (∂P_iJ/∂F_kL) N_Lb over (a, b), one block for each pair (i, k) of `BLOCKS`.

    Parameters
    ----------
    moduli : moduli in the basis n_i ⊗ N_j.
    after : directions n_j as columns.
    """
    n, place = after, {}
    for k, (i, j) in enumerate(PAIRS):
        place[i, j] = place[j, i] = k

    def entry(i: int, k: int, a: int, b: int) -> Array:
        if a == b:
            own = [moduli.alone[a if c == a else 3 + place[c, a]] for c in range(3)]
            return dot(n[i] * n[k], jnp.stack(own))
        pair = place[a, b]
        return n[i, a] * n[k, b] * moduli.across[pair] + n[i, b] * n[k, a] * moduli.crossed[pair]

    tangent = [[[entry(i, k, a, b) for b in range(3)] for a in range(3)] for i, k in BLOCKS]
    return jnp.stack([jnp.stack([jnp.stack(row) for row in block]) for block in tangent])


def total(a: Array) -> Array:
    """Return the sum over the first axis, of length three.

    It is unrolled, like `dot`: XLA compiles a reduction separately and stores its operands.
    """
    return a[0] + a[1] + a[2]


def dot(a: Array, b: Array) -> Array:
    """Return the product of two arrays summed over their first axis, of length three."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
