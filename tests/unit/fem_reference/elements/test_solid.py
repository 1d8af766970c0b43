"""Hexahedra with a condensed pressure, of both orders: exact derivatives, objectivity, the patch test."""

import dataclasses

import numpy as np
import pytest
import scipy.sparse as sparse
from scipy.sparse.linalg import splu

from fem_reference import Ogden
from fem_reference.elements import SolidElements
from fem_reference.mesh import BodyMesh
from tests.fem_fixtures import (
    ORDERS,
    TURN,
    assemble,
    asymmetry,
    boundary_nodes,
    deformed,
    difference,
    distorted_block,
    relative_error,
    tensor_mesh,
    times,
)


@pytest.fixture(scope="module", params=ORDERS)
def mesh(request) -> BodyMesh:
    return distorted_block(3, request.param)


@pytest.fixture(scope="module")
def solid(mesh) -> SolidElements:
    return SolidElements(mesh, Ogden())


@pytest.fixture(scope="module")
def x(mesh) -> np.ndarray:
    return deformed(mesh.points, noise=0.02 / mesh.order)


@pytest.fixture(scope="module")
def direction(x) -> np.ndarray:
    return np.random.default_rng(5).uniform(-1.0, 1.0, x.shape)


# Positions move by at most 1e-3 mm of an element's 0.3 mm: the fourth-order differences lose (3e-3)⁴ = 1e-10
# of the stiffness at this step, and 1e-13 of it to round-off.
STEP = 1e-3


def forces(solid: SolidElements, x: np.ndarray) -> np.ndarray:
    return assemble(solid.connectivity, solid.response(x)[0], len(x))


def test_force_is_the_slope_of_the_energy(solid, x, direction):
    slope = difference(lambda t: solid.energy(x + t * direction), STEP)
    assert np.sum(forces(solid, x) * direction) == pytest.approx(float(slope), rel=1e-6)


def test_tangent_is_the_slope_of_the_force(solid, x, direction):
    slope = difference(lambda t: forces(solid, x + t * direction), STEP)
    assert relative_error(times(solid.connectivity, solid.response(x)[1], direction), slope) <= 1e-6


def test_the_force_alone_is_that_of_the_response(solid, x):
    force, constitutive = solid.force(x)
    response = solid.response(x)
    assert relative_error(force, response[0]) <= 1e-13
    # A rounding of det F is 1e-14 MPa of κ = 100 MPa.
    np.testing.assert_allclose(constitutive, solid.bulk_modulus * solid.dilatation(x), rtol=0, atol=1e-12)
    np.testing.assert_allclose(response[3], constitutive, rtol=0, atol=1e-12)


def test_tangent_is_symmetric(solid, x):
    assert asymmetry(solid.response(x)[1]) <= 1e-10


def test_pressure_modes_are_one_and_for_quadratic_elements_three_more(solid, mesh):
    assert solid.modes == {1: 1, 2: 4}[mesh.order]
    assert solid.dilatation(mesh.points).shape == (27, solid.modes)


def test_the_first_dilatation_is_the_growth_of_the_elements_volumes(solid, mesh, x):
    grown = SolidElements(dataclasses.replace(mesh, points=x), solid.material).volume
    np.testing.assert_allclose(solid.dilatation(x)[:, 0], grown / solid.volume - 1.0, rtol=0, atol=1e-13)


def test_dilatations_are_the_projection_of_a_field_on_functions_linear_in_place():
    """x = X (1 + aX): det F − 1 = 2aX on a unit cube, which is a of 1, and 2a/√12 of √12 (X − ½)."""
    a = 0.1
    mesh = tensor_mesh([np.linspace(0.0, 1.0, 3)] * 3, order=2)
    moved = mesh.points * [1.0, 1.0, 1.0] + a * mesh.points**2 * [1.0, 0.0, 0.0]
    found = SolidElements(mesh, Ogden()).dilatation(moved)[0]
    np.testing.assert_allclose(found, [a, 2.0 * a / np.sqrt(12.0), 0.0, 0.0], rtol=0, atol=1e-14)


def test_the_volumetric_energy_is_that_of_the_projected_dilatation(mesh, x):
    """κ enters nothing else: energies of two bulk moduli differ by Δκ/2 Σ V_e ϑ²."""
    soft, stiff = (SolidElements(mesh, Ogden(bulk_modulus=k)) for k in (1e6, 5e6))
    squares = (soft.dilatation(x) ** 2).sum(axis=1)
    assert stiff.energy(x) - soft.energy(x) == pytest.approx(2.0 * float(soft.volume @ squares), rel=1e-12)


def test_volume_gradients_are_the_slopes_of_the_dilatations(solid, x, direction):
    slope = difference(
        lambda t: solid.dilatation(x + t * direction) * solid.volume[:, None],
        STEP,
    )
    gradient = solid.response(x)[2]
    moved = direction[solid.connectivity].reshape(len(solid), -1)
    # A determinant is a cubic in t: no error but round-off.
    assert relative_error(np.einsum("eja,ea->ej", gradient, moved), slope) <= 1e-11


