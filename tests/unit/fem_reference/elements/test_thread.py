"""The embedded thread: it lies on the helix, carries the right tension, and its derivatives are exact."""

import numpy as np
import pytest

from fem_reference import DoubleHelix, NoWinding, Ring, Thread
from fem_reference.elements import ThreadSegments
from fem_reference.geometry.winding import COUPLINGS
from fem_reference.mesh import BodyMesh
from tests.fem_fixtures import (
    TINY,
    assemble,
    asymmetry,
    deformed,
    difference,
    relative_error,
    times,
    tiny_equations,
)

RADIUS, PITCH = 5.6, 3.0


@pytest.fixture(scope="module", params=[1, 2], ids=["linear", "quadratic"])
def mesh(request) -> BodyMesh:
    return tiny_equations(request.param).mesh


@pytest.fixture(scope="module", params=COUPLINGS)
def thread(mesh, request) -> ThreadSegments:
    coupled = Thread(coupling=request.param, slack_share=1e-4)
    return ThreadSegments(mesh, DoubleHelix(), coupled, RADIUS * 1e-3, PITCH * 1e-3, TINY.around)


@pytest.fixture(scope="module")
def rest(mesh) -> np.ndarray:
    return mesh.points


def test_the_axial_stiffness_is_771_newtons():
    """EA = 31 067 MPa · π (0.0889 mm)²."""
    assert Thread().axial_stiffness == pytest.approx(771.3, abs=0.1)


def test_points_lie_on_the_helices(thread, rest):
    z = np.linspace(0.0, PITCH, TINY.around + 1)
    points = thread.points(rest)
    assert len(thread.polylines) == 2
    for index, hand in zip(thread.polylines, (1.0, -1.0), strict=True):
        azimuth = hand * 2.0 * np.pi * z / PITCH
        helix = np.column_stack([RADIUS * np.cos(azimuth), RADIUS * np.sin(azimuth), z])
        # Ends are moved 1e-9 mm into the mesh so as to be found.
        np.testing.assert_allclose(points[index], helix, atol=2e-9, rtol=0)


def test_rest_lengths_add_up_to_the_helix_from_below_at_second_order(equations):
    exact = 2.0 * np.hypot(2.0 * np.pi * RADIUS, PITCH)
    errors = []
    for points_per_turn in (18, 36, 72):
        thread = ThreadSegments(
            equations.mesh, DoubleHelix(), Thread(), RADIUS * 1e-3, PITCH * 1e-3, points_per_turn
        )
        assert len(thread) == 2 * points_per_turn
        errors.append(exact - thread.rest_length.sum())
    # A chord of n a turn is short by a share of π²/6n² and O(n⁻⁴).
    assert errors[0] == pytest.approx(exact * np.pi**2 / (6.0 * 18**2), rel=0.02)
    orders = np.log2(np.divide(errors[:-1], errors[1:]))
    np.testing.assert_allclose(orders, 2.0, atol=0.02)


def test_a_turned_winding_starts_at_its_orientation(equations):
    turned = ThreadSegments(equations.mesh, DoubleHelix(psi=0.4), Thread(), RADIUS * 1e-3, PITCH * 1e-3, 18)
    starts = [turned.points(equations.mesh.points)[line[0]] for line in turned.polylines]
    for start in starts:
        np.testing.assert_allclose(start[:2], RADIUS * np.array([np.cos(0.4), np.sin(0.4)]), atol=2e-9)


@pytest.mark.parametrize("coupling", COUPLINGS)
def test_a_ring_is_a_closed_chain(mesh, rest, coupling):
    """Its last point moves with the first, and pushed outwards it is stretched alike all round."""
    length = PITCH * 1e-3
    ring = ThreadSegments(mesh, Ring(length), Thread(coupling=coupling), RADIUS * 1e-3, length, 18)
    (line,) = ring.polylines
    assert len(ring) == 18
    np.testing.assert_array_equal(ring.segments, np.column_stack([line[:-1], line[1:]]))
    moved = deformed(rest / 6.0) * 6.0
    # Round-off: the direction in which the ring goes on beyond its ends is found from either side.
    np.testing.assert_allclose(ring.points(moved)[line[0]], ring.points(moved)[line[-1]], rtol=1e-14)
    assert ring.rest_length.sum() == pytest.approx(18 * 2.0 * RADIUS * np.sin(np.pi / 18), rel=1e-9)
    np.testing.assert_allclose(
        ring.tension(rest * [1.01, 1.01, 0.9]), 0.01 * Thread().axial_stiffness, rtol=1e-9
    )


