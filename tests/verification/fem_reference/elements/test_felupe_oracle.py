"""felupe as an independent oracle: internal force and stiffness of a block of elements.

`SolidBodyNearlyIncompressible` holds one pressure and one dilatation an element, condensed: its internal
force is ∫ ∂ψ/∂F : δF + κ (v/V − 1) ∂v/∂u, and its stiffness, with the pressure that belongs to the
deformation, the derivative of that. This is mean dilatation, algebraically that of linear `SolidElements`.
Kinematics, quadrature, the neo-Hookean solid and the assembly are felupe's own; the other solids, which
felupe has only with one more package, are given to it as their energies in JAX, differentiated automatically.
"""

from collections.abc import Callable

import felupe  # type: ignore[import-untyped]
import jax
import jax.numpy as jnp
import numpy as np
import pytest
import scipy.sparse as sparse

from fem_reference import Ogden, Yeoh, mooney_rivlin, neo_hookean
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
    force, stiffness = ours(mesh, x, neo_hookean(mu * 1e6, BULK * 1e6))
    assert relative_error(force, expected_force) <= 1e-12
    assert relative_error(stiffness, expected_stiffness) <= 1e-12


def by_energy(energy: Callable[[jax.Array], jax.Array]) -> felupe.Material:
    """A material of felupe's from its energy by F, which JAX differentiates."""

    def of_every_point(function):
        # felupe keeps points and elements in the last two axes.
        return jax.jit(jax.vmap(jax.vmap(function, 2, -1), 3, -1))

    return felupe.Material(
        stress=lambda x: [np.array(of_every_point(jax.grad(energy))(x[0])), None],
        elasticity=lambda x: [np.array(of_every_point(jax.hessian(energy))(x[0]))],
    )


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

    return by_energy(energy)


def classic(moduli: tuple[float, ...], exponents: tuple[float, ...]) -> felupe.Material:
    """W = Σ m_i/α_i (λ̄1^α_i + λ̄2^α_i + λ̄3^α_i − 3), in MPa."""

    def energy(F):
        squared = jnp.linalg.eigvalsh(jnp.linalg.det(F) ** (-2.0 / 3.0) * F.T @ F)
        return sum(
            m / alpha * (jnp.sum(squared ** (alpha / 2.0)) - 3.0)
            for m, alpha in zip(moduli, exponents, strict=True)
        )

    return by_energy(energy)


def mooney_rivlin_by_invariants(c10: float, c01: float) -> felupe.Material:
    """W = C10 (Ī1 − 3) + C01 (Ī2 − 3), in MPa."""

    def energy(F):
        C = jnp.linalg.det(F) ** (-2.0 / 3.0) * F.T @ F
        first = jnp.trace(C)
        return c10 * (first - 3.0) + c01 * (0.5 * (first**2 - jnp.trace(C @ C)) - 3.0)

    return by_energy(energy)


def yeoh_by_invariants(constants: tuple[float, ...]) -> felupe.Material:
    """W = Σ C_k (Ī1 − 3)^k, in MPa."""

    def energy(F):
        excess = jnp.linalg.det(F) ** (-2.0 / 3.0) * jnp.sum(F**2) - 3.0
        return sum(c * excess ** (k + 1) for k, c in enumerate(constants))

    return by_energy(energy)


@pytest.mark.parametrize(
    ("material", "felupes"),
    [
        pytest.param(
            mooney_rivlin(0.04e6, 0.012e6, BULK * 1e6),
            mooney_rivlin_by_invariants(0.04, 0.012),
            id="Mooney–Rivlin",
        ),
        pytest.param(
            mooney_rivlin(0.06e6, -0.008e6, BULK * 1e6, (1.0, 1.3)),
            mooney_rivlin_by_invariants(0.06, -0.008),
            id="Mooney–Rivlin with a negative constant",
        ),
        pytest.param(Yeoh((0.05e6,), BULK * 1e6), yeoh_by_invariants((0.05,)), id="Yeoh 1"),
        pytest.param(Yeoh((0.05e6, 0.01e6), BULK * 1e6), yeoh_by_invariants((0.05, 0.01)), id="Yeoh 2"),
        pytest.param(
            Yeoh((0.05e6, -0.002e6, 0.001e6), BULK * 1e6, (1.0, 2.0)),
            yeoh_by_invariants((0.05, -0.002, 0.001)),
            id="Yeoh 3",
        ),
        pytest.param(
            Ogden.classic((0.05e6, -0.01e6), (2.5, -1.5), BULK * 1e6),
            classic((0.05, -0.01), (2.5, -1.5)),
            id="classic Ogden",
        ),
    ],
)
def test_the_block_of_each_law_is_felupes(mesh, x, material, felupes):
    expected_force, expected_stiffness = oracle(mesh, x, felupes)
    force, stiffness = ours(mesh, x, material)
    assert relative_error(force, expected_force) <= 1e-10
    assert relative_error(stiffness, expected_stiffness) <= 1e-10


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
