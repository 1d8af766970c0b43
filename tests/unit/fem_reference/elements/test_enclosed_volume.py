"""Volumes under patches of surface: closed forms, quadrature of their own shapes, exact derivatives."""

import numpy as np
import pytest

from fem_reference import Ogden
from fem_reference.elements import SolidElements
from fem_reference.elements.enclosed_volume import VolumePatch, facet_form, fan_form
from fem_reference.mesh import reference_element
from tests.fem_fixtures import (
    SIDES,
    TURN,
    assemble,
    asymmetry,
    boundary_nodes,
    deformed,
    difference,
    distorted_block,
    relative_error,
    times,
)

FORMS = {"facet": facet_form, "fan": fan_form}
BLOCKS, POINTS = 5, 30


@pytest.fixture(scope="module", params=[1, 2], ids=["linear", "quadratic"])
def order(request) -> int:
    return request.param


@pytest.fixture(scope="module", params=FORMS)
def patch(request, order) -> VolumePatch:
    """Blocks of random nodes out of POINTS, which share some of them."""
    form = FORMS[request.param](order)
    rng = np.random.default_rng(0)
    return VolumePatch(np.array([rng.permutation(POINTS)[: len(form)] for _ in range(BLOCKS)]), form)


@pytest.fixture(scope="module")
def x() -> np.ndarray:
    return np.random.default_rng(1).uniform(-1.0, 1.0, (POINTS, 3))


@pytest.fixture(scope="module")
def direction() -> np.ndarray:
    return np.random.default_rng(2).uniform(-1.0, 1.0, (POINTS, 3))


def lagrange(order: int, t: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Functions of an edge's nodes and their slopes: a hexahedron's along its first edge."""
    values, slopes = reference_element(order).evaluate(np.outer(t, [1.0, 0.0, 0.0]))
    return values[:, : order + 1], slopes[:, : order + 1, 0]


def on_facets(patch: VolumePatch, order: int, x: np.ndarray) -> float:
    """⅓ ∫ x·(∂x/∂ξ × ∂x/∂η) by ten points a side, of degree 3 order − 1 at most."""
    point, weight = np.polynomial.legendre.leggauss(10)
    value, slope = lagrange(order, 0.5 + 0.5 * point)
    corner = x[patch.connectivity].reshape(BLOCKS, order + 1, order + 1, 3)
    place, along, across = (
        np.einsum("qj,pi,fjix->fqpx", v, w, corner)
        for v, w in ((value, value), (value, slope), (slope, value))
    )
    flux = np.einsum("fqpx,fqpx->fqp", place, np.cross(along, across))
    return float(np.einsum("fqp,q,p->", flux, weight, weight) / 12.0)


def under_fans(patch: VolumePatch, order: int, x: np.ndarray) -> float:
    """Signed volumes between the origin and cones over curves: ⅙ ∫ apex·(e × e′) ds."""
    point, weight = np.polynomial.legendre.leggauss(10)
    value, slope = lagrange(order, 0.5 + 0.5 * point)
    apex, edge = x[patch.connectivity[:, 0]], x[patch.connectivity[:, 1:]]
    swept = np.cross(value @ edge, slope @ edge)
    return float(np.einsum("bx,bqx,q->", apex, swept, weight) / 12.0)


def test_volumes_of_facets_are_the_integrals_over_their_surfaces(order, x):
    patch = VolumePatch(np.arange(BLOCKS * (order + 1) ** 2).reshape(BLOCKS, -1) % POINTS, facet_form(order))
    assert patch.volume(x) == pytest.approx(on_facets(patch, order, x), rel=1e-12)


def test_volumes_of_fans_are_those_of_cones(order, x):
    patch = VolumePatch(np.arange(BLOCKS * (order + 2)).reshape(BLOCKS, -1) % POINTS, fan_form(order))
    assert patch.volume(x) == pytest.approx(under_fans(patch, order, x), rel=1e-12)


def test_a_flat_triangle_and_a_square_have_the_volumes_of_pyramids():
    """A sixth of 1 · 2 · 3 between three axes; a third of the height times 4 under a square."""
    tetrahedron = VolumePatch(np.array([[0, 1, 2]]), fan_form(1))
    assert tetrahedron.volume(np.diag([1.0, 2.0, 3.0])) == pytest.approx(1.0, rel=1e-15)
    for order in (1, 2):
        side = np.linspace(-1.0, 1.0, order + 1)
        square = np.array([(x, y, 1.5) for y in side for x in side])
        pyramid = VolumePatch(np.arange(len(square))[None], facet_form(order))
        assert pyramid.volume(square) == pytest.approx(2.0, rel=1e-14)


@pytest.mark.parametrize("form", [facet_form, fan_form])
def test_forms_change_sign_with_any_two_of_their_nodes(form, order):
    found = form(order)
    scale = np.abs(found).max()
    for axes in ((0, 1), (1, 2), (0, 2)):
        np.testing.assert_allclose(np.swapaxes(found, *axes), -found, rtol=0, atol=1e-14 * scale)


def test_gradient_is_the_slope_of_the_volume(patch, x, direction):
    gradient = assemble(patch.connectivity, patch.gradient(x), POINTS)
    # The volume is a cubic in t, which the differences take exactly: only round-off is left.
    slope = difference(lambda t: patch.volume(x + t * direction), 0.1)
    assert np.sum(gradient * direction) == pytest.approx(float(slope), rel=1e-11)


def test_hessian_is_the_symmetric_slope_of_the_gradient(patch, x, direction):
    def gradient(t: float) -> np.ndarray:
        return assemble(patch.connectivity, patch.gradient(x + t * direction), POINTS)

    hessian = patch.hessian(x)
    assert relative_error(times(patch.connectivity, hessian, direction), difference(gradient, 0.1)) <= 1e-11
    assert asymmetry(hessian) <= 1e-14


@pytest.fixture(scope="module")
def surface(order) -> tuple[SolidElements, VolumePatch, np.ndarray]:
    """A block of elements, its closed surface with normals inwards, and a deformation of it."""
    mesh = distorted_block(2, order)
    facets = np.concatenate([mesh.oriented(side) for side in SIDES])
    x = deformed(mesh.points, noise=0.02 / order)
    assert len(np.unique(facets)) == len(boundary_nodes(mesh))
    return SolidElements(mesh, Ogden()), VolumePatch(facets, facet_form(order)), x


def test_a_closed_surface_holds_the_volume_of_the_elements_in_it(surface):
    """Gauss's theorem, with both sides integrated exactly."""
    solid, patch, x = surface
    inside = float(solid.volume @ (1.0 + solid.dilatation(x)[:, 0]))
    assert -patch.volume(x) == pytest.approx(inside, rel=1e-13)


def test_rigid_motions_keep_the_volume_of_a_closed_surface(surface):
    _, patch, x = surface
    # A shift of 100 mm has the determinants cancel: round-off of 1e-16 · 100³ mm³ over 6 mm³.
    assert patch.volume(x @ TURN.T + [100.0, -50.0, 20.0]) == pytest.approx(patch.volume(x), rel=1e-10)


def test_pressure_on_a_closed_surface_has_no_resultant(surface):
    _, patch, x = surface
    gradient = assemble(patch.connectivity, patch.gradient(x), len(x))
    scale = np.abs(gradient).sum()
    assert np.abs(gradient.sum(axis=0)).max() <= 1e-14 * scale
    assert np.abs(np.cross(x, gradient).sum(axis=0)).max() <= 1e-13 * scale
