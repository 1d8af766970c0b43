"""The Ogden solid: stress and tangent derive from one energy, objective, isotropic and the paper's."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from fem_reference import Ogden
from fem_reference.elements.ogden import (
    BLOCKS,
    DyadModuli,
    Moduli,
    half_turned,
    isochoric_energy,
    isochoric_stress,
    pressure_moduli,
    principal,
)
from tests.fem_fixtures import (
    TURN,
    asymmetry,
    difference,
    isochoric_tangent,
    points_last,
    relative_error,
    rotation,
)

MPA = 1e6
MATERIAL = Ogden()
NEO_HOOKEAN = Ogden((0.1e6,), (2.0,))
LEFT, RIGHT = rotation((0.3, 1.0, -0.2), 0.7), rotation((-1.0, 0.4, 0.8), 1.9)


def with_stretches(*stretches: float) -> np.ndarray:
    """F with these principal stretches, along no coordinate axis."""
    return LEFT @ np.diag(stretches) @ RIGHT


GRADIENTS = {
    "random": np.eye(3) + 0.3 * np.random.default_rng(0).uniform(-1.0, 1.0, (3, 3)),
    "undeformed": np.eye(3),
    "turned": TURN,
    "dilated": with_stretches(1.2, 1.2, 1.2),
    "two equal": with_stretches(1.3, 0.9, 0.9),
    "two 1e-9 apart": with_stretches(1.3, 0.9, 0.9 * (1.0 + 1e-9)),
    # The series of sinh(x)/x hands over to the closed form at x = 1e-3: on either side of it.
    "two just below 1e-3 apart": with_stretches(0.8, 1.1 * np.exp(0.999e-3), 1.1),
    "two just above 1e-3 apart": with_stretches(0.8, 1.1 * np.exp(1.001e-3), 1.1),
    "strongly stretched": with_stretches(1.9, 0.55, 1.05),
}


@pytest.fixture(params=list(GRADIENTS.values()), ids=list(GRADIENTS))
def F(request: pytest.FixtureRequest) -> np.ndarray:
    return request.param


def moduli(material: Ogden) -> Moduli:
    return Moduli(jnp.asarray(material.shear_moduli) / MPA, jnp.asarray(material.exponents))


def energy(F: np.ndarray, material: Ogden = MATERIAL) -> np.ndarray:
    return np.asarray(_energy(moduli(material), points_last(F, 2)))


@jax.jit
def _energy(moduli: Moduli, F: jax.Array) -> jax.Array:
    return isochoric_energy(moduli, principal(F))


@jax.jit
def _stress(moduli: Moduli, F: jax.Array) -> jax.Array:
    at = principal(F)
    return jnp.einsum("ia,a,Ja->iJ", at.after, isochoric_stress(moduli, at), at.before)


def response(F: np.ndarray, material: Ogden = MATERIAL) -> tuple[np.ndarray, np.ndarray]:
    """Stress and tangent over the row-major pairs (iJ), (kL), in the axes of the body."""
    return isochoric_tangent(material, MPA, F)


def directions(count: int = 4) -> np.ndarray:
    return np.random.default_rng(1).uniform(-1.0, 1.0, (count, 3, 3))


def test_the_stress_alone_is_that_of_the_response(F):
    alone = _stress(moduli(MATERIAL), jnp.asarray(F))
    np.testing.assert_allclose(alone, response(F)[0], rtol=0, atol=1e-15)


# Steps of 1e-3 leave (1e-3)⁴/30 of a fifth derivative of order α³ τ, under 1e-9, and a round-off of 1e-13.
STEP = 1e-3


def test_stress_is_the_slope_of_the_energy(F):
    stress, _ = response(F)
    for H in directions():
        slope = difference(lambda t, H=H: energy(F + t * H), STEP)
        # Where the stress vanishes, the shear modulus of 0.1 MPa is its scale.
        assert abs(slope - np.sum(stress * H)) <= 1e-6 * max(np.abs(stress).max(), 0.1)


def test_tangent_is_the_slope_of_the_stress(F):
    _, tangent = response(F)
    for H in directions():
        slope = difference(lambda t, H=H: response(F + t * H)[0], STEP)
        assert relative_error((tangent @ H.ravel()).reshape(3, 3), slope) <= 1e-6


def test_tangent_is_symmetric(F):
    assert asymmetry(response(F)[1]) <= 1e-10


def test_a_turn_of_the_body_leaves_the_energy_and_turns_the_stress(F):
    assert energy(TURN @ F) == pytest.approx(energy(F), rel=1e-10, abs=1e-15)
    turned, tangent = response(TURN @ F)
    stress, reference = response(F)
    np.testing.assert_allclose(turned, TURN @ stress, rtol=0, atol=1e-12)
    turn = np.kron(TURN, np.eye(3))
    assert relative_error(tangent, turn @ reference @ turn.T) <= 1e-10


def test_the_response_is_the_same_in_every_direction_of_the_material(F):
    assert energy(F @ TURN) == pytest.approx(energy(F), rel=1e-10, abs=1e-15)
    np.testing.assert_allclose(response(F @ TURN)[0], response(F)[0] @ TURN, rtol=0, atol=1e-12)


def test_a_change_of_volume_alone_costs_nothing(F):
    # λ̄ takes the dilatation out, so that the Kirchhoff stress has no trace.
    assert energy(1.3 * F) == pytest.approx(energy(F), rel=1e-10, abs=1e-15)
    assert abs(np.trace(response(F)[0] @ F.T)) <= 1e-13


def test_a_batch_of_any_shape_gives_what_its_members_give():
    batch = np.stack([*GRADIENTS.values()][:6]).reshape(2, 3, 3, 3)
    stress, tangent = response(batch)
    assert stress.shape == (2, 3, 3, 3)
    assert tangent.shape == (2, 3, 9, 9)
    for index in np.ndindex(2, 3):
        # Products of batches may be summed in another order.
        np.testing.assert_allclose(stress[index], response(batch[index])[0], rtol=1e-12, atol=1e-14)
        np.testing.assert_allclose(tangent[index], response(batch[index])[1], rtol=1e-12, atol=1e-14)
        assert energy(batch)[index] == pytest.approx(energy(batch[index]), rel=1e-12, abs=1e-16)


def test_the_initial_shear_modulus_is_the_sum_of_the_moduli():
    # The other common form, Σ μ_i/α_i (…), would give half of Σ μ_i α_i: 0.0200 MPa.
    _, tangent = response(np.eye(3))
    shear = np.zeros((3, 3))
    shear[0, 1] = 1.0
    assert shear.ravel() @ tangent @ shear.ravel() == pytest.approx(0.10036, rel=1e-12)
    assert MATERIAL.shear_modulus == pytest.approx(0.10036e6, rel=1e-12)
    assert MATERIAL.shear_modulus == pytest.approx(0.100e6, rel=5e-3)


@pytest.mark.parametrize("stretch", [0.6, 1.0, 1.5, 2.2])
def test_uniaxial_tension_of_the_incompressible_solid_follows_its_closed_form(stretch):
    """P = Σ 2 μ_i/α_i (λ^(α_i−1) − λ^(−α_i/2−1)), once the free sides have fixed the pressure."""
    F = np.diag([stretch, stretch**-0.5, stretch**-0.5])
    kirchhoff = response(F)[0] @ F.T
    closed = sum(
        2.0 * mu / MPA / alpha * (stretch ** (alpha - 1.0) - stretch ** (-alpha / 2.0 - 1.0))
        for mu, alpha in zip(MATERIAL.shear_moduli, MATERIAL.exponents, strict=True)
    )
    # Terms of up to 10 MPa cancel at λ = 2.2: round-off of 1e-14.
    assert (kirchhoff[0, 0] - kirchhoff[1, 1]) / stretch == pytest.approx(closed, rel=1e-12, abs=1e-14)


def test_one_term_of_exponent_two_is_the_neo_hookean_solid(F):
    """W = μ/2 (J^(−2/3) tr C − 3), P = μ J^(−2/3) (F − tr C/3 F⁻ᵀ)."""
    J, trace = np.linalg.det(F), np.sum(F**2)
    scale = 0.1 * J ** (-2.0 / 3.0)
    assert energy(F, NEO_HOOKEAN) == pytest.approx(0.5 * (scale * trace - 0.3), rel=1e-12, abs=1e-16)
    inverse = np.linalg.inv(F).T
    stress, tangent = response(F, NEO_HOOKEAN)
    closed = scale * (F - trace / 3.0 * inverse)
    np.testing.assert_allclose(stress, closed, rtol=0, atol=1e-14)
    closed_tangent = (
        -2.0 / 3.0 * np.einsum("iJ,kL->iJkL", closed, inverse)
        + scale * np.einsum("ik,JL->iJkL", np.eye(3), np.eye(3))
        - scale * 2.0 / 3.0 * np.einsum("iJ,kL->iJkL", inverse, F)
        + scale * trace / 3.0 * np.einsum("iL,kJ->iJkL", inverse, inverse)
    )
    assert relative_error(tangent, closed_tangent.reshape(9, 9)) <= 1e-12


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


@pytest.mark.parametrize("mirror", [1.0, -1.0], ids=["as it is", "inside out"])
def test_the_pressures_moduli_are_the_second_derivative_of_the_determinant(F, mirror):
    """Of an element turned inside out, which Newton's method may pass through, as of any other."""
    F = F @ np.diag([1.0, 1.0, mirror])
    pressure, at = 0.7, principal(jnp.asarray(F))
    across = pressure_moduli(at, jnp.asarray(np.linalg.det(F)), jnp.asarray(pressure))
    blocks = half_turned(DyadModuli(jnp.zeros(6), across, -across), at.after)
    second = pressure * jax.hessian(jnp.linalg.det)(jnp.asarray(F))
    turned = np.einsum("iJkL,Ja,Lb->ikab", second, at.before, at.before)
    # Eigenvectors to round-off of the squares of F.
    for (i, k), block in zip(BLOCKS, blocks, strict=True):
        np.testing.assert_allclose(block, turned[i, k], rtol=0, atol=1e-13)
