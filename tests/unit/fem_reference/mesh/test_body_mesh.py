"""What a mesh tells of itself: facets that face inwards, areas of nodes, linear cells on its nodes."""

import dataclasses

import numpy as np
import pytest
import skfem

from fem_reference import Ogden
from fem_reference.elements import SolidElements
from fem_reference.mesh import BOTTOM, CAVITY, CHAMBERS, OUTER, TOP, BodyMesh, reference_element
from tests.fem_fixtures import (
    SIDES,
    distorted_block,
    element_faces,
    relative_error,
    tensor_mesh,
    tiny_equations,
)


@pytest.fixture(scope="module", params=[1, 2], ids=["linear", "quadratic"])
def order(request) -> int:
    return request.param


@pytest.fixture(scope="module")
def block(order) -> BodyMesh:
    return distorted_block(2, order)


@pytest.fixture(scope="module")
def body(order) -> BodyMesh:
    return tiny_equations(order).mesh


def vector_area(mesh: BodyMesh, facets: np.ndarray) -> np.ndarray:
    """∫ ∂x/∂ξ × ∂x/∂η of each facet, by five Gauss points a side."""
    point, weight = np.polynomial.legendre.leggauss(5)
    s, t = np.meshgrid(0.5 + 0.5 * point, 0.5 + 0.5 * point)
    local = np.column_stack([s.ravel(), t.ravel(), np.zeros(s.size)])
    # On the face z = 0 only its own nodes, the first ones, count.
    slope = reference_element(mesh.order).evaluate(local)[1][:, : facets.shape[1]]
    along, across = (np.einsum("qa,fai->fqi", slope[:, :, i], mesh.points[facets]) for i in (0, 1))
    return np.einsum("q,fqi->fi", np.outer(weight, weight).ravel() / 4.0, np.cross(along, across))


def test_a_box_has_its_order_and_named_sides(order, block):
    assert block.order == order
    assert {name: len(block.facets[name]) for name in SIDES} == dict.fromkeys(SIDES, 4)
    for axis, side in enumerate((3.0, 2.0, 1.0)):
        low, high = SIDES[2 * axis : 2 * axis + 2]
        np.testing.assert_array_equal(block.points[block.nodes(low), axis], 0.0)
        np.testing.assert_array_equal(block.points[block.nodes(high), axis], side)
        assert len(block.nodes(low)) == (2 * order + 1) ** 2


