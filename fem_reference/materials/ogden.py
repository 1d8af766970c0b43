"""Isochoric Ogden hyperelasticity in principal stretches, with the neo-Hookean and the Mooney–Rivlin solid.

Equal stretches need no special case: ratios of differences are written with sinh(x)/x.
"""

from dataclasses import dataclass
from typing import NamedTuple

import jax.numpy as jnp
import numpy as np
from jax import Array
from jaxtyping import Float

from fem_reference.geometry import paper_numbers
from fem_reference.materials.material import PAPER_MODULI, Material, refuse_negative_without_range
from fem_reference.materials.principal_frame import (
    PAIRS,
    DyadModuli,
    Principal,
    dyad_moduli,
    materialised,
    total,
)

# Below this, sinh(x)/x is its series up to x⁸/9!: the first omitted term is under 1e-22, while a difference
# of exponentials would lose over two digits.
_SERIES_BELOW = 0.01


@dataclass(frozen=True)
class Ogden(Material):
    """Nearly incompressible Ogden solid in the convention of the paper and of Abaqus.

    W = Σ_i 2 μ_i/α_i² (λ̄1^α_i + λ̄2^α_i + λ̄3^α_i − 3) + κ/2 (J − 1)², with λ̄ = J^(−1/3) λ, so that the
    initial shear modulus is Σ μ_i. `Ogden.classic` takes constants of the other convention. One term with
    α = 2 is the neo-Hookean solid, two with α = 2 and −2 are the Mooney–Rivlin solid.

    Parameters
    ----------
    shear_moduli : μ_i [Pa].
    exponents : α_i.
    bulk_modulus : κ [Pa]. By default 996 times the initial shear modulus: 100 MPa for the paper's silicone.
    stretch_range : least and largest stretch that was tested. The solid must be stable in it.

    References
    ----------
    Ogden (1972), Proc. R. Soc. A 326; the paper's Table II for the values.
    """

    shear_moduli: tuple[float, ...] = PAPER_MODULI
    exponents: tuple[float, ...] = paper_numbers("material", "exponents")
    # None only until `__post_init__` knows the moduli.
    bulk_modulus: float | None = None  # type: ignore[assignment]
    stretch_range: tuple[float, float] | None = None

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
        self._complete("shear_moduli")

    @classmethod
    def classic(
        cls,
        moduli: tuple[float, ...],
        exponents: tuple[float, ...],
        bulk_modulus: float | None = None,
        stretch_range: tuple[float, float] | None = None,
    ) -> "Ogden":
        """Return the solid of constants in Ogden's own convention, W = Σ m_i/α_i (λ̄1^α_i + … − 3).

        There the initial shear modulus is Σ m_i α_i/2. Ansys, COMSOL, Marc and FEBio differ in which of the
        two conventions they have; look at the energy of your source.

        Parameters
        ----------
        moduli : m_i [Pa], of the sign of α_i for a term that is stable by itself.
        exponents, bulk_modulus, stretch_range : as of `Ogden`.
        """
        if len(moduli) != len(exponents):
            raise ValueError(
                f"moduli and exponents: got {len(moduli)} and {len(exponents)} values, expected equal numbers"
            )
        own = tuple(0.5 * m * alpha for m, alpha in zip(moduli, exponents, strict=True))
        return cls(own, tuple(exponents), bulk_modulus, stretch_range)

    @property
    def classic_moduli(self) -> tuple[float, ...]:
        """Constants m_i = 2 μ_i/α_i of Ogden's own convention [Pa]."""
        return tuple(2.0 * mu / alpha for mu, alpha in zip(self.shear_moduli, self.exponents, strict=True))

    @property
    def shear_modulus(self) -> float:
        """Initial shear modulus Σ μ_i [Pa]."""
        return sum(self.shear_moduli)

    def isochoric(self, unit: float) -> "OgdenTerms":
        """Return the isochoric part for compiled code, with stresses in ``unit`` [Pa]."""
        return OgdenTerms(jnp.asarray(np.divide(self.shear_moduli, unit)), jnp.asarray(self.exponents))

    def slope(self, stretches: Float[np.ndarray, "*points 3"]) -> Float[np.ndarray, "*points 3"]:
        """Return ∂W/∂(ln λ_i) = Σ 2 μ/α λ_i^α of an incompressible deformation, up to a pressure [Pa]."""
        terms = zip(self.shear_moduli, self.exponents, strict=True)
        # λ_i^α less one, so that small strains lose no digits.
        return sum(
            (2.0 * mu / alpha * np.expm1(alpha * np.log(stretches)) for mu, alpha in terms),
            np.zeros_like(stretches),
        )

    def curvature(self, stretches: Float[np.ndarray, "*points 3"]) -> Float[np.ndarray, "*points 3 3"]:
        """Return ∂²W/∂(ln λ_i) ∂(ln λ_j) of an incompressible deformation [Pa]."""
        terms = zip(self.shear_moduli, self.exponents, strict=True)
        own = sum((2.0 * mu * stretches**alpha for mu, alpha in terms), np.zeros_like(stretches))
        return own[..., None] * np.eye(3)


