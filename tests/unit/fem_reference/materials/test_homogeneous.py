"""Homogeneous deformation: stresses are those of the finite elements' laws; stability is Drucker's."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from fem_reference import Material, Ogden, Yeoh, mooney_rivlin, neo_hookean
from fem_reference.materials import (
    MODES,
    drucker_matrix,
    first_instability,
    nominal_stress,
    principal_stretches,
    true_stress,
)
from tests.fem_fixtures import isochoric_tangent

LAWS = {
    "Ogden": Ogden(),
    "Mooney–Rivlin": mooney_rivlin(60e3, 8e3),
    "Yeoh": Yeoh((50e3, -2e3, 1e3), stretch_range=(1.0, 2.0)),
}


@pytest.fixture(params=list(LAWS.values()), ids=list(LAWS))
def law(request: pytest.FixtureRequest) -> Material:
    return request.param


@pytest.mark.parametrize("mode", MODES)
@pytest.mark.parametrize("stretch", [0.8, 1.0, 1.001, 1.7])
def test_the_nominal_stress_is_that_of_the_law_of_the_elements(law, mode, stretch):
    """The side that is free of stress tells the pressure: P = (τ_1 − τ_3)/λ."""
    F = np.diag(principal_stretches(mode, stretch))
    kirchhoff = np.diag(isochoric_tangent(law, 1.0, F)[0] @ F.T)
    found = nominal_stress(law, mode, stretch)
    # Terms of 1e6 Pa of the paper's solid cancel.
    assert found == pytest.approx((kirchhoff[0] - kirchhoff[2]) / stretch, rel=1e-12, abs=1e-8)
    assert true_stress(law, mode, stretch) == pytest.approx(stretch * found, rel=1e-14)


@pytest.mark.parametrize("mode", MODES)
def test_the_stress_is_the_slope_of_the_energy_by_the_stretch(law, mode):
    """dW/dλ = P times the number of stretched directions (Ogden 1972)."""
    stretched = sum(power == 1.0 for power in MODES[mode])

    def energy(lam: jax.Array) -> jax.Array:
        strain = jnp.log(lam) * jnp.asarray(MODES[mode])
        isochoric = law.isochoric(1.0)
        if isinstance(law, Yeoh):
            excess = jnp.exp(2.0 * strain).sum() - 3.0
            return sum(c * excess ** (k + 1) for k, c in enumerate(isochoric.constants))
        return sum(
            2.0 * mu / a**2 * (jnp.exp(a * strain).sum() - 3.0) for mu, a in zip(*isochoric, strict=True)
        )

    for stretch in (0.8, 1.4, 2.0):
        slope = jax.grad(energy)(jnp.asarray(stretch))
        assert nominal_stress(law, mode, stretch) == pytest.approx(float(slope) / stretched, rel=1e-10)


def test_the_drucker_matrix_is_the_slope_of_the_stresses_with_one_side_free(law):
    stretches, step = np.array([1.4, 0.9, 1.0 / 1.26]), 1e-4

    def stresses(e1: float, e2: float) -> np.ndarray:
        moved = stretches * np.exp([e1, e2, -e1 - e2])
        slope = law.slope(moved)
        return slope[:2] - slope[2]

    columns = [
        (stresses(step, 0.0) - stresses(-step, 0.0)) / (2.0 * step),
        (stresses(0.0, step) - stresses(0.0, -step)) / (2.0 * step),
    ]
    # Central differences of second order: step² of a third derivative some ten times the matrix.
    np.testing.assert_allclose(drucker_matrix(law, stretches), np.array(columns).T, rtol=1e-5)


@pytest.mark.parametrize("solid", [neo_hookean(1e5), mooney_rivlin(4e4, 1e4), Yeoh((5e4, 1e3, 10.0))])
def test_solids_of_positive_constants_are_stable_at_every_stretch(solid):
    assert all(first_instability(solid, mode, 0.2, 8.0) is None for mode in MODES)


def test_a_stress_that_falls_with_the_stretch_is_an_instability_from_its_peak_on():
    """W = C1 (I1 − 3) + C2 (I1 − 3)², C2 < 0: the true stress of uniaxial tension peaks, which is found."""
    solid = Yeoh((50e3, -2e3), stretch_range=(1.0, 1.2))
    lam = np.linspace(1.0, 3.5, 200_001)
    peak = lam[true_stress(solid, "uniaxial", lam).argmax()]
    assert 1.5 < peak < 3.4
    # Within one of the steps of ln λ at which stability is looked at.
    assert first_instability(solid, "uniaxial", 1.0, 3.5) == pytest.approx(
        peak, rel=2.0 * np.log(3.5) / 400.0
    )
    assert first_instability(solid, "uniaxial", 1.0, 0.99 * peak) is None


def test_a_solid_may_be_stable_in_tension_and_unstable_in_biaxial_stretch():
    solid = mooney_rivlin(60e3, -8e3, stretch_range=(1.0, 1.3))
    assert first_instability(solid, "uniaxial", 1.0, 2.0) is None
    assert 1.3 < first_instability(solid, "biaxial", 1.0, 2.0) < 2.0


@pytest.mark.parametrize(
    ("mode", "stretch", "named"),
    [
        ("shear", 1.2, "mode: got 'shear', expected one of uniaxial, planar, biaxial"),
        ("planar", 0.0, "stretch: got 0"),
    ],
)
def test_an_unknown_mode_and_an_impossible_stretch_are_refused(mode, stretch, named):
    with pytest.raises(ValueError, match=named):
        nominal_stress(Ogden(), mode, stretch)


@pytest.mark.parametrize("stretch_range", [(1.2, 3.0), (1.0, 1.0), (0.0, 2.0), (1.0, np.inf)])
def test_an_impossible_range_of_stretch_is_refused(stretch_range):
    with pytest.raises(ValueError, match="stretch_range: got"):
        neo_hookean(1e5, stretch_range=stretch_range)
