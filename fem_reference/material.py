"""Isochoric Ogden hyperelasticity in principal stretches: energy, stress and tangent, batched.

Everything is exact for equal stretches too: the ratios of differences are written with sinh(x)/x. Stresses
are in the unit of the moduli (MPa inside the FEM).
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from fem_reference.symmetric_eigen import symmetric_eigen

_PAIRS = ((0, 1), (1, 2), (2, 0))


@dataclass(frozen=True)
class Ogden:
    """Nearly incompressible Ogden solid in the form used by the paper (and Abaqus).

    W = Σ_i 2 μ_i/α_i² (λ̄1^α_i + λ̄2^α_i + λ̄3^α_i − 3) + κ/2 (J − 1)², with λ̄ = J^(−1/3) λ, so that the
    initial shear modulus is Σ μ_i. One term with α = 2 is the neo-Hookean solid.

    Parameters
    ----------
    shear_moduli : μ_i [Pa].
    exponents : α_i.
    bulk_modulus : κ [Pa]. The default is 1000 times the initial shear modulus of the paper's silicone.

    References
    ----------
    Ogden (1972), Proc. R. Soc. A 326; the paper's Table II for the values.
    """

    shear_moduli: tuple[float, ...] = (0.00681e6, -0.2881e6, 0.38165e6)
    exponents: tuple[float, ...] = (9.33, 3.376, 2.487)
    bulk_modulus: float = 100e6

    def __post_init__(self) -> None:
        if len(self.shear_moduli) != len(self.exponents) or not self.exponents:
            raise ValueError(
                f"shear_moduli and exponents: got {len(self.shear_moduli)} and {len(self.exponents)} values, "
                "expected as many of one as of the other, at least one"
            )
        if any(a == 0.0 for a in self.exponents):
            raise ValueError(f"exponents: got {self.exponents}, expected none to be zero")
        if not sum(self.shear_moduli) > 0.0:
            raise ValueError(
                f"shear_moduli: got a sum of {sum(self.shear_moduli)} Pa, expected it to be positive"
            )
        if not self.bulk_modulus > 0.0:
            raise ValueError(f"bulk_modulus: got {self.bulk_modulus!r}, expected a positive number [Pa]")

    @property
    def shear_modulus(self) -> float:
        """Initial shear modulus Σ μ_i [Pa]."""
        return sum(self.shear_moduli)


def isochoric_energy(
    material: Ogden, unit: float, deformation_gradient: Float[np.ndarray, "*batch 3 3"]
) -> Float[np.ndarray, "*batch"]:
    """Isochoric strain energy per reference volume, in ``unit`` pascals (1e6 gives MPa)."""
    F = deformation_gradient
    squared, _ = symmetric_eigen(np.swapaxes(F, -1, -2) @ F)
    strain = 0.5 * np.log(squared)
    strain -= strain.mean(axis=-1, keepdims=True)
    energy = np.zeros(F.shape[:-2])
    for mu, alpha in zip(material.shear_moduli, material.exponents, strict=True):
        # expm1 keeps the small-strain energy free of cancellation.
        energy += 2.0 * mu / unit / alpha**2 * np.expm1(alpha * strain).sum(axis=-1)
    return energy


def isochoric_stress(
    material: Ogden, unit: float, deformation_gradient: Float[np.ndarray, "*batch 3 3"]
) -> Float[np.ndarray, "*batch 3 3"]:
    """First Piola–Kirchhoff stress P = ∂W/∂F of the isochoric part; see `isochoric_response`."""
    _, stretch, n, N, deviatoric = _principal(deformation_gradient)
    kirchhoff = np.zeros(stretch.shape)
    for mu, alpha in zip(material.shear_moduli, material.exponents, strict=True):
        power = np.exp(alpha * deviatoric)
        kirchhoff += 2.0 * mu / unit / alpha * (power - power.mean(axis=-1, keepdims=True))
    return (n * (kirchhoff / stretch)[..., None, :]) @ np.swapaxes(N, -1, -2)


def _principal(F: Float[np.ndarray, "*batch 3 3"]) -> tuple[np.ndarray, ...]:
    """Squared stretches, stretches, principal directions after and before, and deviatoric log strains."""
    squared, N = symmetric_eigen(np.swapaxes(F, -1, -2) @ F)
    stretch = np.sqrt(squared)
    strain = np.log(stretch)
    return squared, stretch, (F @ N) / stretch[..., None, :], N, strain - strain.mean(axis=-1, keepdims=True)


def isochoric_response(
    material: Ogden, unit: float, deformation_gradient: Float[np.ndarray, "*batch 3 3"]
) -> tuple[Float[np.ndarray, "*batch 3 3"], Float[np.ndarray, "*batch 9 9"]]:
    """First Piola–Kirchhoff stress P = ∂W/∂F and its tangent ∂P/∂F of the isochoric part.

    With F = Σ λ_i n_i ⊗ N_i, the stress is Σ τ_i/λ_i n_i ⊗ N_i, and the tangent has, in the basis n_i ⊗ N_j,
    one 3×3 block for the stretches and a 2×2 block for each pair i ≠ j (Ogden 1997, Non-linear Elastic
    Deformations, §6.1.4).

    Parameters
    ----------
    material : see `Ogden`.
    unit : pascals per unit of the result.
    deformation_gradient : F.

    Returns
    -------
    stress : P, (…, 3, 3).
    tangent : ∂P_iJ/∂F_kL as a symmetric matrix over the row-major pairs (iJ), (kL).
    """
    squared, stretch, n, N, deviatoric = _principal(deformation_gradient)
    batch = stretch.shape[:-1]
    # Components first, points last: NumPy's inner loops then run over the points.
    lam, square, dev = (np.ascontiguousarray(a.reshape(-1, 3).T) for a in (stretch, squared, deviatoric))
    strain = np.log(lam)
    first, second = np.array(_PAIRS).T
    gap, total = strain[first] - strain[second], strain[first] + strain[second]
    level = dev[first] + dev[second]

    kirchhoff, own, mutual, ratio = (np.zeros(lam.shape) for _ in range(4))
    for mu, alpha in zip(material.shear_moduli, material.exponents, strict=True):
        mu = mu / unit
        power = np.exp(alpha * dev)
        mean = power.mean(axis=0)
        kirchhoff += 2.0 * mu / alpha * (power - mean)
        # ∂τ_i/∂(ln λ_i), and ∂τ_i/∂(ln λ_j) of each pair.
        own += 2.0 / 3.0 * mu * (power + mean)
        mutual -= 2.0 / 3.0 * mu * (power[first] + power[second] - mean)
        # (τ_i − τ_j)/(λ_i² − λ_j²) of each pair, but for what all terms share.
        ratio += mu * np.exp(0.5 * alpha * level) * _sinhc(0.5 * alpha * gap)
    ratio *= np.exp(-total) / _sinhc(gap)
    product = lam[first] * lam[second]
    mean_stress = 0.5 * (kirchhoff[first] + kirchhoff[second])
    mixed = (0.5 * (square[first] + square[second]) * ratio - mean_stress) / product

    frame = np.zeros((lam.shape[1], 9, 9))
    for i in range(3):
        frame[:, 4 * i, 4 * i] = (own[i] - kirchhoff[i]) / square[i]
    for k, (i, j) in enumerate(_PAIRS):
        frame[:, 4 * i, 4 * j] = frame[:, 4 * j, 4 * i] = mutual[k] / product[k]
        here, there = 3 * i + j, 3 * j + i
        frame[:, here, here] = frame[:, there, there] = ratio[k]
        frame[:, here, there] = frame[:, there, here] = mixed[k]

    stress = (n * (kirchhoff.T.reshape(*batch, 3) / stretch)[..., None, :]) @ np.swapaxes(N, -1, -2)
    # Columns of `basis` are the nine dyads n_i ⊗ N_j.
    basis = (n[..., :, None, :, None] * N[..., None, :, None, :]).reshape(*batch, 9, 9)
    tangent = basis @ frame.reshape(*batch, 9, 9) @ np.swapaxes(basis, -1, -2)
    return stress, tangent


def _sinhc(x: np.ndarray | np.float64) -> np.ndarray:
    """sinh(x)/x, exact near zero."""
    small = np.abs(x) < 1e-3
    safe = np.where(small, 1.0, x)
    # Below 1e-3 the series' first omitted term, x⁶/5040, is under 1e-21.
    return np.where(small, 1.0 + x**2 / 6.0 * (1.0 + x**2 / 20.0), np.sinh(safe) / safe)
