"""A closed chamber's volume: closed forms, exact derivatives, and the balance of pressure on it."""

import numpy as np
import pytest
import skfem

from fem_reference import ActuatorGeometry
from fem_reference.chamber import Chamber
from fem_reference.mesh import body_mesh
from fem_reference.section import CHAMBERS, MeshLevel
from tests.fem_fixtures import (
    TINY,
    TURN,
    assemble,
    asymmetry,
    deformed,
    difference,
    relative_error,
    times,
)

LENGTH = 3.0
GEOMETRY = ActuatorGeometry()


@pytest.fixture(scope="module")
def mesh(equations) -> skfem.MeshHex:
    return equations.mesh


@pytest.fixture(scope="module", params=range(3), ids=CHAMBERS)
def chamber(request, equations) -> Chamber:
    return equations.chambers[request.param]


@pytest.fixture(scope="module")
def x(mesh) -> np.ndarray:
    return deformed(mesh.p / 6.0) * 6.0


@pytest.fixture(scope="module")
def direction(x) -> np.ndarray:
    return np.random.default_rng(3).uniform(-1.0, 1.0, x.shape)


def polygonal_area(inner_arc: int, outer_arc: int) -> float:
    """Area of a chamber whose arcs are replaced by chords [mm²].

    Fans of triangles from the rod's axis over the outer arc, less those over the inner arc and the two
    triangles between the axis and the sides.
    """
    inner, outer = GEOMETRY.chamber_inner_radius * 1e3, GEOMETRY.chamber_outer_radius * 1e3
    half = [GEOMETRY.chamber_half_angle(r * 1e-3) for r in (inner, outer)]
    fan = [
        0.5 * n * r**2 * np.sin(2.0 * a / n)
        for n, r, a in zip((inner_arc, outer_arc), (inner, outer), half, strict=True)
    ]
    # The outer corner stands at a larger azimuth from the chamber's centre than the inner one.
    side = 0.5 * inner * outer * np.sin(half[1] - half[0])
    return fan[1] - fan[0] - 2.0 * side


def test_the_undeformed_volume_is_that_of_the_polygonal_section(chamber, mesh):
    expected = LENGTH * polygonal_area(TINY.inner_arc, TINY.outer_arc)
    # gmsh places arcs' nodes by a numerical parametrisation, good to 1e-7 mm.
    assert chamber.volume(mesh.p.T) == pytest.approx(expected, rel=1e-7)


def test_the_volume_converges_to_the_closed_form_at_second_order():
    exact = GEOMETRY.chamber_area * 1e6 * LENGTH
    errors = []
    for n in (2, 4, 8):
        mesh = body_mesh(GEOMETRY, LENGTH * 1e-3, MeshLevel(n, 2 * n, 1, 1, 1, 1, 1, 1.5))
        errors.append(abs(Chamber(mesh, "chamber1").volume(mesh.p.T) - exact))
    # Chords cut arcs by shares of φ²/6 + O(φ⁴) with φ = 0.36 and 0.44 on the first mesh.
    np.testing.assert_allclose(np.log2(np.divide(errors[:-1], errors[1:])), 2.0, atol=0.05)


def test_the_closed_form_of_the_area_is_its_integral():
    """∫ r · 2 (60° − asin(t/2r)) dr by Gauss–Legendre quadrature: about 932 mm³ over the whole length."""
    inner, outer = GEOMETRY.chamber_inner_radius, GEOMETRY.chamber_outer_radius
    point, weight = np.polynomial.legendre.leggauss(20)
    radius = 0.5 * (inner + outer) + 0.5 * (outer - inner) * point
    spans = np.array([2.0 * GEOMETRY.chamber_half_angle(r) for r in radius])
    assert GEOMETRY.chamber_area == pytest.approx(
        0.5 * (outer - inner) * np.sum(weight * radius * spans), rel=1e-12
    )
    assert GEOMETRY.chamber_area * GEOMETRY.body_length * 1e9 == pytest.approx(932.0, rel=5e-3)