def neo_hookean(
    shear_modulus: float, bulk_modulus: float | None = None, stretch_range: tuple[float, float] | None = None
) -> Ogden:
    """Return the neo-Hookean solid, W = μ/2 (Ī1 − 3) + κ/2 (J − 1)².

    Parameters
    ----------
    shear_modulus : μ [Pa], twice the constant C10 of some programs.
    bulk_modulus, stretch_range : as of `Ogden`.
    """
    return Ogden((shear_modulus,), (2.0,), bulk_modulus, stretch_range)


def mooney_rivlin(
    c10: float,
    c01: float,
    bulk_modulus: float | None = None,
    stretch_range: tuple[float, float] | None = None,
) -> Ogden:
    """Return the Mooney–Rivlin solid, W = C10 (Ī1 − 3) + C01 (Ī2 − 3) + κ/2 (J − 1)².

    Parameters
    ----------
    c10, c01 : constants [Pa]. One may be negative where the solid is stable over the stretch_range.
    bulk_modulus, stretch_range : as of `Ogden`.

    References
    ----------
    Rivlin (1948), Phil. Trans. R. Soc. A 241. As Ogden terms: Ogden (1972), eq. 7.
    """
    refuse_negative_without_range("c10 and c01", (c10, c01), stretch_range)
    return Ogden((2.0 * c10, 2.0 * c01), (2.0, -2.0), bulk_modulus, stretch_range)


class OgdenTerms(NamedTuple):
    """Constants μ_i and α_i of the isochoric part of an Ogden solid."""

    shear_moduli: Float[Array, " terms"]
    exponents: Float[Array, " terms"]

    def energy(self, at: Principal) -> Float[Array, "*points"]:
        """Return the isochoric strain energy per reference volume."""
        energy = jnp.zeros_like(at.strain[0])
        for mu, alpha in zip(*self, strict=True):
            # expm1 keeps the small-strain energy free of cancellation.
            energy += 2.0 * mu / alpha**2 * jnp.expm1(alpha * at.deviatoric).sum(axis=0)
        return energy

    def stress(self, at: Principal) -> Float[Array, "3 *points"]:
        """Return the stresses T_i of the isochoric first Piola–Kirchhoff stress P = Σ T_i n_i ⊗ N_i."""
        kirchhoff = jnp.zeros_like(at.strain)
        for mu, alpha in zip(*self, strict=True):
            power = jnp.exp(alpha * at.deviatoric)
            kirchhoff += 2.0 * mu / alpha * (power - total(power) / 3.0)
        return kirchhoff / at.stretch

    def response(self, at: Principal) -> tuple[Float[Array, "3 *points"], DyadModuli]:
        """Return the stresses of `stress`, and the moduli of the isochoric part."""
        lam, strain, deviatoric, *_ = at
        kirchhoff, own = jnp.zeros_like(lam), jnp.zeros_like(lam)
        mutual, ratio = ([jnp.zeros_like(lam[0])] * 3 for _ in range(2))
        for mu, alpha in zip(*self, strict=True):
            half = materialised(jnp.exp(0.5 * alpha * deviatoric))
            power = half * half
            mean = total(power) / 3.0
            kirchhoff += 2.0 * mu / alpha * (power - mean)
            # ∂τ_i/∂(ln λ_i), and ∂τ_i/∂(ln λ_j) of each pair.
            own += 2.0 / 3.0 * mu * (power + mean)
            for k, (i, j) in enumerate(PAIRS):
                mutual[k] -= 2.0 / 3.0 * mu * (power[i] + power[j] - mean)
                # (τ_i − τ_j)/(λ_i² − λ_j²), without the factor that all terms share.
                gap = 0.5 * alpha * (deviatoric[i] - deviatoric[j])
                ratio[k] += mu * _sinhc(gap, half[i], half[j])
        shear = [ratio[k] / _sinhc(strain[i] - strain[j], lam[i], lam[j]) for k, (i, j) in enumerate(PAIRS)]
        return kirchhoff / lam, dyad_moduli(at, kirchhoff, own, mutual, shear)


def _sinhc(x: Array, up: Array, down: Array) -> Array:
    """Return sinh(x)/x times up·down, where up/down = exp(x)."""
    small = jnp.abs(x) < _SERIES_BELOW
    square = x * x
    series = 1.0 + square / 6.0 * (1.0 + square / 20.0 * (1.0 + square / 42.0 * (1.0 + square / 72.0)))
    closed = 0.5 * (up * up - down * down) / jnp.where(small, 1.0, x)
    return jnp.where(small, up * down * series, closed)
