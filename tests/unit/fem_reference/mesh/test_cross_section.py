"""The body's mesh: hexahedra only, of the right volume, with the boundaries that the physics needs."""

import dataclasses

import numpy as np
import pytest
from scipy.spatial import cKDTree

from fem_reference import ActuatorGeometry, Ogden
from fem_reference.cell.helical_periodicity import HelicalFrame, HelicalMap
from fem_reference.cell.screw_motion import screw_series
from fem_reference.elements import SolidElements
from fem_reference.mesh import (
    BOTTOM,
    CAVITY,
    CHAMBERS,
    LEVELS,
    OUTER,
    TOP,
    BodyMesh,
    MeshLevel,
    actuator_mesh,
    body_mesh,
    reference_element,
)
from fem_reference.mesh.cross_section import mesh_section
from tests.fem_fixtures import TINY, element_faces, tiny_equations

LENGTH = 3.0


@pytest.fixture(scope="module", params=[1, 2], ids=["linear", "quadratic"])
def mesh(request) -> BodyMesh:
    return tiny_equations(request.param).mesh


def radii(mesh: BodyMesh, boundary: str) -> np.ndarray:
    return np.hypot(*mesh.points[mesh.nodes(boundary), :2].T)


def volume(mesh: BodyMesh) -> float:
    return float(SolidElements(mesh, Ogden()).volume.sum())


def test_the_section_has_the_blocks_that_the_level_asks_for(mesh):
    level = TINY
    chamber_blocks = 3 * (level.inner_arc * level.inner_wall + level.outer_arc * 2)
    partition_blocks = 3 * level.partition_across * (level.inner_wall + level.partition_along + 2)
    layers = round(LENGTH / level.axial_size)
    nodes = (mesh.order + 1) ** 3
    assert mesh.elements.shape == (layers * (chamber_blocks + partition_blocks), nodes)
    np.testing.assert_array_equal(np.unique(mesh.elements), np.arange(len(mesh.points)))


def test_no_element_is_inverted(mesh):
    element = reference_element(mesh.order)
    corners = np.indices((2, 2, 2)).reshape(3, -1).T.astype(float)
    for _, gradients in (element.evaluate(element.points), element.evaluate(corners)):
        mapping = np.einsum("eai,qaj->eqij", mesh.points[mesh.elements], gradients)
        assert np.linalg.det(mapping).min() > 0.0


@pytest.mark.parametrize("order", [1, 2])
def test_the_volume_converges_to_the_bodys(order):
    """At second order by chords, at fourth by parabolas that meet arcs at their ends and middle."""
    geometry = ActuatorGeometry()
    exact = geometry.body_area * 1e6 * LENGTH
    errors = []
    for n in (2, 4, 8):
        fine = body_mesh(geometry, LENGTH * 1e-3, MeshLevel(n, 2 * n, n, 1, 1, 1, 1, 1.5, order))
        errors.append(abs(volume(fine) - exact))
    # Chords cut arcs by shares of φ²/6 + O(φ⁴), parabolas by φ⁴/480 + O(φ⁶), φ being 0.7 rad at most.
    np.testing.assert_allclose(np.log2(np.divide(errors[:-1], errors[1:])), 2.0 * order, atol=0.05)


def test_middle_nodes_lie_on_the_arcs():
    mesh = tiny_equations(2).mesh
    for boundary, radius in ((CAVITY, 1.0), (OUTER, 6.0)):
        grid = mesh.facets[boundary].reshape(-1, 3, 3)
        middle = mesh.points[np.unique(grid[:, 1, 1])]
        # gmsh places nodes on arcs to about 1e-8 mm.
        np.testing.assert_allclose(np.hypot(*middle[:, :2].T), radius, rtol=0, atol=1e-7)


def test_boundaries_cover_the_surface_once(mesh):
    named = np.concatenate([mesh.facets[name] for name in (CAVITY, OUTER, BOTTOM, TOP, *CHAMBERS)])
    faces, count = np.unique(np.sort(element_faces(mesh), axis=1), axis=0, return_counts=True)
    np.testing.assert_array_equal(np.unique(np.sort(named, axis=1), axis=0), faces[count == 1])
    assert len(named) == np.sum(count == 1)
    # Neighbours share whole faces.
    assert count.max() == 2


