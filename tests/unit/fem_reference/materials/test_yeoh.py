"""The Yeoh solid: its closed form, the default of κ, and what it refuses."""

import numpy as np
import pytest

from fem_reference import Ogden, Yeoh
from fem_reference.materials import nominal_stress

CONSTANTS = (50e3, 4e3, 0.2e3)


def test_uniaxial_tension_follows_its_closed_form():
    """Yeoh (1993): P = 2 (λ − 1/λ²) Σ k C_k (I1 − 3)^(k−1)."""
    lam = np.array([0.6, 0.9, 1.1, 1.5, 2.2])
    excess = lam**2 + 2.0 / lam - 3.0
    slope = sum(k * c * excess ** (k - 1) for k, c in enumerate(CONSTANTS, 1))
    found = nominal_stress(Yeoh(CONSTANTS), "uniaxial", lam)
    np.testing.assert_allclose(found, 2.0 * (lam - lam**-2) * slope, rtol=1e-12)


def test_kappa_is_by_default_as_many_shear_moduli_as_of_ogdens_solid():
    solid, paper = Yeoh(CONSTANTS), Ogden()
    assert solid.shear_modulus == 100e3
    assert solid.bulk_modulus / solid.shear_modulus == pytest.approx(paper.bulk_modulus / paper.shear_modulus)
    assert Yeoh(CONSTANTS, 50e6).bulk_modulus == 50e6


@pytest.mark.parametrize(
    ("arguments", "named"),
    [
        ({"constants": ()}, "constants: got 0 values, expected one to 3"),
        ({"constants": (1e4, 1e3, 1e2, 1.0)}, "constants: got 4 values"),
        ({"constants": (-1e4,)}, "constants: got a first of -10000.0 Pa"),
        ({"constants": (np.nan,)}, "constants: got a first of nan Pa"),
        ({"constants": (1e4, np.inf)}, "constants: got .* expected finite numbers"),
        ({"constants": (0.11, 0.02)}, "constants: got 0.22 Pa, .*; is it in megapascals"),
        ({"constants": (1e4, -1e2)}, "constants: got .* expected stretch_range too"),
        (
            {"constants": (1e4, -1e3), "stretch_range": (1.0, 3.0)},
            "constants: got constants that are unstable",
        ),
        ({"constants": (1e4,), "bulk_modulus": 1e4}, "bulk_modulus: got 10000 Pa, expected 40000 to"),
    ],
)
def test_impossible_constants_are_refused_by_name(arguments, named):
    with pytest.raises(ValueError, match=named):
        Yeoh(**arguments)
