"""The Ogden solid: its two conventions, its special cases in closed form, and what it refuses."""

import numpy as np
import pytest

from fem_reference import Ogden, Yeoh, mooney_rivlin, neo_hookean
from fem_reference.materials import nominal_stress
from tests.fem_fixtures import TURN, isochoric_tangent, relative_error, rotation

MPA = 1e6
MATERIAL = Ogden()
STRETCHES = np.array([0.6, 0.9, 1.1, 1.5, 2.2])
# Principal stretches of 1.3, 0.9, 1.1 along no coordinate axis, with a change of volume.
F = TURN @ np.diag([1.3, 0.9, 1.1]) @ rotation((-1.0, 0.4, 0.8), 1.9)


def test_the_initial_shear_modulus_is_the_sum_of_the_moduli():
    # The other convention, Σ m_i/α_i (…), would give half of Σ m_i α_i: 0.0200 MPa.
    _, tangent = isochoric_tangent(MATERIAL, MPA, np.eye(3))
    shear = np.zeros((3, 3))
    shear[0, 1] = 1.0
    assert shear.ravel() @ tangent @ shear.ravel() == pytest.approx(0.10036, rel=1e-12)
    assert MATERIAL.shear_modulus == pytest.approx(0.10036e6, rel=1e-12)
    assert MATERIAL.shear_modulus == pytest.approx(0.100e6, rel=5e-3)


def test_constants_of_the_classic_convention_give_half_of_their_sum_with_the_exponents():
    moduli, exponents = (0.05e6, -0.01e6), (2.5, -1.5)
    solid = Ogden.classic(moduli, exponents)
    assert solid.shear_modulus == pytest.approx(0.5 * (0.05e6 * 2.5 + 0.01e6 * 1.5))
    assert solid.classic_moduli == pytest.approx(moduli)
    # Ogden (1972): P = Σ m (λ^(α−1) − λ^(−α/2−1)).
    closed = sum(
        m * (STRETCHES ** (alpha - 1.0) - STRETCHES ** (-alpha / 2.0 - 1.0))
        for m, alpha in zip(moduli, exponents, strict=True)
    )
    np.testing.assert_allclose(nominal_stress(solid, "uniaxial", STRETCHES), closed, rtol=1e-12)


def test_classic_constants_of_another_number_than_exponents_are_refused():
    with pytest.raises(ValueError, match="moduli and exponents: got 1 and 2 values"):
        Ogden.classic((0.1e6,), (2.0, 3.0))


@pytest.mark.parametrize("stretch", [0.6, 1.0, 1.5, 2.2])
def test_uniaxial_tension_of_the_incompressible_solid_follows_its_closed_form(stretch):
    """P = Σ 2 μ_i/α_i (λ^(α_i−1) − λ^(−α_i/2−1)), once the free sides have fixed the pressure."""
    F = np.diag([stretch, stretch**-0.5, stretch**-0.5])
    kirchhoff = isochoric_tangent(MATERIAL, MPA, F)[0] @ F.T
    closed = sum(
        2.0 * mu / MPA / alpha * (stretch ** (alpha - 1.0) - stretch ** (-alpha / 2.0 - 1.0))
        for mu, alpha in zip(MATERIAL.shear_moduli, MATERIAL.exponents, strict=True)
    )
    # Terms of up to 10 MPa cancel at λ = 2.2: round-off of 1e-14.
    assert (kirchhoff[0, 0] - kirchhoff[1, 1]) / stretch == pytest.approx(closed, rel=1e-12, abs=1e-14)


@pytest.mark.parametrize("solid", [neo_hookean(0.1e6), Yeoh((0.05e6,))], ids=["Ogden", "Yeoh"])
def test_the_neo_hookean_solid_follows_its_closed_form(solid):
    """P = μ J^(−2/3) (F − tr C/3 F⁻ᵀ), and its derivative."""
    J, trace = np.linalg.det(F), np.sum(F**2)
    scale, inverse = 0.1 * J ** (-2.0 / 3.0), np.linalg.inv(F).T
    stress, tangent = isochoric_tangent(solid, MPA, F)
    closed = scale * (F - trace / 3.0 * inverse)
    np.testing.assert_allclose(stress, closed, rtol=0, atol=1e-14)
    closed_tangent = (
        -2.0 / 3.0 * np.einsum("iJ,kL->iJkL", closed, inverse)
        + scale * np.einsum("ik,JL->iJkL", np.eye(3), np.eye(3))
        - scale * 2.0 / 3.0 * np.einsum("iJ,kL->iJkL", inverse, F)
        + scale * trace / 3.0 * np.einsum("iL,kJ->iJkL", inverse, inverse)
    )
    assert relative_error(tangent, closed_tangent.reshape(9, 9)) <= 1e-12


def test_the_mooney_rivlin_solid_follows_its_closed_forms():
    """Rivlin (1948): in uniaxial tension P = 2 (λ − 1/λ²) (C10 + C01/λ), and alike in the other modes."""
    c10, c01 = 40e3, 15e3
    solid = mooney_rivlin(c10, c01)
    lam = STRETCHES
    np.testing.assert_allclose(
        nominal_stress(solid, "uniaxial", lam), 2.0 * (lam - lam**-2) * (c10 + c01 / lam), rtol=1e-12
    )
    np.testing.assert_allclose(
        nominal_stress(solid, "planar", lam), 2.0 * (lam - lam**-3) * (c10 + c01), rtol=1e-12
    )
    np.testing.assert_allclose(
        nominal_stress(solid, "biaxial", lam), 2.0 * (lam - lam**-5) * (c10 + c01 * lam**2), rtol=1e-12
    )


@pytest.mark.parametrize(
    ("arguments", "named"),
    [
        ({"shear_moduli": (1e5,)}, "shear_moduli and exponents: got 1 and 3"),
        ({"shear_moduli": (), "exponents": ()}, "at least one"),
        ({"shear_moduli": (1e5,), "exponents": (0.0,)}, "exponents: got"),
        ({"shear_moduli": (-1e5,), "exponents": (2.0,)}, "shear_moduli: got a sum of -100000.0 Pa"),
        ({"shear_moduli": (np.nan,), "exponents": (2.0,)}, "shear_moduli: got a sum of nan"),
        ({"bulk_modulus": 0.0}, "bulk_modulus: got 0.0"),
        ({"bulk_modulus": np.nan}, "bulk_modulus: got nan"),
    ],
)
def test_impossible_constants_are_refused_by_name(arguments, named):
    with pytest.raises(ValueError, match=named):
        Ogden(**arguments)


def test_a_negative_mooney_rivlin_constant_needs_a_range_in_which_it_is_stable():
    with pytest.raises(ValueError, match=r"c10 and c01: got .* expected stretch_range too"):
        mooney_rivlin(60e3, -8e3)
    assert mooney_rivlin(60e3, -8e3, stretch_range=(1.0, 1.3)).shear_modulus == pytest.approx(104e3)
    with pytest.raises(ValueError, match=r"unstable by Drucker in uniaxial stretch from 2\.7"):
        mooney_rivlin(60e3, -8e3, stretch_range=(1.0, 3.0))