def test_without_winding_there_are_no_segments(mesh, rest):
    none = ThreadSegments(mesh, NoWinding(), Thread(), RADIUS * 1e-3, PITCH * 1e-3, 18)
    assert len(none) == 0
    assert none.energy(rest) == 0.0
    assert [part.shape for part in none.response(rest)] == [(0, 48), (0, 48, 48), (0, 48)]
    assert none.force(rest).shape == (0, 48)
    assert none.points(rest).shape == (0, 3)
    assert none.segments.shape == (0, 2)


def test_threads_that_overlap_are_refused(equations):
    with pytest.raises(ValueError, match=r"^pitch: got 0\.15 mm, expected more than 0\.1778 mm"):
        ThreadSegments(equations.mesh, DoubleHelix(pitch=0.15e-3), Thread(), RADIUS * 1e-3, PITCH * 1e-3, 18)


def test_a_uniform_stretch_of_the_host_stretches_every_segment_alike(thread, rest):
    # Trilinear interpolation reproduces an affine motion exactly, wherever the points lie.
    tension = thread.tension(1.002 * rest)
    np.testing.assert_allclose(tension, 0.002 * Thread().axial_stiffness, rtol=1e-9)
    energy = 0.5 * Thread().axial_stiffness * 0.002**2 * thread.rest_length.sum()
    assert thread.energy(1.002 * rest) == pytest.approx(energy, rel=1e-9)


def test_in_compression_a_share_of_the_stiffness_is_left(mesh, rest):
    made = [
        ThreadSegments(mesh, DoubleHelix(), Thread(slack_share=share), RADIUS * 1e-3, PITCH * 1e-3, 18)
        for share in (1e-4, 1.0)
    ]
    slack, bar = (thread.tension(0.998 * rest) for thread in made)
    np.testing.assert_allclose(bar, -0.002 * Thread().axial_stiffness, rtol=1e-9)
    np.testing.assert_allclose(slack, 1e-4 * bar, rtol=1e-12)
    assert made[0].slack(slack).all()
    assert not made[1].slack(bar).any()
    assert made[0].energy(0.998 * rest) == pytest.approx(1e-4 * made[1].energy(0.998 * rest), rel=1e-12)


def test_extrapolated_tensions_are_no_more_in_compression_than_a_slack_thread_takes(mesh):
    yarn, bar = (
        ThreadSegments(mesh, DoubleHelix(), Thread(slack_share=share), RADIUS * 1e-3, PITCH * 1e-3, 18)
        for share in (1e-4, 1.0)
    )
    tension = np.linspace(-0.1, 0.2, len(yarn))
    expected = np.where(tension < 0.0, 1e-4 * tension, tension)
    np.testing.assert_allclose(yarn.loosened(tension), expected, rtol=1e-14)
    np.testing.assert_array_equal(bar.loosened(tension), tension)


def test_a_step_makes_segments_slack_by_their_strain_and_taut_by_their_force(thread, rest):
    """Either way the tension jumps by no more than the step has led to expect."""
    stiffness, count = Thread().axial_stiffness, len(thread)
    strain = np.linspace(-1e-3, 1e-3, count)
    taut, slack = (sign * np.full(count, 1e-3) for sign in (1.0, -1.0))
    after = thread.tension_after(rest, taut, strain * thread.rest_length)
    np.testing.assert_allclose(after, np.where(strain < 0.0, 1e-4, 1.0) * stiffness * strain, rtol=1e-6)
    after = thread.tension_after(rest, slack, strain * thread.rest_length)
    np.testing.assert_allclose(after, 1e-4 * stiffness * strain, rtol=1e-6)


def test_an_axial_stretch_of_the_host_pulls_at_the_helix_angle(thread, rest):
    """l²/L0² = cos²φ + λ² sin²φ, for a segment that climbs at angle φ."""
    climb = PITCH / TINY.around
    share = (climb / thread.rest_length) ** 2
    stretch = np.sqrt(1.0 - share + 1.1**2 * share)
    # The nudge of the end points, 1e-9 mm of a 0.17 mm climb.
    expected = Thread().axial_stiffness * (stretch - 1.0)
    np.testing.assert_allclose(thread.tension(rest * [1.0, 1.0, 1.1]), expected, rtol=1e-7)


