"""Viscosity of the silicone: dissipation of known motions, what meets no resistance, and a step in time."""

import numpy as np
import pytest

from fem_reference import Ogden
from fem_reference.elements import SolidElements, ViscousSolid
from fem_reference.mesh import BodyMesh
from tests.fem_fixtures import (
    ORDERS,
    TURN,
    assemble,
    asymmetry,
    deformed,
    distorted_block,
    relative_error,
    times,
)

MU = 0.1


@pytest.fixture(scope="module", params=ORDERS)
def mesh(request) -> BodyMesh:
    return distorted_block(2, request.param)


@pytest.fixture(scope="module")
def solid(mesh) -> SolidElements:
    return SolidElements(mesh, Ogden())


@pytest.fixture(scope="module")
def x(mesh) -> np.ndarray:
    return deformed(mesh.points, noise=0.02 / mesh.order)


def rates(velocity_gradient: np.ndarray, x: np.ndarray) -> np.ndarray:
    """Velocities of a uniform velocity gradient."""
    return x @ velocity_gradient.T


def dissipation(solid: SolidElements, x: np.ndarray, velocity: np.ndarray) -> float:
    """∫ 2μ D:D dV."""
    return float(np.sum(velocity * times(solid.connectivity, solid.viscosity(x), velocity)))


def test_the_matrices_are_symmetric_and_positive_semidefinite(solid, x):
    matrices = solid.viscosity(x)
    assert asymmetry(matrices) <= 1e-14
    eigenvalues = np.linalg.eigvalsh(matrices)
    assert np.all(eigenvalues[:, 0] >= -1e-13 * eigenvalues[:, -1])
    # Nothing but rigid motions and dilations is free, of what linear functions describe.
    free = np.sum(eigenvalues < 1e-10 * eigenvalues[:, -1:], axis=1)
    np.testing.assert_array_equal(free, 7)


SPIN = np.array([[0.0, -0.3, 0.8], [0.3, 0.0, -0.5], [-0.8, 0.5, 0.0]])


@pytest.mark.parametrize(
    "motion",
    [lambda x: np.ones_like(x), lambda x: rates(SPIN, x), lambda x: 0.4 * x],
    ids=["shift", "spin", "dilation"],
)
def test_rigid_motions_and_dilations_of_the_deformed_body_meet_no_resistance(solid, x, motion):
    matrices = solid.viscosity(x)
    force = times(solid.connectivity, matrices, motion(x))
    assert np.abs(force).max() <= 1e-13 * np.abs(matrices).max() * np.abs(motion(x)).max()


def test_a_spin_of_the_body_at_rest_is_none_of_the_deformed_one(solid, x, mesh):
    assert dissipation(solid, mesh.points, rates(SPIN, mesh.points)) == pytest.approx(0.0, abs=1e-14)
    # A stretch of 1.2 across one of 0.9, as here, leaves a share of about (0.3)² of 2μ |W|² · 6 mm³.
    assert dissipation(solid, x, rates(SPIN, mesh.points)) > 0.05


def test_uniform_rates_dissipate_twice_the_modulus_times_their_deviators_square(solid, x):
    """With μ = 0.1 MPa and 6 mm³ at rest, at any state: 1.2 N mm times D:D."""
    gradient = np.random.default_rng(3).uniform(-1.0, 1.0, (3, 3))
    D = 0.5 * (gradient + gradient.T)
    D -= np.trace(D) / 3.0 * np.eye(3)
    assert solid.material.shear_modulus == pytest.approx(MU * 1e6, rel=0.01)
    expected = 2.0 * solid.material.shear_modulus / 1e6 * 6.0 * np.sum(D * D)
    for place in (x, 2.0 * x, x @ TURN.T):
        assert dissipation(solid, place, rates(gradient, place)) == pytest.approx(expected, rel=1e-12)


def test_turning_the_body_turns_the_resistance(solid, x):
    velocity = np.random.default_rng(4).uniform(-1.0, 1.0, x.shape)
    force = times(solid.connectivity, solid.viscosity(x), velocity)
    turned = times(solid.connectivity, solid.viscosity(x @ TURN.T), velocity @ TURN.T)
    assert relative_error(turned, force @ TURN.T) <= 1e-12


def test_at_rest_it_is_the_stiffness_of_a_neo_hookean_solids_isochoric_part(mesh):
    solid = SolidElements(mesh, Ogden((MU * 1e6,), (2.0,), 1e6))
    _, stiffness, gradient, _ = solid.response(mesh.points)
    bulk = np.einsum("eja,ejb->eab", gradient, gradient)
    bulk *= (solid.bulk_modulus / solid.volume)[:, None, None]
    assert relative_error(solid.viscosity(mesh.points), stiffness - bulk) <= 1e-12


def test_a_step_in_time_is_resisted_by_its_length_times_the_rate(solid, x):
    move = np.random.default_rng(5).uniform(-1e-2, 1e-2, x.shape)
    resistance = ViscousSolid(solid, x, 0.25)
    force = assemble(solid.connectivity, resistance.force(x + move), len(x))
    expected = 0.25 * times(solid.connectivity, solid.viscosity(x), move)
    assert relative_error(force, expected) <= 1e-12
    np.testing.assert_array_equal(resistance.force(x), 0.0)
    np.testing.assert_array_equal(resistance.matrices, 0.25 * solid.viscosity(x))


def test_resistance_comes_from_an_energy_that_no_step_lowers(solid, x):
    """½ (τ/Δt) (x − x₀)·C (x − x₀), whose slope is the force and whose Hessian is the matrix."""
    move = np.random.default_rng(6).uniform(-1e-2, 1e-2, x.shape)
    resistance = ViscousSolid(solid, x, 2.0)
    half, full = (
        float(np.sum(t * move * assemble(solid.connectivity, resistance.force(x + t * move), len(x))))
        for t in (0.5, 1.0)
    )
    assert full > 0.0
    assert half == pytest.approx(0.25 * full, rel=1e-10)
