"""Contact with the rod: gaps to a helix of known place, and exact derivatives in nodes and strain."""

import numpy as np
import pytest

from fem_reference.cell.core_contact import ACTIVATION, REST_SHARE, CellCoreContact
from fem_reference.cell.screw_motion import screw_series
from tests.fem_fixtures import asymmetry, difference, relative_error

RADIUS, REACH = 1.0, 6.0
CURVATURE = np.array([0.02, -0.05, 0.03])
STRAIN = np.append(CURVATURE, 1.02)
COUNT = 40
RNG = np.random.default_rng(0)
STATIONS = RNG.uniform(0.0, 3.0, COUNT)
AZIMUTHS = RNG.uniform(0.0, 2.0 * np.pi, COUNT)
# From nearly the barrier's wall, at −0.018 mm, to beyond its reach, at +0.002 mm.
GAPS = np.linspace(-0.016, 0.004, COUNT)
AREAS = RNG.uniform(0.05, 0.2, COUNT)


def around_the_axis(gaps: np.ndarray, stretch: float = 1.0) -> np.ndarray:
    """Points in the rod's cross-sections, at these gaps from its surface."""
    series = screw_series(CURVATURE, REACH, stretch)
    points = []
    for s, azimuth, gap in zip(STATIONS, AZIMUTHS, gaps, strict=True):
        offset = (RADIUS + gap) * np.array([np.cos(azimuth), np.sin(azimuth), 0.0])
        motion = series.at(s)[0]
        points.append(motion[:3, :3] @ offset + motion[:3, 3])
    return np.array(points)


@pytest.fixture(scope="module")
def contact() -> CellCoreContact:
    # The search for the closest points starts up to half a millimetre away from them.
    starts = STATIONS + np.random.default_rng(1).uniform(-0.5, 0.5, COUNT)
    return CellCoreContact(np.arange(COUNT), AREAS, RADIUS, starts)


def response(contact, x, strain=STRAIN):
    return contact.response(x, screw_series(strain[:3], REACH, strain[3]))


def test_gaps_are_the_distances_to_the_rods_surface(contact):
    gap = contact.gap(around_the_axis(GAPS), screw_series(CURVATURE, REACH))
    # Round-off of coordinates of a few millimetres.
    np.testing.assert_allclose(gap, GAPS, rtol=0, atol=1e-14)


def test_far_points_have_their_gap_too(contact):
    gaps = np.linspace(0.5, 4.0, COUNT)
    found = contact.gap(around_the_axis(gaps), screw_series(CURVATURE, REACH))
    np.testing.assert_allclose(found, gaps, rtol=0, atol=1e-13)


def test_nodes_may_be_in_the_rod_for_the_moment_but_not_near_its_axis(contact):
    series = screw_series(CURVATURE, REACH)
    assert contact.admissible(around_the_axis(GAPS), series)
    for gap, allowed in ((-0.499 * RADIUS, True), (-0.501 * RADIUS, False)):
        gaps = GAPS.copy()
        gaps[7] = gap
        assert contact.admissible(around_the_axis(gaps), series) is allowed


def test_the_contact_pressure_is_the_barriers_slope(contact):
    """At zero gap t = 0.9, and k d̂ (2 (t − 1) ln t + (t − 1)²/t) = 0.64 kPa; beyond 0.002 mm it is nil."""
    series = screw_series(CURVATURE, REACH)
    at_rest = contact.pressure(around_the_axis(np.zeros(COUNT)), series)
    expected = 0.02 * (-0.2 * np.log(0.9) + 0.01 / 0.9)
    # The slope changes by 0.07 MPa/mm · 1e-14 mm of gap.
    np.testing.assert_allclose(at_rest, expected, rtol=1e-11)
    assert expected == pytest.approx(0.64e-3, rel=0.01)
    pressure = contact.pressure(around_the_axis(GAPS), series)
    assert np.all(pressure[GAPS < 0.002 - 1e-9] > 0.0)
    assert np.all(np.diff(pressure) <= 0.0)
    assert np.all(pressure[GAPS > 0.002 + 1e-9] == 0.0)


def test_the_pressure_follows_the_barrier_and_then_its_tangent(contact):
    series = screw_series(CURVATURE, REACH)

    def at(t):
        return contact.pressure(around_the_axis(np.full(COUNT, (t - REST_SHARE) * ACTIVATION)), series)

    # At the share t of the activation distance, k d̂ (2 (t − 1) ln t + (t − 1)²/t): 0.245 MPa at t = 0.1.
    np.testing.assert_allclose(at(0.1), 0.02 * (1.8 * np.log(10.0) + 8.1), rtol=1e-9)
    # From there with the slope k (81 + 36 + 2 ln 10)/mm, on and on.
    slope = 117.0 + 2.0 * np.log(10.0)
    for t in (0.05, -1.0):
        expected = 0.02 * (1.8 * np.log(10.0) + 8.1) + slope * 0.02 * (0.1 - t)
        np.testing.assert_allclose(at(t), expected, rtol=1e-9)


