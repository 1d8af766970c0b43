"""Hexahedra with mean dilatation: exact derivatives, objectivity, the patch test."""

import numpy as np
import pytest
import scipy.sparse as sparse
import skfem
from scipy.sparse.linalg import splu

from fem_reference import Ogden
from fem_reference.solid import SolidElements
from tests.fem_fixtures import (
    TURN,
    assemble,
    asymmetry,
    deformed,
    difference,
    distorted_block,
    relative_error,
    times,
)


@pytest.fixture(scope="module")
def mesh() -> skfem.MeshHex:
    return distorted_block()


@pytest.fixture(scope="module")
def solid(mesh) -> SolidElements:
    return SolidElements(mesh, Ogden())


@pytest.fixture(scope="module")
def x(mesh) -> np.ndarray:
    return deformed(mesh.p)


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


def test_tangent_is_symmetric(solid, x):
    assert asymmetry(solid.response(x)[1]) <= 1e-10


def test_volume_gradient_is_the_slope_of_the_elements_volumes(solid, x, direction):
    slope = difference(lambda t: solid.dilatation(x + t * direction) * solid.volume, STEP)
    gradient = solid.response(x)[2]
    moved = direction[solid.connectivity].reshape(len(solid), -1)
    # The volume is a cubic in t: no error but round-off.
    assert relative_error(np.einsum("ea,ea->e", gradient, moved), slope) <= 1e-11


def test_a_given_element_pressure_enters_the_tangent_alone(solid, x, direction):
    """∂²v_e/∂x² scales with π_e, and π_e = κ(v_e/V_e − 1) gives the Hessian back."""
    own = solid.bulk_modulus * (solid.dilatation(x) - 1.0)
    force, stiffness, _ = solid.response(x)
    same = solid.response(x, own)
    assert relative_error(same[1], stiffness) <= 1e-13
    shifted = solid.response(x, own + 0.3)
    np.testing.assert_array_equal(shifted[0], force)
    moved = direction[solid.connectivity].reshape(len(solid), -1)
    curved = difference(lambda t: solid.response(x + t * direction)[2], STEP)
    change = np.einsum("eab,eb->ea", shifted[1] - stiffness, moved)
    # Round-off of the bulk stiffness, 100 MPa, over the change, 0.3 MPa.
    assert relative_error(change, 0.3 * curved) <= 1e-10


def test_a_turn_of_everything_leaves_the_energy_and_turns_the_force(solid, x):
    shift = np.array([3.0, -1.0, 2.0])
    turned = x @ TURN.T + shift
    assert solid.energy(turned) == pytest.approx(solid.energy(x), rel=1e-11)
    assert relative_error(forces(solid, turned), forces(solid, x) @ TURN.T) <= 1e-10


def test_a_rigid_motion_of_the_undeformed_body_takes_no_force(solid, mesh):
    turned = mesh.p.T @ TURN.T + [3.0, -1.0, 2.0]
    # Round-off of F, 1e-15, times κ = 100 MPa times facets of 1 mm².
    assert np.abs(forces(solid, turned)).max() <= 1e-12
    assert solid.energy(turned) <= 1e-13


def test_forces_balance(solid, x):
    force = forces(solid, x)
    scale = np.abs(force).max()
    assert np.abs(force.sum(axis=0)).max() <= 1e-12 * scale * len(x)
    assert np.abs(np.cross(x, force).sum(axis=0)).max() <= 1e-11 * scale * len(x)


def test_the_energy_of_a_uniform_dilation_is_that_of_the_bulk(solid, mesh):
    """x = 1.01 X: no isochoric strain, v/V − 1 = 0.030301, so κ/2 · 0.030301² · 6 mm³."""
    assert solid.volume.sum() == pytest.approx(6.0, rel=1e-13)
    assert solid.energy(1.01 * mesh.p.T) == pytest.approx(50.0 * 0.030301**2 * 6.0, rel=1e-10)


def test_patch_of_distorted_elements_under_affine_boundary_motion_deforms_uniformly(solid, mesh):
    A = np.array([[1.15, 0.2, -0.1], [0.05, 0.92, 0.15], [0.1, -0.05, 0.97]])
    affine = mesh.p.T @ A.T
    inside = np.setdiff1d(np.arange(mesh.p.shape[1]), mesh.boundary_nodes())
    assert len(inside) == 8
    free = (3 * inside[:, None] + np.arange(3)).ravel()
    x = affine.copy()
    x[inside] += np.random.default_rng(6).uniform(-0.02, 0.02, (len(inside), 3))
    assert np.abs(solid.deformation_gradient(x) - A).max() > 0.03

    dofs = (3 * solid.connectivity[:, :, None] + np.arange(3)).reshape(len(solid), -1)
    rows, columns = np.repeat(dofs, 24, axis=1).ravel(), np.tile(dofs, (1, 24)).ravel()
    for _ in range(12):
        force, stiffness, _ = solid.response(x)
        residual = assemble(solid.connectivity, force, len(x)).ravel()[free]
        if np.abs(residual).max() <= 1e-12:
            break
        K = sparse.coo_matrix((stiffness.ravel(), (rows, columns)), shape=(x.size, x.size)).tocsc()
        x.reshape(-1)[free] += splu(K[free][:, free]).solve(-residual)
    # A residual of 1e-12 N over a stiffness of 0.03 N/mm leaves nodes within 1e-10 mm of their place.
    assert np.abs(residual).max() <= 1e-12
    np.testing.assert_allclose(
        solid.deformation_gradient(x), np.broadcast_to(A, (27, 8, 3, 3)), atol=1e-10, rtol=0
    )
