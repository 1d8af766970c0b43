"""Isochoric Yeoh hyperelasticity: an energy in the first invariant alone, in principal stretches."""

from dataclasses import dataclass
from typing import NamedTuple

import jax.numpy as jnp
import numpy as np
from jax import Array
from jaxtyping import Float

from fem_reference.materials.material import Material, refuse_negative_without_range
from fem_reference.materials.principal_frame import PAIRS, DyadModuli, Principal, dyad_moduli, total

_MOST_CONSTANTS = 3


@dataclass(frozen=True)
class Yeoh(Material):
    """Nearly incompressible Yeoh solid, W = Σ_k C_k (Ī1 − 3)^k + κ/2 (J − 1)², of one to three constants.

    Parameters
    ----------
    constants : C1, C2, C3 [Pa], or fewer. The initial shear modulus is 2 C1; one constant is the neo-Hookean
        solid. C2 or C3 may be negative where the solid is stable over the stretch_range.
    bulk_modulus : κ [Pa]. By default 996 times the initial shear modulus.
    stretch_range : least and largest stretch that was tested. The solid must be stable in it.

    References
    ----------
    Yeoh (1993), Rubber Chem. Technol. 66, eq. 5.
    """

    constants: tuple[float, ...]
    # None only until `__post_init__` knows the constants.
    bulk_modulus: float | None = None  # type: ignore[assignment]
    stretch_range: tuple[float, float] | None = None

    def __post_init__(self) -> None:
        if not 1 <= len(self.constants) <= _MOST_CONSTANTS:
            raise ValueError(
                f"constants: got {len(self.constants)} values, expected one to {_MOST_CONSTANTS}"
            )
        if not self.constants[0] > 0.0:
            raise ValueError(f"constants: got a first of {self.constants[0]} Pa, expected it to be positive")
        if not np.isfinite(self.constants).all():
            raise ValueError(f"constants: got {self.constants}, expected finite numbers [Pa]")
        refuse_negative_without_range("constants", self.constants, self.stretch_range)
        self._complete("constants")

    @property
    def shear_modulus(self) -> float:
        """Initial shear modulus 2 C1 [Pa]."""
        return 2.0 * self.constants[0]

    def isochoric(self, unit: float) -> "YeohConstants":
        """Return the isochoric part for compiled code, with stresses in ``unit`` [Pa]."""
        return YeohConstants(jnp.asarray(np.divide(self.constants, unit)))

    def slope(self, stretches: Float[np.ndarray, "*points 3"]) -> Float[np.ndarray, "*points 3"]:
        """Return ∂W/∂(ln λ_i) = 2 W' λ_i² of an incompressible deformation, up to a pressure [Pa]."""
        excess = np.expm1(2.0 * np.log(stretches))
        first, _ = self._derivatives(np.asarray(excess.sum(axis=-1)))
        # λ_i² less one, so that small strains lose no digits.
        return 2.0 * first[..., None] * excess

    def curvature(self, stretches: Float[np.ndarray, "*points 3"]) -> Float[np.ndarray, "*points 3 3"]:
        """Return ∂²W/∂(ln λ_i) ∂(ln λ_j) of an incompressible deformation [Pa]."""
        squared = stretches**2
        first, second = self._derivatives(np.asarray(squared.sum(axis=-1) - 3.0))
        own = 4.0 * (first[..., None] * squared)[..., None] * np.eye(3)
        return own + 4.0 * second[..., None, None] * squared[..., :, None] * squared[..., None, :]

    def _derivatives(self, excess: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return W' and W'' by Ī1, at Ī1 − 3."""
        first, second = np.zeros_like(excess), np.zeros_like(excess)
        for k in range(len(self.constants), 0, -1):
            second = second * excess + first
            first = first * excess + k * self.constants[k - 1]
        return np.asarray(first), np.asarray(second)


class YeohConstants(NamedTuple):
    """Constants C_k of the isochoric part of a Yeoh solid."""

    constants: Float[Array, " terms"]

    def energy(self, at: Principal) -> Float[Array, "*points"]:
        """Return the isochoric strain energy per reference volume."""
        excess = total(jnp.expm1(2.0 * at.deviatoric))
        energy = jnp.zeros_like(excess)
        for constant in self.constants[::-1]:
            energy = (energy + constant) * excess
        return energy

    def stress(self, at: Principal) -> Float[Array, "3 *points"]:
        """Return the stresses T_i of the isochoric first Piola–Kirchhoff stress P = Σ T_i n_i ⊗ N_i."""
        beyond, _, first, _ = self._derivatives(at)
        return 2.0 * first * beyond / at.stretch

    def response(self, at: Principal) -> tuple[Float[Array, "3 *points"], DyadModuli]:
        """Return the stresses of `stress`, and the moduli of the isochoric part."""
        beyond, squared, first, second = self._derivatives(at)
        mean = total(squared) / 3.0
        kirchhoff = 2.0 * first * beyond
        own = 4.0 * second * beyond**2 + 4.0 / 3.0 * first * (squared + mean)
        mutual = [
            4.0 * second * beyond[i] * beyond[j] - 4.0 / 3.0 * first * (squared[i] + squared[j] - mean)
            for i, j in PAIRS
        ]
        # (τ_i − τ_j)/(λ_i² − λ_j²) = 2 W' J^(−2/3) of each pair, without a difference of near stretches.
        shear = 2.0 * first * jnp.exp(-2.0 / 3.0 * total(at.strain))
        return kirchhoff / at.stretch, dyad_moduli(at, kirchhoff, own, mutual, [shear] * 3)

    def _derivatives(self, at: Principal) -> tuple[Array, Array, Array, Array]:
        """Return λ̄_i² less their mean, λ̄_i², and W' and W'' by Ī1."""
        grown = jnp.expm1(2.0 * at.deviatoric)
        excess = total(grown)
        first, second = jnp.zeros_like(excess), jnp.zeros_like(excess)
        for k in range(len(self.constants), 0, -1):
            second = second * excess + first
            first = first * excess + k * self.constants[k - 1]
        return grown - excess / 3.0, grown + 1.0, first, second
