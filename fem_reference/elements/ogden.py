"""Isochoric Ogden hyperelasticity in principal stretches: energy, stress and tangent at many points at once.

Components come first and points last, so that compiled loops run over the points. Equal stretches need no
special case: ratios of differences are written with sinh(x)/x. Stresses have the unit of the moduli (MPa
inside the FEM). Double precision is required (`jax.enable_x64`).
"""

import math
from dataclasses import dataclass
from typing import NamedTuple

import jax
import jax.numpy as jnp
from jax import Array
from jaxtyping import Float

from fem_reference.elements.eigen3 import symmetric_eigen
from fem_reference.geometry import BULK_TO_SHEAR, refuse_implausible

_PAIRS = ((0, 1), (1, 2), (2, 0))
#: Pairs i ≤ k of directions, one for each block of a tangent; block (k, i) is the transpose of (i, k).
BLOCKS = ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))
# Below this, sinh(x)/x is its series up to x⁸/9!: the first omitted term is under 1e-22, while a difference
# of exponentials would lose over two digits.
_SERIES_BELOW = 0.01
# Keeps intermediate results in memory; otherwise XLA recomputes them at every use.
stored = jax.lax.optimization_barrier
# Constants of the paper's silicone [Pa].
_PAPER_MODULI, _PAPER_BULK_MODULUS = (0.00681e6, -0.2881e6, 0.38165e6), 100e6


@dataclass(frozen=True)
class Ogden:
    """Nearly incompressible Ogden solid in the form used by the paper (and Abaqus).

    W = Σ_i 2 μ_i/α_i² (λ̄1^α_i + λ̄2^α_i + λ̄3^α_i − 3) + κ/2 (J − 1)², with λ̄ = J^(−1/3) λ, so that the
    initial shear modulus is Σ μ_i. One term with α = 2 is the neo-Hookean solid.

    Parameters
    ----------
    shear_moduli : μ_i [Pa].
    exponents : α_i.
    bulk_modulus : κ [Pa]. By default 996 times the initial shear modulus: 100 MPa for the paper's silicone.

    References
    ----------
    Ogden (1972), Proc. R. Soc. A 326; the paper's Table II for the values.
    """

    shear_moduli: tuple[float, ...] = _PAPER_MODULI
    exponents: tuple[float, ...] = (9.33, 3.376, 2.487)
    # None only until `__post_init__` knows the moduli.
    bulk_modulus: float = None  # type: ignore[assignment]

    def __post_init__(self) -> None:
        if len(self.shear_moduli) != len(self.exponents) or not self.exponents:
            raise ValueError(
                f"shear_moduli and exponents: got {len(self.shear_moduli)} and {len(self.exponents)} values, "
                "expected equal numbers, at least one"
            )
        if any(a == 0.0 for a in self.exponents):
            raise ValueError(f"exponents: got {self.exponents}, expected none to be zero")
        if not sum(self.shear_moduli) > 0.0:
            raise ValueError(
                f"shear_moduli: got a sum of {sum(self.shear_moduli)} Pa, expected it to be positive"
            )
        refuse_implausible("shear_moduli", self.shear_modulus)
        if self.bulk_modulus is None:
            # Exactly 100 MPa for the paper's moduli.
            share = self.shear_modulus / sum(_PAPER_MODULI)
            object.__setattr__(self, "bulk_modulus", _PAPER_BULK_MODULUS * share)
        if not (math.isfinite(self.bulk_modulus) and self.bulk_modulus > 0.0):
            raise ValueError(
                f"bulk_modulus: got {self.bulk_modulus!r}, expected a positive finite number [Pa]"
            )
        refuse_implausible("bulk_modulus", self.bulk_modulus)
        least, most = (ratio * self.shear_modulus for ratio in BULK_TO_SHEAR)
        if not least <= self.bulk_modulus <= most:
            raise ValueError(
                f"bulk_modulus: got {self.bulk_modulus:g} Pa, expected {least:g} to {most:g} Pa with shear "
                f"moduli of {self.shear_modulus:g} Pa in sum; is it in another unit, or of another material?"
            )

    @property
    def shear_modulus(self) -> float:
        """Initial shear modulus Σ μ_i [Pa]."""
        return sum(self.shear_moduli)


class Moduli(NamedTuple):
    """Constants μ_i and α_i of the isochoric part of an Ogden solid."""

    shear_moduli: Float[Array, " terms"]
    exponents: Float[Array, " terms"]


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


def isochoric_energy(moduli: Moduli, at: Principal) -> Float[Array, "*points"]:
    """Return the isochoric strain energy per reference volume."""
    energy = jnp.zeros_like(at.strain[0])
    for mu, alpha in zip(*moduli, strict=True):
        # expm1 keeps the small-strain energy free of cancellation.
        energy += 2.0 * mu / alpha**2 * jnp.expm1(alpha * at.deviatoric).sum(axis=0)
    return energy


def isochoric_stress(moduli: Moduli, at: Principal) -> Float[Array, "3 *points"]:
    """Return the stresses T_i of the isochoric first Piola–Kirchhoff stress P = Σ T_i n_i ⊗ N_i."""
    kirchhoff = jnp.zeros_like(at.strain)
    for mu, alpha in zip(*moduli, strict=True):
        power = jnp.exp(alpha * at.deviatoric)
        kirchhoff += 2.0 * mu / alpha * (power - total(power) / 3.0)
    return kirchhoff / at.stretch


