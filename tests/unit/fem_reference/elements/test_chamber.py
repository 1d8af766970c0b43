"""A closed chamber's volume: closed forms, exact derivatives, and the balance of pressure on it."""

import dataclasses

import numpy as np
import pytest

from fem_reference import ActuatorGeometry, Ogden
from fem_reference.cell.equations import CellEquations
from fem_reference.elements import Chamber, SolidElements
from fem_reference.mesh import CHAMBERS, BodyMesh, MeshLevel, body_mesh
from tests.fem_fixtures import (
    TINY,
    TURN,
    assemble,
    asymmetry,
    bent_configuration,
    deformed,
    difference,
    relative_error,
    times,
    tiny_equations,
)

LENGTH = 3.0
GEOMETRY = ActuatorGeometry()
INNER, OUTER = GEOMETRY.chamber_inner_radius * 1e3, GEOMETRY.chamber_outer_radius * 1e3


@pytest.fixture(scope="module", params=[1, 2], ids=["linear", "quadratic"])
def cell(request) -> CellEquations:
    return tiny_equations(request.param)


@pytest.fixture(scope="module")
def mesh(cell) -> BodyMesh:
    return cell.mesh


@pytest.fixture(scope="module", params=range(3), ids=CHAMBERS)
def chamber(request, cell) -> Chamber:
    return cell.chambers[request.param]


@pytest.fixture(scope="module")
def x(mesh) -> np.ndarray:
    return deformed(mesh.points / 6.0) * 6.0


@pytest.fixture(scope="module")
def direction(x) -> np.ndarray:
    return np.random.default_rng(3).uniform(-1.0, 1.0, x.shape)


def gradient(chamber: Chamber, x: np.ndarray) -> np.ndarray:
    """∂V/∂x of the whole chamber, (nodes, 3)."""
    return sum(assemble(patch.connectivity, patch.gradient(x), len(x)) for patch in chamber.patches)


def meshed_area(order: int) -> float:
    """Area of a chamber whose arcs are replaced by chords, or by parabolas through their middle [mm²].

    Fans of triangles from the rod's axis over the outer arc, less those over the inner arc and the two
    triangles between the axis and the sides. A parabola cuts off two thirds of its chord times its height.
    """
    half = [GEOMETRY.chamber_half_angle(r * 1e-3) for r in (INNER, OUTER)]
    fan = []
    for n, r, a in zip((TINY.inner_arc, TINY.outer_arc), (INNER, OUTER), half, strict=True):
        turn = 2.0 * a / n
        triangle = 0.5 * r**2 * np.sin(turn)
        parabola = 2.0 / 3.0 * 2.0 * r * np.sin(0.5 * turn) * r * (1.0 - np.cos(0.5 * turn))
        fan.append(n * (triangle + (parabola if order == 2 else 0.0)))
    # The outer corner stands at a larger azimuth from the chamber's centre than the inner one.
    side = 0.5 * INNER * OUTER * np.sin(half[1] - half[0])
    return float(fan[1] - fan[0] - 2.0 * side)


def test_the_undeformed_volume_is_that_of_the_meshed_section(chamber, mesh):
    expected = LENGTH * meshed_area(mesh.order)
    # gmsh places arcs' nodes by a numerical parametrisation, good to 1e-7 mm.
    assert chamber.volume(mesh.points) == pytest.approx(expected, rel=1e-7)


@pytest.mark.parametrize("order", [1, 2])
def test_the_volume_converges_to_the_closed_form(order):
    exact = GEOMETRY.chamber_area * 1e6 * LENGTH
    errors = []
    for n in (2, 4, 8):
        mesh = body_mesh(GEOMETRY, LENGTH * 1e-3, MeshLevel(n, 2 * n, 1, 1, 1, 1, 1, 1.5, order))
        errors.append(abs(Chamber(mesh, "chamber1").volume(mesh.points) - exact))
    # Chords cut arcs by shares of φ²/6 + O(φ⁴), parabolas by φ⁴/480 + O(φ⁶), with φ = 0.36 and 0.44 on the
    # first mesh.
    np.testing.assert_allclose(np.log2(np.divide(errors[:-1], errors[1:])), 2.0 * order, atol=0.05)


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