def test_boundaries_lie_where_their_names_say(mesh):
    np.testing.assert_allclose(radii(mesh, CAVITY), 1.0, atol=1e-7)
    np.testing.assert_allclose(radii(mesh, OUTER), 6.0, atol=1e-7)
    for name, z in ((BOTTOM, 0.0), (TOP, LENGTH)):
        np.testing.assert_allclose(mesh.points[mesh.nodes(name), 2], z, atol=1e-9)
    for k, name in enumerate(CHAMBERS):
        assert radii(mesh, name).min() == pytest.approx(2.5, abs=1e-7)
        assert radii(mesh, name).max() == pytest.approx(5.0, abs=1e-7)
        # A chamber's wall is symmetric about its centre.
        centre = mesh.points[mesh.nodes(name)].mean(axis=0)
        azimuth = np.rad2deg(np.arctan2(centre[1], centre[0]))
        assert azimuth % 360.0 == pytest.approx(120.0 * k, abs=1e-3) or abs(azimuth) < 1e-3
    # Both end faces have the same area.
    area = [mesh.nodal_areas(name).sum() for name in (TOP, BOTTOM)]
    assert area[0] == pytest.approx(area[1], rel=1e-12)


def test_a_layer_of_nodes_lies_on_the_windings_cylinder(mesh):
    on_cylinder = np.isclose(np.hypot(*mesh.points[:, :2].T), 5.6, atol=1e-6)
    level = dataclasses.replace(TINY, order=mesh.order)
    assert on_cylinder.sum() == level.around * (mesh.order * round(LENGTH / TINY.axial_size) + 1)


def test_the_section_is_mirror_symmetric_about_chamber_1(mesh):
    points = mesh.points[mesh.points[:, 2] < 1e-9, :2]
    mirrored = points * [1.0, -1.0]
    distance = np.linalg.norm(points[:, None] - mirrored, axis=2).min(axis=1)
    # gmsh places nodes on arcs to about 1e-8 mm.
    assert distance.max() <= 1e-6


@pytest.mark.parametrize("order", [1, 2])
def test_walls_that_vary_have_their_volume_and_leave_the_outside_round(order):
    level = dataclasses.replace(TINY, order=order)
    geometry = ActuatorGeometry(outer_wall_variation=(0.1, 0.0, -0.2))
    found, equal = (body_mesh(g, 3e-3, level) for g in (geometry, ActuatorGeometry()))
    np.testing.assert_array_equal(found.elements, equal.elements)
    outside = found.nodes("outer")
    np.testing.assert_allclose(found.points[outside], equal.points[outside], atol=1e-6)
    exact = 3e6 * (geometry.body_area - ActuatorGeometry().body_area)
    # TINY's chords of a = 25° miss 1 - sin(a)/a of their sector's area, 3 %; parabolas, far less.
    assert volume(found) - volume(equal) == pytest.approx(exact, rel=0.05 if order == 1 else 1e-3)
    for k, radius in enumerate(geometry.chamber_outer_radii):
        reach = np.hypot(*found.points[found.nodes(CHAMBERS[k]), :2].T).max()
        assert reach == pytest.approx(1e3 * radius, abs=1e-6)


@pytest.mark.parametrize("order", [1, 2])
def test_the_cap_is_solid_but_for_the_cavity(order):
    """Its volume is that of the filled section, of whichever order, times its length."""
    geometry = ActuatorGeometry(body_length=3e-3, cap_length=1.5e-3)
    mesh = actuator_mesh(geometry, dataclasses.replace(TINY, order=order))
    bottom, top = (mesh.nodal_areas(name).sum() for name in (BOTTOM, TOP))
    assert volume(mesh) == pytest.approx(3.0 * bottom + 1.5 * top, rel=1e-12)
    ceilings = 0.0
    for name in CHAMBERS:
        facets = mesh.facets[name]
        flat = facets[np.ptp(mesh.points[facets, 2], axis=1) < 1e-9]
        np.testing.assert_allclose(mesh.points[flat, 2], 3.0, atol=1e-9)
        ceilings += BodyMesh(mesh.points, mesh.elements, {name: flat}).nodal_areas(name).sum()
    assert top == pytest.approx(bottom + ceilings, rel=1e-12)


