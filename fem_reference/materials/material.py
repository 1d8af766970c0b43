"""What all material laws have in common: κ, the tested range of stretch, and checks of the constants."""

import abc
import math
from typing import Protocol, runtime_checkable

import numpy as np
from jax import Array
from jaxtyping import Float

from fem_reference.geometry import BULK_TO_SHEAR, paper_number, paper_numbers, refuse_implausible
from fem_reference.materials.homogeneous import MODES, first_instability
from fem_reference.materials.principal_frame import DyadModuli, Principal

#: Constants of the paper's silicone [Pa]; their ratio is the default of κ over the initial shear modulus.
PAPER_MODULI = paper_numbers("material", "shear_moduli_mpa", 6)
PAPER_BULK_MODULUS = paper_number("material", "bulk_modulus_mpa", 6)


@runtime_checkable
class Isochoric(Protocol):
    """Constants of an isochoric energy as arrays, with its energy, stress and tangent at many points.

    An implementation is a named tuple of arrays, so that compiled functions take it as an argument.
    """

    def energy(self, at: Principal) -> Float[Array, "*points"]:
        """Return the isochoric strain energy per reference volume."""
        ...

    def stress(self, at: Principal) -> Float[Array, "3 *points"]:
        """Return the stresses T_i of the isochoric first Piola–Kirchhoff stress P = Σ T_i n_i ⊗ N_i."""
        ...

    def response(self, at: Principal) -> tuple[Float[Array, "3 *points"], DyadModuli]:
        """Return the stresses of `stress`, and the moduli of the isochoric part."""
        ...


class Material(abc.ABC):
    """Nearly incompressible isotropic hyperelastic solid, W = W_iso(λ̄) + κ/2 (J − 1)², λ̄ = J^(−1/3) λ.

    Attributes
    ----------
    bulk_modulus : κ [Pa].
    stretch_range : least and largest stretch of the tests that the constants were fitted to, or None.
    """

    bulk_modulus: float
    stretch_range: tuple[float, float] | None

    @property
    @abc.abstractmethod
    def shear_modulus(self) -> float:
        """Initial shear modulus [Pa]."""

    @abc.abstractmethod
    def isochoric(self, unit: float) -> Isochoric:
        """Return the isochoric part for compiled code, with stresses in ``unit`` [Pa]."""

    @abc.abstractmethod
    def slope(self, stretches: Float[np.ndarray, "*points 3"]) -> Float[np.ndarray, "*points 3"]:
        """Return ∂W_iso/∂(ln λ_i) of an incompressible deformation, up to a pressure [Pa]."""

    @abc.abstractmethod
    def curvature(self, stretches: Float[np.ndarray, "*points 3"]) -> Float[np.ndarray, "*points 3 3"]:
        """Return ∂²W_iso/∂(ln λ_i) ∂(ln λ_j) of an incompressible deformation [Pa]."""

    def _complete(self, argument: str) -> None:
        """Check the constants, which ``argument`` names, and give κ its default."""
        refuse_implausible(argument, self.shear_modulus)
        if self.bulk_modulus is None:
            # Exactly 100 MPa for the paper's moduli.
            share = self.shear_modulus / sum(PAPER_MODULI)
            object.__setattr__(self, "bulk_modulus", PAPER_BULK_MODULUS * share)
        if not (math.isfinite(self.bulk_modulus) and self.bulk_modulus > 0.0):
            raise ValueError(
                f"bulk_modulus: got {self.bulk_modulus!r}, expected a positive finite number [Pa]"
            )
        refuse_implausible("bulk_modulus", self.bulk_modulus)
        least, most = (ratio * self.shear_modulus for ratio in BULK_TO_SHEAR)
        if not least <= self.bulk_modulus <= most:
            raise ValueError(
                f"bulk_modulus: got {self.bulk_modulus:g} Pa, expected {least:g} to {most:g} Pa with an "
                f"initial shear modulus of {self.shear_modulus:g} Pa; is it in another unit, or of another "
                "material?"
            )
        if self.stretch_range is not None:
            object.__setattr__(self, "stretch_range", _checked_range(self.stretch_range))
            refuse_unstable(self, argument)


def refuse_unstable(material: Material, argument: str) -> None:
    """Raise a ValueError, which names the argument, if a material is not stable in its range of stretch."""
    assert material.stretch_range is not None
    least, most = material.stretch_range
    for mode in MODES:
        unstable = first_instability(material, mode, least, most)
        if unstable is not None:
            raise ValueError(
                f"{argument}: got constants that are unstable by Drucker in {mode} stretch from "
                f"{unstable:.3g} on, expected stability over stretch_range, {least:g} to {most:g}"
            )


def refuse_negative_without_range(
    argument: str, constants: tuple[float, ...], stretch_range: tuple[float, float] | None
) -> None:
    """Raise a ValueError for a negative constant of a law that is then stable in a range alone."""
    if min(constants) < 0.0 and stretch_range is None:
        raise ValueError(
            f"{argument}: got {constants} with a negative one, which is stable in a range of stretch alone; "
            "expected stretch_range too"
        )


def _checked_range(stretch_range: tuple[float, float]) -> tuple[float, float]:
    """Return a range of stretch as two floats."""
    least, most = (float(value) for value in stretch_range)
    if not (0.0 < least <= 1.0 <= most < math.inf and least < most):
        raise ValueError(
            f"stretch_range: got {stretch_range!r}, expected two stretches with one between them: a tensile "
            "test up to 200 % strain is (1, 3)"
        )
    return least, most
