"""Inflation of a thick neo-Hookean tube in plane strain, against its closed form, at second order."""

import numpy as np
import pytest
import scipy.sparse as sparse
import skfem
from scipy.sparse.linalg import splu

from fem_reference import Ogden
from fem_reference.chamber import Chamber
from fem_reference.solid import SolidElements
from tests.fem_fixtures import assemble

INNER, OUTER = 1.0, 2.0
MU, BULK = 0.1, 1e4
# Inner radius 1.5 times that at rest.
TARGET = 1.5


def closed_form_pressure(a: float) -> float:
    """Pressure that inflates the incompressible tube to the inner radius ``a``.

    With r² = R² + c, c = a² − A², the hoop stretch is r/R and σ_θ − σ_r = μ (r²/R² − R²/r²). Equilibrium,
    p = ∫_a^b (σ_θ − σ_r)/r dr, gives p = μ [ln(r²/(r² − c)) (−1/2) − c/(2 r²)] between a and b.
    """
    c = a**2 - INNER**2
    b = np.sqrt(OUTER**2 + c)

    def primitive(r: float) -> float:
        return 0.5 * np.log((r**2 - c) / r**2) - 0.5 * c / r**2

    return float(MU * (primitive(b) - primitive(a)))


def tube(n: int) -> skfem.MeshHex:
    """Whole tube of n elements through the wall, 6n around and one along its length of 0.5 mm."""
    mesh = skfem.MeshHex.init_tensor(
        np.linspace(INNER, OUTER, n + 1), np.linspace(0.0, 1.0, 6 * n + 1), np.array([0.0, 0.5])
    )
    # Close the ring: nodes at the end of the second axis are those at its start.
    start: dict[tuple[float, float, float], int] = {}
    keys = np.round(mesh.p, 9).T
    for i, (r, turn, z) in enumerate(keys):
        start[r, turn % 1.0, z] = min(start.get((r, turn % 1.0, z), i), i)
    target = np.array([start[r, turn % 1.0, z] for r, turn, z in keys])
    used, renumbered = np.unique(target, return_inverse=True)
    r, turn, z = mesh.p[:, used]
    points = np.array([r * np.cos(2.0 * np.pi * turn), r * np.sin(2.0 * np.pi * turn), z])
    closed = skfem.MeshHex(points, np.ascontiguousarray(renumbered[mesh.t]))
    inner = closed.facets_satisfying(lambda x: np.hypot(x[0], x[1]) < INNER + 1e-3, boundaries_only=True)
    return closed.with_boundaries({"inner": inner})


def inflate(mesh: skfem.MeshHex, pressure: float) -> np.ndarray:
    """Positions under the follower pressure, by Newton's method in ten load steps.

    The element pressures of the tangent follow the linearised volumes, which keeps it from overshooting.
    """
    solid = SolidElements(mesh, Ogden((MU * 1e6,), (2.0,), BULK * 1e6))
    chamber = Chamber(mesh, "inner")
    rest = mesh.p.T
    # Plane strain; and the symmetry planes, which hold the tube in place.
    held = np.zeros(rest.shape, dtype=bool)
    held[:, 2] = True
    held[np.abs(rest[:, 0]) < 1e-9, 0] = True
    held[np.abs(rest[:, 1]) < 1e-9, 1] = True
    free = np.flatnonzero(~held.ravel())
    groups = (solid.connectivity, chamber.triangles)
    dofs = [(3 * nodes[:, :, None] + np.arange(3)).reshape(len(nodes), -1) for nodes in groups]
    rows = np.concatenate([np.repeat(d, d.shape[1], axis=1).ravel() for d in dofs])
    columns = np.concatenate([np.tile(d, (1, d.shape[1])).ravel() for d in dofs])
    x, element_pressure = rest.copy(), np.zeros(len(solid))
    for load in np.linspace(0.1, 1.0, 10) * pressure:
        for _ in range(25):
            force, stiffness, volume_gradient = solid.response(x, element_pressure)
            residual = assemble(solid.connectivity, force, len(x))
            residual -= load * assemble(chamber.triangles, chamber.gradient(x), len(x))
            if np.abs(residual.ravel()[free]).max() <= 1e-10:
                break
            values = np.concatenate([stiffness.ravel(), -load * chamber.hessian(x).ravel()])
            K = sparse.coo_matrix((values, (rows, columns)), shape=(x.size, x.size)).tocsc()
            step = np.zeros(x.size)
            step[free] = -splu(K[free][:, free]).solve(residual.ravel()[free])
            growth = np.einsum("ea,ea->e", volume_gradient, step[dofs[0]]) / solid.volume
            element_pressure = solid.bulk_modulus * (solid.dilatation(x) - 1.0 + growth)
            x += step.reshape(-1, 3)
        assert np.abs(residual.ravel()[free]).max() <= 1e-10
    return x


def test_the_closed_form_is_the_integral_of_its_stresses():
    c = TARGET**2 - INNER**2
    point, weight = np.polynomial.legendre.leggauss(40)
    a, b = TARGET, np.sqrt(OUTER**2 + c)
    r = 0.5 * (a + b) + 0.5 * (b - a) * point
    stress = MU * (r**2 / (r**2 - c) - (r**2 - c) / r**2)
    integral = 0.5 * (b - a) * np.sum(weight * stress / r)
    assert closed_form_pressure(TARGET) == pytest.approx(integral, rel=1e-12)


def test_the_inner_radius_converges_to_the_closed_form_at_second_order():
    pressure = closed_form_pressure(TARGET)
    errors = []
    for n in (2, 4, 8):
        mesh = tube(n)
        x = inflate(mesh, pressure)
        inner = np.hypot(*mesh.p[:2]) < INNER + 1e-9
        radius = np.hypot(x[inner, 0], x[inner, 1])
        # Every node of the ring moves alike: the chords turn into one another.
        assert np.ptp(radius) <= 1e-8
        errors.append(abs(radius.mean() - TARGET))
    # A bulk modulus of 1e5 μ lets the wall's volume change by p/κ = 4e-6, and the radius by about as much:
    # less than a hundredth of the last error.
    assert errors[-1] > 4e-4
    orders = np.log2(np.divide(errors[:-1], errors[1:]))
    np.testing.assert_allclose(orders, 2.0, atol=0.2)