@pytest.mark.parametrize("side", SIDES)
def test_normals_of_a_boxs_sides_point_into_it(block, side):
    """Their vector areas add up to the side's area along the inward axis, however facets were given."""
    inwards = np.eye(3)[SIDES.index(side) // 2] * (1.0 if side.endswith("low") else -1.0)
    area = 6.0 / np.array([3.0, 2.0, 1.0])[SIDES.index(side) // 2]
    grid = block.facets[side].reshape(-1, block.order + 1, block.order + 1)
    turned = dataclasses.replace(
        block, facets={side: np.swapaxes(grid, 1, 2).reshape(block.facets[side].shape)}
    )
    for mesh in (block, turned):
        facets = mesh.oriented(side)
        np.testing.assert_allclose(vector_area(mesh, facets).sum(axis=0), area * inwards, atol=1e-12)
        np.testing.assert_array_equal(np.sort(facets, axis=1), np.sort(mesh.facets[side], axis=1))


@pytest.mark.parametrize("boundary", [CAVITY, OUTER, BOTTOM, TOP, *CHAMBERS])
def test_normals_of_the_bodys_surface_point_into_the_silicone(body, boundary):
    facets = body.oriented(boundary)
    faces = np.sort(element_faces(body), axis=1)
    owner = {tuple(face): i % len(body.elements) for i, face in enumerate(faces.tolist())}
    element = body.elements[[owner[tuple(face)] for face in np.sort(facets, axis=1).tolist()]]
    inwards = body.points[element].mean(axis=1) - body.points[facets].mean(axis=1)
    assert np.einsum("fi,fi->f", vector_area(body, facets), inwards).min() > 0.0


def test_the_bodys_surface_is_closed(body):
    facets = np.concatenate([body.oriented(name) for name in body.facets])
    areas = vector_area(body, facets)
    assert np.abs(areas.sum(axis=0)).max() <= 1e-14 * np.abs(areas).sum()


def test_areas_of_nodes_are_the_integrals_of_their_functions(order):
    """On even rectangles: a quarter each; 1/36 at corners, 4/36 between them, 16/36 in the middle."""
    mesh = tensor_mesh([np.linspace(0.0, side, order + 1) for side in (3.0, 2.0, 1.0)], order)
    rule = {1: [0.5, 0.5], 2: [1.0 / 6.0, 4.0 / 6.0, 1.0 / 6.0]}[order]
    found = mesh.nodal_areas("z low")
    np.testing.assert_allclose(found[mesh.facets["z low"][0]], 6.0 * np.outer(rule, rule).ravel(), rtol=1e-13)
    assert np.count_nonzero(found) == (order + 1) ** 2


def test_areas_of_nodes_have_the_area_and_the_centre_of_a_flat_side(order, block):
    """Exactly, however uneven its facets are; on even ones, with middle nodes, cubics too."""
    inside = np.setdiff1d(block.nodes("z low"), np.concatenate([block.nodes(name) for name in SIDES[:4]]))
    points = block.points.copy()
    amplitude = 0.2 / order
    points[inside, :2] += np.random.default_rng(1).uniform(-amplitude, amplitude, (len(inside), 2))
    uneven = dataclasses.replace(block, points=points)
    for mesh in (block, uneven):
        weight = mesh.nodal_areas("z low")
        x, y, _ = mesh.points.T
        np.testing.assert_allclose([weight.sum(), weight @ x, weight @ y], [6.0, 9.0, 6.0], rtol=1e-13)
    x, y, _ = block.points.T
    cubic = float(block.nodal_areas("z low") @ (x**3 * y))
    exact = 81.0 / 4.0 * 2.0
    # Trapezoids of 1.5 mm are off by h²/12 ∫ 6 x · ∫ y.
    expected = exact if order == 2 else exact + 1.5**2 / 12.0 * 27.0 * 2.0
    assert cubic == pytest.approx(expected, rel=1e-12)


@pytest.mark.parametrize("boundary", [BOTTOM, TOP])
def test_areas_of_the_end_faces_are_the_bodys_volume_over_its_length(body, boundary):
    """Curved facets of a plane too: in ξ and η their density is of third degree at most."""
    volume = SolidElements(body, Ogden()).volume.sum()
    assert body.nodal_areas(boundary).sum() == pytest.approx(volume / 3.0, rel=1e-12)


def test_areas_of_a_cylinders_nodes_converge(order):
    """At second order by chords and at fourth by parabolas, to 2πrL."""
    errors = []
    for n in (6, 12, 24):
        turn = np.linspace(0.0, 0.5 * np.pi, n * order + 1)
        mesh = tensor_mesh([np.linspace(1.0, 2.0, order + 1), turn, np.linspace(0.0, 3.0, order + 1)], order)
        r, angle, z = mesh.points.T
        arc = dataclasses.replace(mesh, points=np.column_stack([r * np.cos(angle), r * np.sin(angle), z]))
        errors.append(abs(arc.nodal_areas("x high").sum() - 3.0 * np.pi))
    np.testing.assert_allclose(np.log2(np.divide(errors[:-1], errors[1:])), 2.0 * order, atol=0.05)


def test_cells_are_the_elements_or_their_eighths(order, block, body):
    for mesh in (block, body):
        assert mesh.cells.shape == (order**3 * len(mesh.elements), 8)
        # Only a quadratic element's own nodes occur in its eight cells, which come one after another.
        own = np.sort(mesh.elements, axis=1)
        within = mesh.cells.reshape(len(mesh.elements), -1)
        assert all(np.isin(cells, nodes).all() for cells, nodes in zip(within, own, strict=True))
    if order == 1:
        np.testing.assert_array_equal(block.cells, block.elements)


def test_cells_fill_the_block(block):
    """They share whole faces, so that moved nodes take from one what they give to another."""
    cells = BodyMesh(block.points, block.cells, {})
    volume = SolidElements(cells, Ogden()).volume
    assert volume.min() > 0.0
    assert volume.sum() == pytest.approx(6.0, rel=1e-13)


def test_cells_of_the_body_are_prisms_over_the_quadrilaterals_of_its_section(body):
    quads = body.quads(BOTTOM)
    np.testing.assert_array_equal(np.unique(quads), body.nodes(BOTTOM))
    cells = BodyMesh(body.points, body.cells, {})
    assert SolidElements(cells, Ogden()).volume.sum() == pytest.approx(
        3.0 * quads_area(body.points[:, :2], quads), rel=1e-13
    )


def quads_area(points: np.ndarray, quads: np.ndarray) -> float:
    """Of quadrilaterals in a plane, by their diagonals."""
    a, b = points[quads[:, 2]] - points[quads[:, 0]], points[quads[:, 3]] - points[quads[:, 1]]
    return 0.5 * float(np.abs(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]).sum())


def test_scikit_fem_takes_the_cells(block):
    """Its own mapping finds the same cells, of positive volume, and the box's surface."""
    linear = block.linear()
    basis = skfem.Basis(linear, skfem.ElementHex1(), intorder=3)
    own = SolidElements(BodyMesh(block.points, block.cells, {}), Ogden()).volume
    assert relative_error(basis.dx.sum(axis=1), own) <= 1e-13
    surface = skfem.FacetBasis(linear, skfem.ElementHex1())
    assert surface.dx.sum() == pytest.approx(2.0 * (6.0 + 3.0 + 2.0), rel=1e-12)
