"""Inflation of a thick neo-Hookean tube in plane strain, against its closed form, at the elements' orders."""

import numpy as np
import pytest

from fem_reference import Ogden
from fem_reference.algebra import SparsePattern, default_solver
from fem_reference.elements import Chamber, SolidElements
from fem_reference.mesh import BodyMesh
from tests.fem_fixtures import assemble, tensor_mesh

INNER, OUTER = 1.0, 2.0
MU = 0.1
# The wall's volume changes in proportion to 1/κ, and so does the radius, but for shares of (p/κ)² = 2e-9.
BULK = (1e3, 1e4)
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


def tube(n: int, order: int) -> BodyMesh:
    """Whole tube of n elements through the wall, 6n around and one along its length of 0.5 mm."""
    around = 6 * n * order
    box = tensor_mesh(
        [
            np.linspace(INNER, OUTER, n * order + 1),
            np.linspace(0.0, 2.0 * np.pi, around + 1),
            np.linspace(0.0, 0.5, order + 1),
        ],
        order,
    )
    # Close the ring: nodes at the end of the second axis are those at its start.
    r, angle, z = box.points.T
    turn = np.rint(angle / (2.0 * np.pi) * around).astype(int)
    start = np.arange(len(box.points))
    start[turn == around] = np.flatnonzero(turn == 0)
    kept = np.flatnonzero(turn < around)
    number = np.full(len(box.points), -1)
    number[kept] = np.arange(len(kept))
    points = np.column_stack([r * np.cos(angle), r * np.sin(angle), z])[kept]
    return BodyMesh(points, number[start[box.elements]], {"inner": number[start[box.facets["x low"]]]})


def inflate(mesh: BodyMesh, pressure: float, bulk: float) -> np.ndarray:
    """Positions under the follower pressure, by Newton's method in five load steps.

    The element pressures of the tangent follow the linearised volumes, which keeps it from overshooting.
    """
    solid = SolidElements(mesh, Ogden((MU * 1e6,), (2.0,), bulk * 1e6))
    patches = Chamber(mesh, "inner").patches
    # Plane strain; and the symmetry planes, which hold the tube in place.
    held = np.zeros(mesh.points.shape, dtype=bool)
    held[:, 2] = True
    held[np.abs(mesh.points[:, 0]) < 1e-9, 0] = True
    held[np.abs(mesh.points[:, 1]) < 1e-9, 1] = True
    free = np.flatnonzero(~held.ravel())
    number = np.full(held.size, -1)
    number[free] = np.arange(len(free))
    groups = {"solid": solid, **{f"wall {k}": patch for k, patch in enumerate(patches)}}
    dofs = {
        name: number[3 * group.connectivity[:, :, None] + np.arange(3)].reshape(len(group.connectivity), -1)
        for name, group in groups.items()
    }
    none = np.empty(0, np.int64)
    pattern, solver = SparsePattern(len(free), dofs, (none, none)), default_solver()
    x, element_pressure = mesh.points.copy(), np.zeros((len(solid), solid.modes))
    for load in np.linspace(0.2, 1.0, 5) * pressure:
        for _ in range(25):
            force, stiffness, volume_gradient, constitutive = solid.response(x, element_pressure)
            residual = assemble(solid.connectivity, force, len(x))
            data = np.zeros(len(pattern))
            pattern.add_group(data, "solid", stiffness)
            for k, patch in enumerate(patches):
                residual -= load * assemble(patch.connectivity, patch.gradient(x), len(x))
                pattern.add_group(data, f"wall {k}", -load * patch.hessian(x))
            if np.abs(residual.ravel()[free]).max() <= 1e-10:
                break
            solver.factorise(pattern.matrix(data), pattern.revision)
            step = np.zeros(x.shape)
            step.reshape(-1)[free] = solver.solve(-residual.ravel()[free, None])[:, 0]
            element_pressure = solid.pressure_after(constitutive, volume_gradient, step)
            x += step
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


def inner_radius(mesh: BodyMesh, pressure: float, bulk: float) -> float:
    """Of the circle that has the area inside the deformed tube."""
    x = inflate(mesh, pressure, bulk)
    side = mesh.order + 1
    corners = mesh.facets["inner"].reshape(-1, side, side)[:, [0, 0, -1, -1], [0, -1, 0, -1]]
    # Every element of the ring moves alike.
    assert np.ptp(np.hypot(*x[corners.ravel(), :2].T)) <= 1e-8
    return float(np.sqrt(Chamber(mesh, "inner").volume(x) / (0.5 * np.pi)))


@pytest.mark.parametrize(
    ("order", "counts", "spread"), [(1, (2, 4, 8), 0.05), (2, (2, 3, 4), 0.5)], ids=["linear", "quadratic"]
)
def test_the_inner_radius_converges_to_the_closed_form(order, counts, spread):
    """At order 2k, as work functionals do: the pressure's work is that of the volume inside."""
    pressure = closed_form_pressure(TARGET)
    errors = []
    for n in counts:
        soft, stiff = (inner_radius(tube(n, order), pressure, bulk) for bulk in BULK)
        incompressible = stiff + (stiff - soft) / (BULK[1] / BULK[0] - 1.0)
        errors.append(abs(incompressible - TARGET))
    orders = np.diff(np.log(errors)) / np.diff(np.log(np.divide(1.0, counts)))
    # Quadratic elements come to theirs from above: with 2, 3, 4 and 6 of them 4.4, 4.2 and 4.1 were found.
    np.testing.assert_allclose(orders, 2.0 * order, rtol=0, atol=spread)
