"""The rod's curve: exact energies of known shapes, and derivatives against differences."""

import numpy as np
import pytest

from fem_reference.central_rod import CoreCoordinates, CoreSpline, SplineBasis
from fem_reference.central_rod.spline_rod import DEGREE
from tests.fem_fixtures import assemble, difference, relative_error, rotation, times

LENGTH, SPANS = 20.0, 10
BENDING_STIFFNESS = 3.9


@pytest.fixture(scope="module")
def axis() -> CoreSpline:
    return CoreSpline(SplineBasis(LENGTH, SPANS), BENDING_STIFFNESS, 2e-9)


def arc(basis: SplineBasis, curvature: float) -> np.ndarray:
    """Control points of the spline through an arc in the plane y = 0, at the Greville stations."""
    s = basis.greville
    points = np.column_stack(
        [(1.0 - np.cos(curvature * s)) / curvature, 0.0 * s, np.sin(curvature * s) / curvature]
    )
    return np.linalg.solve(basis.values(s), points)


def wavy(axis: CoreSpline) -> np.ndarray:
    return axis.rest() + 0.3 * np.random.default_rng(3).normal(size=(axis.basis.count, 3))


def test_control_points_at_rest_give_the_straight_rod_by_arc_length(axis):
    s = np.linspace(0.0, LENGTH, 17)
    np.testing.assert_allclose(axis.basis.values(s) @ axis.rest(), np.outer(s, [0, 0, 1]), atol=1e-13)
    np.testing.assert_allclose(axis.extension(axis.rest()), 0.0, atol=1e-14)
    # Round-off of 1e-16 mm in the elongation, times EA/h of 5e4 N/mm, squared and summed.
    assert axis.energy(axis.rest()) == pytest.approx(0.0, abs=1e-11)


@pytest.mark.parametrize("order", [0, 1, 2])
def test_the_functions_and_pieces_of_one_span_are_those_of_the_whole_curve(axis, order):
    """At knots, between them, and at both ends; the second derivative is 1/h² in size."""
    basis = axis.basis
    s = np.concatenate([np.linspace(0.0, basis.length, 4 * basis.spans + 1), [-0.1, basis.length + 0.1]])
    first = basis.first_control(s)
    own = first[:, None] + np.arange(DEGREE + 1)
    whole = basis.values(s, order)
    bound = 1e-13 / basis.span**order
    local = np.zeros_like(whole)
    np.put_along_axis(local, own, basis.local(s, first, order), axis=1)
    np.testing.assert_allclose(local, whole, atol=bound)
    controls = np.random.default_rng(0).normal(size=(basis.count, 3))
    way = np.clip(s, 0.0, basis.length) - first * basis.span
    for i in range(3):
        pieces = basis.pieces(controls)[first, :, i]
        found = [np.polyval(np.polyder(p, order), w) for p, w in zip(pieces, way, strict=True)]
        np.testing.assert_allclose(found, whole @ controls[:, i], atol=50.0 * bound)


def test_an_arc_has_the_energy_of_its_curvature_at_fourth_order():
    """EI/2 κ² L; cubic splines interpolate second derivatives at second order, which squares to fourth."""
    errors = []
    for spans in (10, 20, 40):
        axis = CoreSpline(SplineBasis(LENGTH, spans), BENDING_STIFFNESS, 0.0)
        controls = arc(axis.basis, 0.05)
        bending = 0.5 * np.einsum("ai,ab,bi->", controls, axis.bending, controls)
        errors.append(abs(bending - 0.5 * BENDING_STIFFNESS * 0.05**2 * LENGTH))
    orders = np.log2(np.divide(errors[:-1], errors[1:]))
    # Spans at the ends, where interpolation is one-sided, have a constant share: at least second order.
    assert (orders > 1.9).all()


def test_forces_are_the_gradient_of_the_energy_and_stiffness_that_of_the_forces(axis):
    controls = wavy(axis)
    direction = np.random.default_rng(0).normal(size=controls.shape)

    def force(t: float) -> np.ndarray:
        x = controls + t * direction
        local, *_ = axis.response(x, axis.tension(x))
        return assemble(axis.connectivity, local, len(x)) + axis.bending @ x

    slope = difference(lambda t: axis.energy(controls + t * direction), 1e-4)
    # Energy 1e5 N mm to 16 digits over a step of 1e-4.
    assert slope == pytest.approx(float((force(0.0) * direction).sum()), rel=1e-8)
    _, stiffness, _ = axis.response(controls, axis.tension(controls))
    product = times(axis.connectivity, stiffness, direction) + axis.bending @ direction
    assert relative_error(product, difference(force, 1e-4)) < 1e-8


def test_the_force_alone_is_that_of_the_response(axis):
    controls = wavy(axis)
    force, *_ = axis.response(controls, axis.tension(controls))
    assert relative_error(axis.force(controls), force) <= 1e-13