@pytest.mark.parametrize("name", LEVELS)
def test_the_capped_mesh_has_the_symmetries_of_the_body(name):
    """Turns by 120° and the mirror through chamber 1, of the filled chambers too; nothing is folded."""
    mesh = actuator_mesh(ActuatorGeometry(body_length=2e-3, cap_length=1e-3), LEVELS[name])
    cos, sin = np.cos(2.0 * np.pi / 3.0), np.sin(2.0 * np.pi / 3.0)
    turn = np.array([[cos, -sin, 0.0], [sin, cos, 0.0], [0.0, 0.0, 1.0]])
    for motion in (turn, np.diag([1.0, -1.0, 1.0])):
        distance, image = cKDTree(mesh.points).query(mesh.points @ motion.T)
        # gmsh's arcs are accurate to 3e-8 mm.
        assert distance.max() < 1e-6
        elements = [np.sort(e, axis=1) for e in (mesh.elements, image[mesh.elements])]
        first, second = (e[np.lexsort(e.T)] for e in elements)
        np.testing.assert_array_equal(first, second)
    points = reference_element(mesh.order).points
    _, gradients = reference_element(mesh.order).evaluate(points)
    mapping = np.einsum("eai,qaj->eqij", mesh.points[mesh.elements], gradients)
    assert np.linalg.det(mapping).min() > 0.0


@pytest.mark.parametrize("counts", [(2, 4, 2), (2, 12, 6), (6, 18, 6), (4, 14, 4), (8, 6, 6)])
def test_chambers_are_filled_whatever_the_counts_along_their_sides(counts):
    inner_arc, outer_arc, along = counts
    level = MeshLevel(inner_arc, outer_arc, 2, along, 1, 1, 1, 1.0)
    geometry = ActuatorGeometry()
    section = mesh_section(geometry, level, filled=True)
    for quads, name in zip(section.filling, CHAMBERS, strict=True):
        # As many edges of the filling as of the silicone, on the same nodes.
        sides = np.sort(quads[:, [[0, 1], [1, 3], [3, 2], [2, 0]]].reshape(-1, 2), axis=1)
        once = np.array(
            [s for s, n in zip(*np.unique(sides, axis=0, return_counts=True), strict=True) if n == 1]
        )
        expected = np.unique(np.sort(section.edges[name], axis=1), axis=0)
        np.testing.assert_array_equal(once, expected)
        assert len(once) == inner_arc + outer_arc + 2 * along


def test_counts_that_cannot_be_filled_are_refused():
    with pytest.raises(ValueError, match=r"elements: got \(1, 8, 2\) along the sides"):
        mesh_section(ActuatorGeometry(), MeshLevel(2, 4, 2, 8, 1, 1, 1, 1.0), filled=True)


def test_a_mesh_whose_ends_do_not_match_has_no_helical_map(mesh):
    points = mesh.points.copy()
    points[mesh.nodes(TOP), 0] += 1e-3
    with pytest.raises(ValueError, match=r"^mesh: top and bottom faces differ by 0.001 mm"):
        HelicalMap(dataclasses.replace(mesh, points=points))


@pytest.mark.parametrize("order", [1, 2])
def test_the_next_period_continues_the_mesh_without_a_seam(order):
    """Its hexahedra are those above the bottom face, a period higher; its nodes move with their images."""
    mesh = body_mesh(ActuatorGeometry(), 3e-3, dataclasses.replace(TINY, order=order))
    layer = np.unique(np.round(mesh.points[:, 2], 9))[1]
    helical = HelicalMap(mesh, overlap=0.5 * layer)
    continued = helical.continued
    added = continued.cells[len(mesh.cells) :]
    own = mesh.cells[(mesh.points[mesh.cells, 2] <= layer + 1e-9).all(axis=1)]
    np.testing.assert_allclose(continued.points[added], mesh.points[own] + [0.0, 0.0, 3.0], atol=1e-12)
    # Every place has one node.
    assert len(np.unique(np.round(continued.points, 6), axis=0)) == len(continued.points)
    rest = mesh.points[helical.independent]
    frame = HelicalFrame(helical, rest, screw_series(np.zeros(3), 6.0))
    np.testing.assert_allclose(frame.positions, continued.points, atol=1e-12)


def test_a_thread_that_ends_too_far_into_the_next_period_is_refused(mesh):
    with pytest.raises(ValueError, match=r"^winding: got a period of 3 mm .* expected at most"):
        HelicalMap(mesh, overlap=2.99)
