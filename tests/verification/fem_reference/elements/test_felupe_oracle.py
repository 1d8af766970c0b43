"""felupe as an independent oracle: internal force and stiffness of a block of elements.

`SolidBodyNearlyIncompressible` holds one pressure and one dilatation an element, condensed: its internal
force is ∫ ∂ψ/∂F : δF + κ (v/V − 1) ∂v/∂u, and its stiffness, with the pressure that belongs to the
deformation, the derivative of that. This is mean dilatation, algebraically that of linear `SolidElements`.
Kinematics, quadrature, the neo-Hookean solid and the assembly are felupe's own; Ogden's solid, which felupe
has only with one more package, is given to it as its energy in JAX, differentiated automatically.
"""

import felupe  # type: ignore[import-untyped]
import jax
import jax.numpy as jnp
import numpy as np
import pytest
import scipy.sparse as sparse

from fem_reference import Ogden
from fem_reference.elements import SolidElements
from tests.fem_fixtures import assemble, deformed, distorted_block, relative_error

BULK = 100.0
# felupe counts a hexahedron's corners around its bottom and then its top face; ours are in tensor order.
CORNERS = [0, 1, 3, 2, 4, 5, 7, 6]


def oracle(mesh, x, material) -> tuple[np.ndarray, np.ndarray]:
    """Force (nodes, 3) and stiffness (dofs, dofs) of felupe at positions ``x``."""
    region = felupe.RegionHexahedron(felupe.Mesh(mesh.points, mesh.elements[:, CORNERS], "hexahedron"))
    field = felupe.FieldContainer([felupe.Field(region, dim=3)])
    solid = felupe.SolidBodyNearlyIncompressible(material, field, bulk=BULK)
    field[0].values[:] = x - mesh.points
    # The first evaluation carries the element pressures along a linearised step; from the second on they
    # belong to x.
    solid.assemble.vector(field)
    force = solid.assemble.vector(field).toarray().reshape(-1, 3)
    return force, solid.assemble.matrix(field).toarray()


def ours(mesh, x, material) -> tuple[np.ndarray, np.ndarray]:
    elements = SolidElements(mesh, material)
    force, stiffness, *_ = elements.response(x)
    dofs = (3 * elements.connectivity[:, :, None] + np.arange(3)).reshape(len(elements), 24)
    rows, columns = np.repeat(dofs, 24, axis=1).ravel(), np.tile(dofs, (1, 24)).ravel()
    matrix = sparse.coo_matrix((stiffness.ravel(), (rows, columns)), shape=(x.size, x.size))
    return assemble(elements.connectivity, force, len(x)), matrix.toarray()


@pytest.fixture(scope="module")
def mesh():
    return distorted_block(2)


@pytest.fixture(scope="module")
def x(mesh) -> np.ndarray:
    return deformed(mesh.points)


def test_the_neo_hookean_block_is_felupes(mesh, x):
    """ψ = μ/2 (J^(−2/3) tr C − 3) in closed form on both sides: equal but for round-off."""
    mu = 0.1
    expected_force, expected_stiffness = oracle(mesh, x, felupe.NeoHooke(mu=mu))
    force, stiffness = ours(mesh, x, Ogden((mu * 1e6,), (2.0,), BULK * 1e6))
    assert relative_error(force, expected_force) <= 1e-12
    assert relative_error(stiffness, expected_stiffness) <= 1e-12


def ogden(material: Ogden) -> felupe.Material:
    """W = Σ 2 μ_i/α_i² (λ̄1^α_i + λ̄2^α_i + λ̄3^α_i − 3) as a material of felupe's.

    λ̄² are the eigenvalues of J^(−2/3) C, which JAX differentiates exactly as long as they differ.
    """

    def energy(F):
        squared = jnp.linalg.eigvalsh(jnp.linalg.det(F) ** (-2.0 / 3.0) * F.T @ F)
        return sum(
            2.0 * mu / 1e6 / alpha**2 * (jnp.sum(squared ** (alpha / 2.0)) - 3.0)
            for mu, alpha in zip(material.shear_moduli, material.exponents, strict=True)
        )

    def of_every_point(function):
        # felupe keeps points and elements in the last two axes.
        return jax.jit(jax.vmap(jax.vmap(function, 2, -1), 3, -1))

    return felupe.Material(
        stress=lambda x: [np.array(of_every_point(jax.grad(energy))(x[0])), None],
        elasticity=lambda x: [np.array(of_every_point(jax.hessian(energy))(x[0]))],
    )


def test_the_papers_ogden_block_is_felupes(mesh, x):
    material = Ogden(bulk_modulus=BULK * 1e6)
    gradient = SolidElements(mesh, material).deformation_gradient(x)
    squared = np.linalg.eigvalsh(np.swapaxes(gradient, -1, -2) @ gradient)
    apart = np.diff(squared, axis=-1).min()
    assert apart > 1e-3
    expected_force, expected_stiffness = oracle(mesh, x, ogden(material))
    force, stiffness = ours(mesh, x, material)
    # Second derivatives of eigenvalues carry round-off over the square of their distance: 1e-16/(1e-3)².
    assert relative_error(force, expected_force) <= 1e-10
    assert relative_error(stiffness, expected_stiffness) <= 1e-10