def test_the_nodes_force_is_normal_to_the_rod(contact):
    x = around_the_axis(GAPS)
    series = screw_series(CURVATURE, REACH)
    found = contact.response(x, series)
    normal = np.array(
        [
            series.at(s)[0][:3, :3] @ [np.cos(a), np.sin(a), 0.0]
            for s, a in zip(STATIONS, AZIMUTHS, strict=True)
        ]
    )
    expected = -(AREAS * contact.pressure(x, series))[:, None] * normal
    np.testing.assert_allclose(
        found.node_force, expected, rtol=0, atol=1e-13 * np.abs(expected).max() + 1e-15
    )


def test_without_the_rods_roundness_a_node_has_stiffness_along_the_normal_alone(contact, x):
    found = response(contact, x)
    left = found.node_stiffness - found.node_concave
    values = np.linalg.eigvalsh(left)
    scale = np.abs(values).max()
    np.testing.assert_allclose(values[:, :2], 0.0, rtol=0, atol=1e-12 * scale)
    assert values[:, 2].min() >= 0.0
    # Pressed on the round rod a node slides off; along the axis only where that is bent away from it.
    pressed = np.linalg.norm(found.node_force, axis=1) > 0.0
    assert (np.linalg.eigvalsh(found.node_concave[pressed])[:, 0] < 0.0).all()


# The barrier bends over its activation distance of 0.02 mm: a step of 1e-5 mm in the nodes, of 1e-6 1/mm over
# a lever of up to 10 mm² in u, or of 1e-6 over one of 6 mm in the stretch, moves a gap by 1/2000 of that. Two
# of fourth order lose less than 1e-9; round-off is 1e-10.
NODE_STEP, STRAIN_STEP = 1e-5, 1e-6


@pytest.fixture(scope="module")
def x() -> np.ndarray:
    # Off the cross-sections, so that the closest point moves too.
    return around_the_axis(GAPS, STRAIN[3]) + 1e-4 * np.random.default_rng(2).uniform(-1.0, 1.0, (COUNT, 3))


@pytest.fixture(scope="module")
def direction() -> np.ndarray:
    return np.random.default_rng(3).uniform(-1.0, 1.0, (COUNT, 3))


def test_forces_are_the_slopes_of_the_energy(contact, x, direction):
    found = response(contact, x)
    slope = difference(lambda t: response(contact, x + t * direction).energy, NODE_STEP)
    assert np.sum(found.node_force * direction) == pytest.approx(float(slope), rel=1e-6)
    for i, e in enumerate(np.eye(4)):
        slope = difference(lambda t, e=e: response(contact, x, STRAIN + t * e).energy, STRAIN_STEP)
        assert abs(found.strain_force[i] - slope) <= 1e-6 * np.abs(found.strain_force).max()


def test_stiffness_in_the_nodes_is_the_slope_of_the_forces(contact, x, direction):
    found = response(contact, x)

    def moved(t):
        return response(contact, x + t * direction)

    slope = difference(lambda t: moved(t).node_force, NODE_STEP)
    assert relative_error(np.einsum("nij,nj->ni", found.node_stiffness, direction), slope) <= 1e-6
    slope = difference(lambda t: moved(t).strain_force, NODE_STEP)
    assert relative_error(np.einsum("niu,ni->u", found.node_strain, direction), slope) <= 1e-6


def test_stiffness_in_the_strain_is_the_slope_of_the_forces(contact, x):
    found = response(contact, x)
    for i, e in enumerate(np.eye(4)):
        slope = difference(lambda t, e=e: response(contact, x, STRAIN + t * e).node_force, STRAIN_STEP)
        assert relative_error(found.node_strain[:, :, i], slope) <= 1e-6
        slope = difference(lambda t, e=e: response(contact, x, STRAIN + t * e).strain_force, STRAIN_STEP)
        assert relative_error(found.strain_stiffness[i], slope) <= 1e-6


def test_stiffness_is_symmetric(contact, x):
    found = response(contact, x)
    assert asymmetry(found.node_stiffness) <= 1e-10
    assert asymmetry(found.strain_stiffness) <= 1e-10


def test_energy_force_and_stiffness_are_continuous_where_the_barrier_ends(contact):
    """b, b' and b'' vanish at d̂ with the first power of what is left at least: b'' ≤ 6 k δ/d̂."""
    edge = (1.0 - REST_SHARE) * ACTIVATION
    near = response(contact, around_the_axis(np.full(COUNT, edge - 1e-9), STRAIN[3]))
    assert near.energy <= 1e-20
    assert np.abs(near.node_force).max() <= 1e-15
    assert np.abs(near.node_stiffness).max() <= 1.01 * 6e-9 / ACTIVATION * AREAS.max()
    beyond = response(contact, around_the_axis(np.full(COUNT, edge + 1e-9), STRAIN[3]))
    assert beyond.energy == 0.0
    assert np.abs(beyond.node_stiffness).max() == 0.0