def test_at_rest_there_is_no_force(thread, rest):
    assert thread.energy(rest) == 0.0
    np.testing.assert_array_equal(thread.response(rest)[0], 0.0)
    np.testing.assert_array_equal(thread.force(rest), 0.0)


# A step of 1e-4 mm over segments of 2 mm: the fourth-order differences lose 1e-17 of the stiffness, round-off
# 1e-12.
STEP = 1e-4


@pytest.fixture(scope="module")
def x(rest) -> np.ndarray:
    return deformed(rest / 6.0) * 6.0


@pytest.fixture(scope="module")
def direction(rest) -> np.ndarray:
    return np.random.default_rng(2).uniform(-1.0, 1.0, rest.shape)


def test_force_is_the_slope_of_the_energy(thread, x, direction):
    force = assemble(thread.connectivity, thread.response(x)[0], len(x))
    slope = difference(lambda t: thread.energy(x + t * direction), STEP)
    assert np.sum(force * direction) == pytest.approx(float(slope), rel=1e-6)


def test_the_force_alone_is_that_of_the_response(thread, x):
    assert relative_error(thread.force(x), thread.response(x)[0]) <= 1e-12


def test_tangent_is_the_symmetric_slope_of_the_force(thread, x, direction):
    stiffness = thread.response(x)[1]
    slope = difference(
        lambda t: assemble(thread.connectivity, thread.response(x + t * direction)[0], len(x)), STEP
    )
    assert relative_error(times(thread.connectivity, stiffness, direction), slope) <= 1e-6
    assert asymmetry(stiffness) <= 1e-10


def test_length_gradient_is_the_slope_of_the_lengths(thread, x, direction):
    gradient = thread.response(x)[2]
    moved = direction[thread.connectivity].reshape(len(thread), -1)
    # l = L0 (1 + T/EA).
    slope = difference(
        lambda t: (
            thread.tension(x + t * direction)
            * thread.rest_length
            / thread.stiffness(thread.tension(x + t * direction))
        ),
        STEP,
    )
    assert relative_error(np.einsum("sa,sa->s", gradient, moved), slope) <= 1e-9


def test_the_strain_here_makes_some_segments_slack(thread, x):
    """So that what is tested at ``x`` is of both branches of the law."""
    assert 0.2 < (thread.tension(x) < 0.0).mean() < 0.8


def test_of_a_given_tension_the_sign_alone_enters_the_force(thread, x):
    own = thread.tension(x)
    force, stiffness, _ = thread.response(x)
    np.testing.assert_array_equal(thread.response(x, own)[1], stiffness)
    light = thread.response(x, 1e-12 * own)
    np.testing.assert_array_equal(light[0], force)
    assert relative_error(thread.force(x, 1e-12 * own), force) <= 1e-12
    # Without tension only the stretch's EA/L0 along the segment is left: rank one.
    largest = np.abs(light[1]).max(axis=(1, 2))
    ranks = [np.linalg.matrix_rank(k, tol=1e-6 * m) for k, m in zip(light[1], largest, strict=True)]
    np.testing.assert_array_equal(ranks, 1)
    other = thread.response(x, -own)[0]
    share = np.where(own < 0.0, 1e4, 1e-4)
    np.testing.assert_allclose(other, share[:, None] * force, rtol=1e-9, atol=1e-12)


@pytest.mark.parametrize(
    ("make", "named"),
    [
        (lambda: Thread(young_modulus=0.0), "young_modulus: got 0.0"),
        (lambda: Thread(young_modulus=np.inf), "young_modulus: got inf"),
        (lambda: Thread(radius=-1e-4), "radius: got -0.0001"),
        (lambda: Thread(slack_share=0.0), "slack_share: got 0.0, expected a number above 0"),
        (lambda: Thread(slack_share=1.5), "slack_share: got 1.5"),
        (lambda: Thread(coupling="glue"), "coupling: got 'glue', expected one of axis, circumference"),
    ],
)
def test_impossible_threads_are_refused_by_name(make, named):
    with pytest.raises(ValueError, match=named):
        make()