def test_a_given_element_pressure_enters_the_tangent_alone(solid, x, direction):
    """∂²(V_e ϑ_j)/∂x² scales with π_j, and π_j = κ ϑ_j gives the Hessian back."""
    own = solid.bulk_modulus * solid.dilatation(x)
    force, stiffness, *_ = solid.response(x)
    same = solid.response(x, own)
    assert relative_error(same[1], stiffness) <= 1e-13
    added = np.array([0.3, -0.2, 0.1, 0.25])[: solid.modes]
    shifted = solid.response(x, own + added)
    np.testing.assert_array_equal(shifted[0], force)
    moved = direction[solid.connectivity].reshape(len(solid), -1)
    curved = difference(lambda t: solid.response(x + t * direction)[2], STEP)
    change = np.einsum("eab,eb->ea", shifted[1] - stiffness, moved)
    # Round-off of the bulk stiffness, 100 MPa, over the change, 0.3 MPa.
    assert relative_error(change, np.einsum("j,eja->ea", added, curved)) <= 1e-10


def test_the_pressure_after_a_step_is_the_bulk_modulus_times_the_linearised_dilatation(solid, x, direction):
    *_, gradient, constitutive = solid.response(x)
    step = 1e-3 * direction
    slope = difference(lambda t: solid.dilatation(x + t * step), 1.0)
    expected = solid.bulk_modulus * (solid.dilatation(x) + slope)
    assert relative_error(solid.pressure_after(constitutive, gradient, step), expected) <= 1e-10


def test_nodes_share_the_volume(solid, mesh):
    """Their shares add up to it, and on even elements their first moments do too."""
    assert solid.nodal_volumes.sum() == pytest.approx(6.0, rel=1e-13)
    even = distorted_block(3, mesh.order, amplitude=0.0)
    shares = SolidElements(even, solid.material).nodal_volumes
    np.testing.assert_allclose(shares @ even.points, [9.0, 6.0, 3.0], rtol=1e-13)


def test_a_turn_of_everything_leaves_the_energy_and_turns_the_force(solid, x):
    shift = np.array([3.0, -1.0, 2.0])
    turned = x @ TURN.T + shift
    assert solid.energy(turned) == pytest.approx(solid.energy(x), rel=1e-11)
    assert relative_error(forces(solid, turned), forces(solid, x) @ TURN.T) <= 1e-10


def test_a_rigid_motion_of_the_undeformed_body_takes_no_force(solid, mesh):
    turned = mesh.points @ TURN.T + [3.0, -1.0, 2.0]
    # Round-off of F, 1e-15, times κ = 100 MPa times facets of 1 mm².
    assert np.abs(forces(solid, turned)).max() <= 1e-12
    assert solid.energy(turned) <= 1e-13


def test_forces_balance(solid, x):
    force = forces(solid, x)
    scale = np.abs(force).max()
    assert np.abs(force.sum(axis=0)).max() <= 1e-12 * scale * len(x)
    assert np.abs(np.cross(x, force).sum(axis=0)).max() <= 1e-11 * scale * len(x)


def test_the_energy_of_a_uniform_dilation_is_that_of_the_bulk(solid, mesh):
    """x = 1.01 X: no isochoric strain, det F − 1 = 0.030301, so κ/2 · 0.030301² · 6 mm³."""
    assert solid.volume.sum() == pytest.approx(6.0, rel=1e-13)
    assert solid.energy(1.01 * mesh.points) == pytest.approx(50.0 * 0.030301**2 * 6.0, rel=1e-10)


def test_patch_of_distorted_elements_under_affine_boundary_motion_deforms_uniformly(solid, mesh):
    A = np.array([[1.15, 0.2, -0.1], [0.05, 0.92, 0.15], [0.1, -0.05, 0.97]])
    affine = mesh.points @ A.T
    inside = np.setdiff1d(np.arange(len(affine)), boundary_nodes(mesh))
    assert len(inside) == (3 * mesh.order - 1) ** 3
    free = (3 * inside[:, None] + np.arange(3)).ravel()
    x = affine.copy()
    x[inside] += np.random.default_rng(6).uniform(-0.02, 0.02, (len(inside), 3)) / mesh.order**2
    assert np.abs(solid.deformation_gradient(x) - A).max() > 0.03

    dofs = (3 * solid.connectivity[:, :, None] + np.arange(3)).reshape(len(solid), -1)
    size = dofs.shape[1]
    rows, columns = np.repeat(dofs, size, axis=1).ravel(), np.tile(dofs, (1, size)).ravel()
    # Element pressures of the tangent follow the linearised dilatations, as in `newton`: others overshoot.
    pressure = np.zeros((len(solid), solid.modes))
    for _ in range(12):
        force, stiffness, volume_gradient, constitutive = solid.response(x, pressure)
        residual = assemble(solid.connectivity, force, len(x)).ravel()[free]
        if np.abs(residual).max() <= 1e-12:
            break
        K = sparse.coo_matrix((stiffness.ravel(), (rows, columns)), shape=(x.size, x.size)).tocsc()
        step = np.zeros(x.shape)
        step.reshape(-1)[free] = splu(K[free][:, free]).solve(-residual)
        pressure = solid.pressure_after(constitutive, volume_gradient, step)
        x += step
    # A residual of 1e-12 N over a stiffness of 0.03 N/mm leaves nodes within 1e-10 mm of their place.
    assert np.abs(residual).max() <= 1e-12
    F = solid.deformation_gradient(x)
    np.testing.assert_allclose(F, np.broadcast_to(A, F.shape), atol=1e-10, rtol=0)