def test_energy_does_not_change_when_the_rod_is_turned_and_moved(axis):
    controls = wavy(axis)
    moved = controls @ rotation((1.0, 2.0, -0.5), 0.8).T + [1.0, -2.0, 3.0]
    assert axis.energy(moved) == pytest.approx(axis.energy(controls), rel=1e-12)


def test_the_mass_is_that_of_the_length(axis):
    assert axis.mass.sum() == pytest.approx(2e-9 * LENGTH, rel=1e-13)


@pytest.fixture(scope="module")
def frame(axis) -> CoreCoordinates:
    return CoreCoordinates(axis.basis, np.repeat(np.linspace(0.0, LENGTH, 21), 3))


def bent(frame: CoreCoordinates, axis: CoreSpline, curvature: float) -> np.ndarray:
    """Sections of three points that follow an arc rigidly, and the arc's control points."""
    controls = arc(axis.basis, curvature)
    s = np.repeat(np.linspace(0.0, LENGTH, 21), 3)
    local = np.tile([[1.0, 0.0], [-0.5, 0.8], [-0.5, -0.8]], (21, 1))
    centre = axis.basis.values(s) @ controls
    across = np.column_stack([np.cos(curvature * s), 0.0 * s, -np.sin(curvature * s)])
    nodes = centre + local[:, :1] * across + local[:, 1:] * np.array([0.0, 1.0, 0.0])
    return np.concatenate([nodes, controls])


def test_the_mean_of_one_deformation_is_itself(frame, axis):
    x = bent(frame, axis, 0.06)
    np.testing.assert_allclose(frame.mean([x], [1.0]), x, atol=1e-8)


def test_straightened_nodes_are_those_of_the_unbent_rod():
    """Sections that follow an arc of 1.2 rad rigidly come back to their places, as far as its tangents go.

    Those of a cubic spline are of third order in its spans; 4e-5 mm was found with spans of 2 mm.
    """
    errors = []
    for spans in (10, 20, 40):
        axis = CoreSpline(SplineBasis(LENGTH, spans), BENDING_STIFFNESS, 0.0)
        frame = CoreCoordinates(axis.basis, np.repeat(np.linspace(0.0, LENGTH, 21), 3))
        straight = bent(frame, axis, 1e-9)[:63]
        errors.append(np.abs(frame.straightened(bent(frame, axis, 0.06)) - straight).max())
    assert errors[0] < 1e-4
    np.testing.assert_allclose(np.log2(np.divide(errors[:-1], errors[1:])), 3.0, atol=0.1)


def test_a_section_keeps_its_shape_when_straightened(frame, axis):
    moved = bent(frame, axis, 0.06)
    section = slice(30, 33)
    for x in (moved, moved @ rotation((0.0, 1.0, 0.0), 0.3).T + [1.0, -2.0, 3.0]):
        found = frame.straightened(x)[section]
        sides = (np.linalg.norm(triple - triple[0], axis=1) for triple in (found, x[section]))
        np.testing.assert_allclose(*sides, rtol=1e-12)


def test_bending_extrapolates_along_the_arc_and_not_along_the_chord(frame, axis):
    """From 0.6 and 1.2 rad of bending to 1.8: the straight line misses by half of 20 mm · 0.6² rad²."""
    first, second, third = (bent(frame, axis, k) for k in (0.03, 0.06, 0.09))
    straight = np.abs(2.0 * second - first - third).max()
    along = np.abs(frame.mean([second, first], [2.0, -1.0]) - third).max()
    assert straight > 1.5
    assert along < 1e-2 * straight


def test_what_turns_around_the_rod_extrapolates_around_it(frame, axis):
    """Sections of a bent body that turn by 0.1 rad and widen by a tenth, and what doubles that."""

    def turned(angle: float, growth: float) -> np.ndarray:
        straight = bent(frame, axis, 1e-9)
        nodes = len(straight) - axis.basis.count
        local = (1.0 + growth) * straight[:nodes, :2] @ rotation((0.0, 0.0, 1.0), angle)[:2, :2].T
        x = bent(frame, axis, 0.06)
        centre, frames = frame.frames(x[nodes:])
        level = frame._level
        arms = np.column_stack([local, np.zeros(nodes)])
        x[:nodes] = centre[level] + np.einsum("nij,nj->ni", frames[level], arms)
        return x

    first, second, third = (turned(0.1 * k, 0.1 * k) for k in range(3))
    # A mean of straight coordinates misses by 0.01 rad² of their distance from the rod.
    assert np.abs(2.0 * second - first - third).max() > 5e-3
    np.testing.assert_allclose(frame.mean([second, first], [2.0, -1.0]), third, atol=1e-8)