def test_the_volume_of_bilinear_walls_is_the_divergence_theorems(chamber, mesh):
    """V = (1/3)∮ x·n dA by quadrature over the isoparametric wall; flat ends add L/3 of the top's area."""
    x = mesh.p.T.copy()
    inner = (x[:, 2] > 1e-6) & (x[:, 2] < LENGTH - 1e-6)
    x[inner] += np.random.default_rng(4).uniform(-0.15, 0.15, (inner.sum(), 3))
    moved = skfem.MeshHex(np.ascontiguousarray(x.T), mesh.t)
    facets = {tuple(sorted(f)): i for i, f in enumerate(moved.facets.T)}
    wall = np.array([facets[tuple(sorted(q))] for q in chamber.quads])
    basis = skfem.FacetBasis(moved, skfem.ElementHex1(), facets=wall, intorder=6)
    # Normals leave the solid, and so point into the chamber.
    through_wall = -skfem.Functional(lambda w: sum(w.x[i] * w.n[i] for i in range(3)) / 3.0).assemble(basis)
    top = LENGTH * polygonal_area(TINY.inner_arc, TINY.outer_arc) / 3.0
    # x·n dA is a polynomial of degree 3 a direction on a bilinear facet: integrated exactly.
    assert chamber.volume(x) == pytest.approx(through_wall + top, rel=1e-7)


def test_gradient_is_the_slope_of_the_volume(chamber, x, direction):
    gradient = assemble(chamber.triangles, chamber.gradient(x), len(x))
    # The volume is a cubic in t, which the differences take exactly: only round-off is left.
    slope = difference(lambda t: chamber.volume(x + t * direction), 1e-2)
    assert np.sum(gradient * direction) == pytest.approx(float(slope), rel=1e-10)


def test_hessian_is_the_symmetric_slope_of_the_gradient(chamber, x, direction):
    hessian = chamber.hessian(x)
    slope = difference(
        lambda t: assemble(chamber.triangles, chamber.gradient(x + t * direction), len(x)), 1e-2
    )
    assert relative_error(times(chamber.triangles, hessian, direction), slope) <= 1e-10
    assert asymmetry(hessian) <= 1e-15


def test_rigid_motions_keep_the_volume_and_dilations_cube_it(chamber, x):
    volume = chamber.volume(x)
    # A shift of 100 mm has the determinants cancel: round-off of 1e-16 · 100³ mm³ over 40 mm³.
    assert chamber.volume(x + np.array([100.0, -50.0, 20.0])) == pytest.approx(volume, rel=1e-10)
    assert chamber.volume(x @ TURN.T) == pytest.approx(volume, rel=1e-12)
    assert chamber.volume(1.3 * x) == pytest.approx(1.3**3 * volume, rel=1e-12)


def test_pressure_on_the_closed_surface_has_no_resultant(chamber, x):
    gradient = assemble(chamber.triangles, chamber.gradient(x), len(x))
    scale = np.abs(gradient).sum()
    assert np.abs(gradient.sum(axis=0)).max() <= 1e-14 * scale
    assert np.abs(np.cross(x, gradient).sum(axis=0)).max() <= 1e-13 * scale


def test_moving_the_wall_outwards_enlarges_the_chamber(equations):
    # Radially outwards, at the outer arc of chamber 1: ∂/∂R of the polygon's fan, less a triangle at either
    # side, whose middle node stays.
    mesh = equations.mesh
    chamber = equations.chambers[0]
    nodes = np.unique(chamber.quads)
    outer = nodes[np.hypot(*mesh.p[:2, nodes]) > 5.0 - 1e-6]
    push = np.zeros((mesh.p.shape[1], 3))
    push[outer, :2] = mesh.p[:2, outer].T / 5.0
    gradient = assemble(chamber.triangles, chamber.gradient(mesh.p.T), len(push))
    half = [GEOMETRY.chamber_half_angle(r) for r in (2.5e-3, 5e-3)]
    n = TINY.outer_arc
    expected = n * 5.0 * np.sin(2.0 * half[1] / n) - 0.5 * 2.5 * np.sin(half[1] - half[0])
    assert np.sum(gradient * push) == pytest.approx(LENGTH * expected, rel=1e-7)
