"""A made solution: a smooth deformation, the body force that it needs, and how fast the elements find it.

The solid is neo-Hookean and compressible, W = μ/2 (J^(−2/3) tr C − 3) + κ/2 (J − 1)². The body force is
f = −Div ∂W/∂F, by automatic differentiation of the deformation and of the energy, which shares no line with
the elements. Displacements are of order h^(k+1), their gradients of order h^k, for elements of order k.
"""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from fem_reference import Ogden
from fem_reference.mesh import reference_element
from tests.fem_fixtures import boundary_nodes, tensor_mesh
from tests.solid_problem import solve_body

MU, BULK = 0.1, 1.0
MATERIAL = Ogden((MU * 1e6,), (2.0,), BULK * 1e6)


def deformation(X: jax.Array) -> jax.Array:
    """Positions: stretches between 0.84 and 1.17, and shear."""
    x, y, z = X
    return jnp.array(
        [
            x + 0.08 * jnp.sin(2.0 * y) * jnp.cos(z),
            y + 0.06 * jnp.sin(2.5 * x + z),
            z + 0.07 * jnp.cos(2.0 * x) * jnp.sin(1.5 * y),
        ]
    )


def energy(F: jax.Array) -> jax.Array:
    J = jnp.linalg.det(F)
    return 0.5 * MU * (J ** (-2.0 / 3.0) * jnp.sum(F**2) - 3.0) + 0.5 * BULK * (J - 1.0) ** 2


def stress(X: jax.Array) -> jax.Array:
    return jax.grad(energy)(jax.jacfwd(deformation)(X))


@jax.jit
@jax.vmap
def body_force(X: jax.Array) -> jax.Array:
    return -jnp.einsum("iJJ->i", jax.jacfwd(stress)(X))


def errors(order: int, elements: int) -> tuple[float, float]:
    """L² norms of the error of positions and of their gradients over a unit cube."""
    axis = np.linspace(0.0, 1.0, elements * order + 1)
    mesh = tensor_mesh([axis, axis, axis], order)
    reference = reference_element(order)
    corner = mesh.points[mesh.elements]
    places = np.einsum("qa,eai->eqi", reference.values, corner)
    weights = reference.weights / elements**3
    force = np.asarray(body_force(places.reshape(-1, 3))).reshape(places.shape)
    local = np.einsum("q,qa,eqi->eai", weights, reference.values, force)
    load = np.zeros(mesh.points.shape)
    np.add.at(load, mesh.elements, local)
    exact = np.asarray(jax.vmap(deformation)(jnp.asarray(mesh.points)))
    held = np.zeros(mesh.points.shape, dtype=bool)
    held[boundary_nodes(mesh)] = True
    found = solve_body(mesh, MATERIAL, exact, held, load)
    # The interpolant is exact at the nodes, so that the error is measured at the Gauss points.
    there = np.einsum("qa,eai->eqi", reference.values, found.positions[mesh.elements])
    off = there - np.asarray(jax.vmap(deformation)(places.reshape(-1, 3))).reshape(places.shape)
    gradient = np.asarray(jax.vmap(jax.jacfwd(deformation))(places.reshape(-1, 3)))
    strain = found.solid.deformation_gradient(found.positions) - gradient.reshape(*places.shape, 3)
    return (
        float(np.sqrt(np.einsum("q,eqi->", weights, off**2))),
        float(np.sqrt(np.einsum("q,eqij->", weights, strain**2))),
    )


@pytest.mark.parametrize(("order", "meshes"), [(1, (7, 14)), (2, (3, 6))])
def test_errors_fall_at_the_orders_of_the_elements(order, meshes):
    coarse, fine = (np.array(errors(order, n)) for n in meshes)
    observed = np.log2(coarse / fine)
    # At the Gauss points gradients are at least of the order of the elements, often of one more.
    assert observed[0] == pytest.approx(order + 1.0, abs=0.15)
    assert observed[1] >= order - 0.1


def test_the_made_body_force_is_the_divergence_of_the_stress():
    """By central differences of the stress, whose error is step²/6 of its third derivative: some 1e-6."""
    X, step = np.array([0.3, 0.6, 0.2]), 1e-3
    difference = sum(
        (np.asarray(stress(X + step * e)) - np.asarray(stress(X - step * e)))[:, J] / (2.0 * step)
        for J, e in enumerate(np.eye(3))
    )
    np.testing.assert_allclose(np.asarray(body_force(X[None]))[0], -difference, rtol=1e-5)


def test_the_made_deformation_is_a_large_one():
    points = np.random.default_rng(0).uniform(0.0, 1.0, (500, 3))
    stretches = np.linalg.svd(np.asarray(jax.vmap(jax.jacfwd(deformation))(points)), compute_uv=False)
    assert stretches.min() < 0.85
    assert stretches.max() > 1.15
