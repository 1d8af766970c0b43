"""All material laws: stress and tangent derive from one energy, objective and isotropic."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from fem_reference import Material, Ogden, Yeoh, mooney_rivlin
from fem_reference.materials import BLOCKS, DyadModuli, Isochoric, half_turned, pressure_moduli, principal
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
# Each of an initial shear modulus near 0.1 MPa; constants of both signs where a law allows them.
LAWS: dict[str, Material] = {
    "the paper's Ogden": Ogden(),
    "Mooney–Rivlin": mooney_rivlin(60e3, -8e3, stretch_range=(1.0, 1.3)),
    "Yeoh 1": Yeoh((50e3,)),
    "Yeoh 2": Yeoh((50e3, 10e3)),
    "Yeoh 3": Yeoh((50e3, -2e3, 1e3), stretch_range=(1.0, 2.0)),
}
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


@pytest.fixture(params=list(LAWS.values()), ids=list(LAWS))
def law(request: pytest.FixtureRequest) -> Material:
    return request.param


def energy(F: np.ndarray, law: Material) -> np.ndarray:
    return np.asarray(_energy(law.isochoric(MPA), points_last(F, 2)))


@jax.jit
def _energy(isochoric: Isochoric, F: jax.Array) -> jax.Array:
    return isochoric.energy(principal(F))


@jax.jit
def _stress(isochoric: Isochoric, F: jax.Array) -> jax.Array:
    at = principal(F)
    return jnp.einsum("ia,a,Ja->iJ", at.after, isochoric.stress(at), at.before)


def response(F: np.ndarray, law: Material) -> tuple[np.ndarray, np.ndarray]:
    """Stress and tangent over the row-major pairs (iJ), (kL), in the axes of the body."""
    return isochoric_tangent(law, MPA, F)


def directions(count: int = 4) -> np.ndarray:
    return np.random.default_rng(1).uniform(-1.0, 1.0, (count, 3, 3))


def test_the_stress_alone_is_that_of_the_response(F, law):
    alone = _stress(law.isochoric(MPA), jnp.asarray(F))
    np.testing.assert_allclose(alone, response(F, law)[0], rtol=0, atol=1e-15)


# Steps of 1e-3 leave (1e-3)⁴/30 of a fifth derivative of order α³ τ, under 1e-9, and a round-off of 1e-13.
STEP = 1e-3


def test_stress_is_the_slope_of_the_energy(F, law):
    stress, _ = response(F, law)
    for H in directions():
        slope = difference(lambda t, H=H: energy(F + t * H, law), STEP)
        # Where the stress vanishes, the shear modulus of 0.1 MPa is its scale.
        assert abs(slope - np.sum(stress * H)) <= 1e-6 * max(np.abs(stress).max(), 0.1)


def test_tangent_is_the_slope_of_the_stress(F, law):
    _, tangent = response(F, law)
    for H in directions():
        slope = difference(lambda t, H=H: response(F + t * H, law)[0], STEP)
        assert relative_error((tangent @ H.ravel()).reshape(3, 3), slope) <= 1e-6


def test_tangent_is_symmetric(F, law):
    assert asymmetry(response(F, law)[1]) <= 1e-10


def test_a_turn_of_the_body_leaves_the_energy_and_turns_the_stress(F, law):
    assert energy(TURN @ F, law) == pytest.approx(energy(F, law), rel=1e-10, abs=1e-15)
    turned, tangent = response(TURN @ F, law)
    stress, reference = response(F, law)
    np.testing.assert_allclose(turned, TURN @ stress, rtol=0, atol=1e-12)
    turn = np.kron(TURN, np.eye(3))
    assert relative_error(tangent, turn @ reference @ turn.T) <= 1e-10


def test_the_response_is_the_same_in_every_direction_of_the_material(F, law):
    assert energy(F @ TURN, law) == pytest.approx(energy(F, law), rel=1e-10, abs=1e-15)
    np.testing.assert_allclose(response(F @ TURN, law)[0], response(F, law)[0] @ TURN, rtol=0, atol=1e-12)


def test_a_change_of_volume_alone_costs_nothing(F, law):
    # λ̄ takes the dilatation out, so that the Kirchhoff stress has no trace.
    assert energy(1.3 * F, law) == pytest.approx(energy(F, law), rel=1e-10, abs=1e-15)
    assert abs(np.trace(response(F, law)[0] @ F.T)) <= 1e-13


def test_a_batch_of_any_shape_gives_what_its_members_give(law):
    batch = np.stack([*GRADIENTS.values()][:6]).reshape(2, 3, 3, 3)
    stress, tangent = response(batch, law)
    assert stress.shape == (2, 3, 3, 3)
    assert tangent.shape == (2, 3, 9, 9)
    for index in np.ndindex(2, 3):
        # Products of batches may be summed in another order.
        np.testing.assert_allclose(stress[index], response(batch[index], law)[0], rtol=1e-12, atol=1e-14)
        np.testing.assert_allclose(tangent[index], response(batch[index], law)[1], rtol=1e-12, atol=1e-14)
        assert energy(batch, law)[index] == pytest.approx(energy(batch[index], law), rel=1e-12, abs=1e-16)


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
