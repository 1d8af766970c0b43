"""The body's mesh: hexahedra only, of the right volume, with the boundaries that the physics needs."""

import numpy as np
import pytest
import skfem

from fem_reference import ActuatorGeometry
from fem_reference.helical import HelicalMap
from fem_reference.mesh import BOTTOM, TOP, body_mesh
from fem_reference.section import CAVITY, CHAMBERS, OUTER, MeshLevel
from tests.fem_fixtures import TINY

LENGTH = 3.0


@pytest.fixture(scope="module")
def mesh(equations) -> skfem.MeshHex:
    return equations.mesh


def radii(mesh: skfem.MeshHex, boundary: str) -> np.ndarray:
    return np.hypot(*mesh.p[:2, np.unique(mesh.facets[:, mesh.boundaries[boundary]])])


def area(mesh: skfem.MeshHex, boundary: str) -> float:
    basis = skfem.FacetBasis(mesh, skfem.ElementHex1(), facets=boundary)
    return float(skfem.Functional(lambda w: 1.0 + 0.0 * w.x[0]).assemble(basis))


def test_the_section_has_the_blocks_that_the_level_asks_for(mesh):
    level = TINY
    chamber_blocks = 3 * (level.inner_arc * level.inner_wall + level.outer_arc * 2)
    partition_blocks = 3 * level.partition_across * (level.inner_wall + level.partition_along + 2)
    layers = round(LENGTH / level.axial_size)
    assert mesh.t.shape == (8, layers * (chamber_blocks + partition_blocks))


def test_no_element_is_inverted(mesh):
    basis = skfem.Basis(mesh, skfem.ElementHex1(), intorder=3)
    determinant = basis.mapping.detDF(basis.X)
    assert determinant.min() > 0.0


def test_the_volume_converges_to_the_bodys_at_second_order():
    geometry = ActuatorGeometry()
    exact = geometry.body_area * 1e6 * LENGTH
    errors = []
    for n in (2, 4, 8):
        fine = body_mesh(geometry, LENGTH * 1e-3, MeshLevel(n, 2 * n, n, 1, 1, 1, 1, 1.5))
        errors.append(abs(skfem.Basis(fine, skfem.ElementHex1(), intorder=2).dx.sum() - exact))
    # Chords cut arcs by shares of φ²/6 + O(φ⁴), φ being 0.7 rad at most.
    np.testing.assert_allclose(np.log2(np.divide(errors[:-1], errors[1:])), 2.0, atol=0.05)


def test_boundaries_cover_the_surface_once(mesh):
    named = np.concatenate([mesh.boundaries[name] for name in (CAVITY, OUTER, BOTTOM, TOP, *CHAMBERS)])
    np.testing.assert_array_equal(np.sort(named), np.sort(mesh.boundary_facets()))


def test_boundaries_lie_where_their_names_say(mesh):
    np.testing.assert_allclose(radii(mesh, CAVITY), 1.0, atol=1e-7)
    np.testing.assert_allclose(radii(mesh, OUTER), 6.0, atol=1e-7)
    for name, z in ((BOTTOM, 0.0), (TOP, LENGTH)):
        np.testing.assert_allclose(mesh.p[2, np.unique(mesh.facets[:, mesh.boundaries[name]])], z, atol=1e-9)
    for k, name in enumerate(CHAMBERS):
        assert radii(mesh, name).min() == pytest.approx(2.5, abs=1e-7)
        assert radii(mesh, name).max() == pytest.approx(5.0, abs=1e-7)
        # A chamber's wall is symmetric about its centre.
        centre = mesh.p[:, np.unique(mesh.facets[:, mesh.boundaries[name]])].mean(axis=1)
        azimuth = np.rad2deg(np.arctan2(centre[1], centre[0]))
        assert azimuth % 360.0 == pytest.approx(120.0 * k, abs=1e-3) or abs(azimuth) < 1e-3
    # Both end faces have the same area.
    assert area(mesh, TOP) == pytest.approx(area(mesh, BOTTOM), rel=1e-12)


def test_a_layer_of_nodes_lies_on_the_windings_cylinder(mesh):
    on_cylinder = np.isclose(np.hypot(*mesh.p[:2]), 5.6, atol=1e-6)
    assert on_cylinder.sum() == TINY.around * (round(LENGTH / TINY.axial_size) + 1)


def test_the_section_is_mirror_symmetric_about_chamber_1(mesh):
    points = mesh.p[:2, mesh.p[2] < 1e-9].T
    mirrored = points * [1.0, -1.0]
    distance = np.linalg.norm(points[:, None] - mirrored, axis=2).min(axis=1)
    # gmsh places nodes on arcs to about 1e-8 mm.
    assert distance.max() <= 1e-6


def test_a_mesh_whose_ends_do_not_match_has_no_helical_map(mesh):
    points = mesh.p.copy()
    top = np.flatnonzero(points[2] > LENGTH - 1e-9)
    points[0, top] += 1e-3
    moved = skfem.MeshHex(points, mesh.t).with_boundaries(mesh.boundaries)
    with pytest.raises(ValueError, match=r"^mesh: top and bottom faces differ by 0.001 mm"):
        HelicalMap(moved)