class DyadModuli(NamedTuple):
    """∂P/∂F in the basis n_i ⊗ N_j: a 3×3 block for the stretches and a 2×2 block for each pair i ≠ j.

    Parameters
    ----------
    alone : diagonal moduli; first those of n_i ⊗ N_i, then those of each pair of `_PAIRS`.
    across : moduli between n_i ⊗ N_i and n_j ⊗ N_j.
    crossed : moduli between n_i ⊗ N_j and n_j ⊗ N_i.
    """

    alone: Float[Array, "6 *points"]
    across: Float[Array, "3 *points"]
    crossed: Float[Array, "3 *points"]


def isochoric_response(moduli: Moduli, at: Principal) -> tuple[Float[Array, "3 *points"], DyadModuli]:
    """Return the stresses of `isochoric_stress` and the moduli of the isochoric part.

    References
    ----------
    Ogden (1997), Non-linear Elastic Deformations, §6.1.4.
    """
    lam, strain, deviatoric, *_ = at
    kirchhoff, own = jnp.zeros_like(lam), jnp.zeros_like(lam)
    mutual, ratio = ([jnp.zeros_like(lam[0])] * 3 for _ in range(2))
    for mu, alpha in zip(*moduli, strict=True):
        half = stored(jnp.exp(0.5 * alpha * deviatoric))
        power = half * half
        mean = total(power) / 3.0
        kirchhoff += 2.0 * mu / alpha * (power - mean)
        # ∂τ_i/∂(ln λ_i), and ∂τ_i/∂(ln λ_j) of each pair.
        own += 2.0 / 3.0 * mu * (power + mean)
        for k, (i, j) in enumerate(_PAIRS):
            mutual[k] -= 2.0 / 3.0 * mu * (power[i] + power[j] - mean)
            # (τ_i − τ_j)/(λ_i² − λ_j²), without the factor that all terms share.
            gap = 0.5 * alpha * (deviatoric[i] - deviatoric[j])
            ratio[k] += mu * _sinhc(gap, half[i], half[j])
    alone = [(own[i] - kirchhoff[i]) / lam[i] ** 2 for i in range(3)]
    across, crossed = [], []
    for k, (i, j) in enumerate(_PAIRS):
        product = lam[i] * lam[j]
        shear = ratio[k] / _sinhc(strain[i] - strain[j], lam[i], lam[j])
        mean_stress = 0.5 * (kirchhoff[i] + kirchhoff[j])
        mean_square = 0.5 * (lam[i] ** 2 + lam[j] ** 2)
        alone.append(shear)
        across.append(mutual[k] / product)
        crossed.append((mean_square * shear - mean_stress) / product)
    return kirchhoff / lam, DyadModuli(jnp.stack(alone), jnp.stack(across), jnp.stack(crossed))


def pressure_moduli(
    at: Principal, determinant: Float[Array, "*points"], pressure: Float[Array, "*points"]
) -> Float[Array, "3 *points"]:
    """Return moduli ``across`` of p ∂²(det F)/∂F² = p ∂²(λ1 λ2 λ3)/∂λ_i ∂λ_j; ``crossed`` are −``across``."""
    work = pressure * determinant
    return jnp.stack([work / (at.stretch[i] * at.stretch[j]) for i, j in _PAIRS])


def half_turned(moduli: DyadModuli, after: Float[Array, "3 3 *points"]) -> Float[Array, "6 3 3 *points"]:
    """Return the tangent N_Ja (∂P_iJ/∂F_kL) N_Lb over (a, b), one block for each pair (i, k) of `BLOCKS`.

    Parameters
    ----------
    moduli : moduli in the basis n_i ⊗ N_j.
    after : directions n_j as columns.
    """
    n, place = after, {}
    for k, (i, j) in enumerate(_PAIRS):
        place[i, j] = place[j, i] = k

    def entry(i: int, k: int, a: int, b: int) -> Array:
        if a == b:
            own = [moduli.alone[a if c == a else 3 + place[c, a]] for c in range(3)]
            return dot(n[i] * n[k], jnp.stack(own))
        pair = place[a, b]
        return n[i, a] * n[k, b] * moduli.across[pair] + n[i, b] * n[k, a] * moduli.crossed[pair]

    tangent = [[[entry(i, k, a, b) for b in range(3)] for a in range(3)] for i, k in BLOCKS]
    return jnp.stack([jnp.stack([jnp.stack(row) for row in block]) for block in tangent])


def _sinhc(x: Array, up: Array, down: Array) -> Array:
    """Return sinh(x)/x times up·down, where up/down = exp(x)."""
    small = jnp.abs(x) < _SERIES_BELOW
    square = x * x
    series = 1.0 + square / 6.0 * (1.0 + square / 20.0 * (1.0 + square / 42.0 * (1.0 + square / 72.0)))
    closed = 0.5 * (up * up - down * down) / jnp.where(small, 1.0, x)
    return jnp.where(small, up * down * series, closed)


def total(a: Array) -> Array:
    """Return the sum over the first axis, of length three.

    It is unrolled, like `dot`: XLA compiles a reduction separately and stores its operands.
    """
    return a[0] + a[1] + a[2]


def dot(a: Array, b: Array) -> Array:
    """Return the product of two arrays summed over their first axis, of length three."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