def test_what_the_chambers_gain_the_silicone_loses(cell, mesh):
    """Between a cavity and an outside that stay, and flat ends; the silicone's volume is by Gauss's rule."""
    x = mesh.points.copy()
    radius = np.hypot(x[:, 0], x[:, 1])
    moving = (x[:, 2] > 1e-6) & (x[:, 2] < LENGTH - 1e-6) & (radius > 1.1) & (radius < 5.9)
    amplitude = 0.15 / mesh.order
    x[moving] += np.random.default_rng(4).uniform(-amplitude, amplitude, (moving.sum(), 3))
    solid = SolidElements(mesh, Ogden())
    at_rest = np.array([c.volume(mesh.points) for c in cell.chambers])
    gained = np.array([c.volume(x) for c in cell.chambers]) - at_rest
    lost = -float(solid.volume @ solid.dilatation(x)[:, 0])
    assert np.abs(gained).min() > 0.01
    # Round-off of 200 mm³.
    assert gained.sum() == pytest.approx(lost, abs=1e-11)


def test_gradient_is_the_slope_of_the_volume(chamber, x, direction):
    # The volume is a cubic in t, which the differences take exactly: only round-off is left.
    slope = difference(lambda t: chamber.volume(x + t * direction), 1e-2)
    assert np.sum(gradient(chamber, x) * direction) == pytest.approx(float(slope), rel=1e-10)


def test_hessian_is_the_symmetric_slope_of_the_gradient(chamber, x, direction):
    slope = difference(lambda t: gradient(chamber, x + t * direction), 1e-2)
    hessians = [patch.hessian(x) for patch in chamber.patches]
    product = sum(
        times(patch.connectivity, hessian, direction)
        for patch, hessian in zip(chamber.patches, hessians, strict=True)
    )
    assert relative_error(product, slope) <= 1e-10
    assert max(asymmetry(hessian) for hessian in hessians) <= 1e-14


def test_rigid_motions_keep_the_volume_and_dilations_cube_it(chamber, x):
    volume = chamber.volume(x)
    # A shift of 100 mm has the determinants cancel: round-off of 1e-16 · 100³ mm³ over 40 mm³.
    assert chamber.volume(x + np.array([100.0, -50.0, 20.0])) == pytest.approx(volume, rel=1e-10)
    assert chamber.volume(x @ TURN.T) == pytest.approx(volume, rel=1e-12)
    assert chamber.volume(1.3 * x) == pytest.approx(1.3**3 * volume, rel=1e-12)


def test_pressure_on_the_closed_surface_has_no_resultant(chamber, x):
    found = gradient(chamber, x)
    scale = np.abs(found).sum()
    assert np.abs(found.sum(axis=0)).max() <= 1e-14 * scale
    assert np.abs(np.cross(x, found).sum(axis=0)).max() <= 1e-13 * scale


def test_the_fans_apex_drops_out_on_a_helically_periodic_cell(cell, chamber, mesh, x):
    """The apex is the section's node of the smallest x; in a section turned by 180°, of the largest."""
    turned = dataclasses.replace(mesh, points=mesh.points * [-1.0, -1.0, 1.0])
    other = Chamber(turned, CHAMBERS[cell.chambers.index(chamber)])
    assert not np.isin(other.patches[1].connectivity[:, 0], chamber.patches[1].connectivity[:, 0]).any()
    bent = cell.all_positions(bent_configuration(cell, [0.006, -0.02, 0.004], noise=0.02))
    assert other.volume(bent) == pytest.approx(chamber.volume(bent), rel=1e-13)
    # Fans that close nothing but warped cuts differ.
    assert abs(other.volume(x) - chamber.volume(x)) > 1e-3


def test_moving_the_wall_outwards_enlarges_the_chamber():
    # Radially outwards, at the outer arc of chamber 1: ∂/∂R of the polygon's fan, less a triangle at either
    # side, whose middle node stays.
    mesh = tiny_equations().mesh
    chamber = tiny_equations().chambers[0]
    nodes = np.unique(chamber.quads)
    outer = nodes[np.hypot(*mesh.points[nodes, :2].T) > 5.0 - 1e-6]
    push = np.zeros(mesh.points.shape)
    push[outer, :2] = mesh.points[outer, :2] / 5.0
    half = [GEOMETRY.chamber_half_angle(r) for r in (2.5e-3, 5e-3)]
    n = TINY.outer_arc
    expected = n * 5.0 * np.sin(2.0 * half[1] / n) - 0.5 * 2.5 * np.sin(half[1] - half[0])
    assert np.sum(gradient(chamber, mesh.points) * push) == pytest.approx(LENGTH * expected, rel=1e-7)
