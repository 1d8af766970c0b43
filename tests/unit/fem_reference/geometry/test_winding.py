"""Winding layouts: how much thread, where it crosses, what turns and shifts do to it, what is refused."""

import itertools
import math

import numpy as np
import pytest

from fem_reference import LAYOUTS, DoubleHelix, NoWinding, Ring, SixHelix, Thread, layout

RADIUS, PITCH = 5.6e-3, 3e-3
# Divisible by 12, so that helices have points where they cross.
POINTS = 48


def thread_length(winding, length, points_per_turn) -> float:
    lines = winding.polylines(RADIUS, length, points_per_turn)
    return sum(float(np.linalg.norm(np.diff(line, axis=0), axis=1).sum()) for line in lines)


def turned(points, angle) -> np.ndarray:
    c, s = np.cos(angle), np.sin(angle)
    return points @ np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]])


def points_of(winding, length) -> np.ndarray:
    return np.concatenate(winding.polylines(RADIUS, length, POINTS))


def are_all_among(points, others) -> bool:
    """Whether each point is one of the others, to round-off."""
    nearest = [np.abs(others - point).max(axis=1).min() for point in points]
    return bool(max(nearest) < 1e-12)


def crossings(winding, length) -> list[tuple[int, float]]:
    """Azimuth in whole degrees and height [mm] of every place where two threads meet."""
    found = set()
    for one, other in itertools.combinations(winding.polylines(RADIUS, length, POINTS), 2):
        distance = np.linalg.norm(one[:, None] - other[None], axis=2)
        for x, y, z in one[(distance < 1e-12).any(axis=1)]:
            found.add((round(np.degrees(np.arctan2(y, x)), 6) % 360, round(1e3 * z, 9)))
    return sorted(found)


@pytest.mark.parametrize("length", [PITCH, 10e-3, 60e-3, 1e-3])
@pytest.mark.parametrize(("kind", "threads"), [(DoubleHelix, 2), (SixHelix, 6)])
@pytest.mark.parametrize("pitch", [PITCH, 3.7e-3])
def test_helices_have_their_length_of_thread_on_any_length_of_body(kind, threads, length, pitch):
    exact = threads * length / pitch * np.hypot(2.0 * np.pi * RADIUS, pitch)
    winding = kind(psi=0.3, pitch=pitch)
    for line in winding.polylines(RADIUS, length, POINTS):
        assert line[0, 2] == 0.0
        assert line[-1, 2] == length
        np.testing.assert_allclose(np.hypot(line[:, 0], line[:, 1]), RADIUS, rtol=1e-14)
    # A chord of the angle a is short by the share a²/24. That angle is 1/POINTS of a turn, give or take the
    # rounding to whole segments.
    segments = max(1, round(POINTS * length / pitch))
    angle = 2.0 * np.pi * length / pitch / segments
    assert thread_length(winding, length, POINTS) == pytest.approx(exact * (1.0 - angle**2 / 24.0), rel=1e-5)


def test_rings_take_as_much_thread_as_the_double_helix_but_for_its_climb():
    rings, helix = (thread_length(layout(name), 60e-3, 360) for name in ("ring", "double-helix"))
    assert rings == pytest.approx(40 * 2.0 * np.pi * RADIUS, rel=2e-5)
    climb = np.hypot(1.0, PITCH / (2.0 * np.pi * RADIUS))
    assert helix / rings == pytest.approx(climb, rel=1e-6)


def test_six_helices_take_three_times_the_double_helixs_thread():
    assert thread_length(SixHelix(), 60e-3, POINTS) == pytest.approx(
        3.0 * thread_length(DoubleHelix(), 60e-3, POINTS), rel=1e-12
    )


@pytest.mark.parametrize("psi", [0.0, 30.0])
def test_the_double_helix_crosses_at_psi_and_opposite(psi):
    found = crossings(DoubleHelix(np.radians(psi)), 2.0 * PITCH)
    assert found == sorted([(psi, 0.0), (psi, 3.0), (psi, 6.0), (psi + 180.0, 1.5), (psi + 180.0, 4.5)])


@pytest.mark.parametrize("psi", [0.0, 30.0])
def test_six_helices_cross_at_psi_and_every_60_degrees(psi):
    found = crossings(SixHelix(np.radians(psi)), PITCH)
    heights = {k: [0.0, 1.0, 2.0, 3.0] if k % 2 == 0 else [0.5, 1.5, 2.5] for k in range(6)}
    assert found == sorted((psi + 60.0 * k, z) for k in range(6) for z in heights[k])


def test_rings_do_not_cross_and_are_closed():
    winding = Ring(2e-3)
    assert crossings(winding, 6e-3) == []
    for line in winding.polylines(RADIUS, 6e-3, POINTS):
        np.testing.assert_array_equal(line[0], line[-1])
        assert np.ptp(line[:, 2]) == 0.0
        steps = np.linalg.norm(np.diff(line, axis=0), axis=1)
        np.testing.assert_allclose(steps, 2.0 * RADIUS * np.sin(np.pi / POINTS), rtol=1e-12)


@pytest.mark.parametrize(
    ("spacing", "length", "heights"),
    [
        (1.5, 1.5, [0.75]),
        (1.5, 6.0, [0.75, 2.25, 3.75, 5.25]),
        (2.0, 5.5, [1.0, 3.0, 5.0]),  # 0.5 mm left above the last
        (2.0, 4.9, [1.0, 3.0]),  # no room for the third
        (8.0, 60.0, [4.0, 12.0, 20.0, 28.0, 36.0, 44.0, 52.0, 60.0]),  # the last on the end face itself
        (0.3, 0.9, [0.15, 0.45, 0.75]),  # three times 0.3 exceeds 0.9 in floating point
    ],
)
def test_rings_lie_half_a_spacing_above_the_base_and_then_every_spacing(spacing, length, heights):
    lines = Ring(1e-3 * spacing).polylines(RADIUS, 1e-3 * length, 12)
    np.testing.assert_allclose([1e3 * line[0, 2] for line in lines], heights, rtol=1e-12)
    assert max(line[0, 2] for line in lines) <= 1e-3 * length


@pytest.mark.parametrize("winding", [Ring(), SixHelix(psi=0.2)])
def test_a_turn_by_120_degrees_changes_nothing_in_rings_and_six_helices(winding):
    points = points_of(winding, PITCH)
    assert are_all_among(turned(points, 2.0 * np.pi / 3.0), points)


def test_a_turn_by_120_degrees_changes_a_double_helix():
    points = points_of(DoubleHelix(psi=0.2), PITCH)
    assert not are_all_among(turned(points, 2.0 * np.pi / 3.0), points)


@pytest.mark.parametrize("winding", [DoubleHelix(psi=0.2), SixHelix(psi=0.2), Ring()])
def test_the_period_is_the_smallest_shift_that_changes_nothing(winding):
    length = 4.0 * winding.period
    points = points_of(winding, length)

    def comes_back(shift) -> bool:
        moved = points + np.array([0.0, 0.0, shift])
        return are_all_among(moved[moved[:, 2] <= length * (1.0 + 1e-9)], points)

    assert comes_back(winding.period)
    # Shorter shifts on which the points of a helix lie, 48 a pitch, and others.
    for share in (1 / 2, 1 / 3, 1 / 4, 1 / 8, 1 / 16, 0.3):
        assert not comes_back(share * winding.period)


def test_no_winding_has_no_thread_and_any_period():
    assert NoWinding().polylines(RADIUS, 60e-3, POINTS) == []
    assert math.isinf(NoWinding().period)
    assert NoWinding().cell_length(12e-3) == PITCH


@pytest.mark.parametrize("kind", [DoubleHelix, SixHelix])
@pytest.mark.parametrize("psi", [0.0, 10.0, 15.0, 30.0, 45.0, 60.0, 90.0, 120.0])
def test_mirror_symmetry_is_that_of_the_crossings(kind, psi):
    winding = kind(np.radians(psi))
    azimuths = {azimuth for azimuth, _ in crossings(winding, PITCH)}
    mirrored = {round(-azimuth, 6) % 360 for azimuth in azimuths}
    assert winding.mirror_symmetric == (mirrored == azimuths)


@pytest.mark.parametrize("kind", [DoubleHelix, SixHelix])
@pytest.mark.parametrize("psi", [0.0, 10.0, 30.0, 60.0, 90.0, 120.0, 180.0])
def test_a_winding_is_its_mirror_image_in_place_if_each_point_has_an_image(kind, psi):
    winding = kind(np.radians(psi))
    points = points_of(winding, PITCH)
    assert winding.mirror_in_place == are_all_among(points * [1.0, -1.0, 1.0], points)


def test_layouts_by_name():
    assert [layout(name).name for name in LAYOUTS] == ["double-helix", "ring", "six-helix", "none"]
    assert layout("double-helix", 0.3, 4e-3) == DoubleHelix(0.3, 4e-3)
    assert layout("six-helix", 0.3, 4e-3) == SixHelix(0.3, 4e-3)
    assert layout("ring", 0.3, 4e-3) == Ring(2e-3)
    assert layout("ring", 0.3, 4e-3, 1e-3) == Ring(1e-3)
    assert layout("none", 0.3, 4e-3) == NoWinding()


@pytest.mark.parametrize(
    ("make", "named"),
    [
        (lambda: DoubleHelix(psi=np.nan), "psi: got nan, expected a finite angle"),
        (lambda: SixHelix(psi=np.inf), "psi: got inf"),
        (lambda: DoubleHelix(pitch=0.0), "pitch: got 0.0, expected a positive finite length"),
        (lambda: SixHelix(pitch=np.nan), "pitch: got nan"),
        (lambda: Ring(-1e-3), "spacing: got -0.001"),
        (lambda: Ring(np.inf), "spacing: got inf"),
        (lambda: layout("knot"), "layout: got 'knot', expected one of double-helix, ring, six-helix, none"),
        (lambda: layout("ring", pitch=0.0), "pitch: got 0.0"),
        (
            lambda: layout("none", spacing=1e-3),
            "spacing: got 1 mm for the layout none, expected it for rings",
        ),
        (
            lambda: Ring(7e-3).polylines(RADIUS, 6e-3, 12),
            "spacing: got 7 mm, expected at most the length of 6 mm",
        ),
        (lambda: Ring().polylines(RADIUS, 6e-3, 2), "points_per_turn: got 2, expected at least 3"),
        (lambda: DoubleHelix().polylines(RADIUS, 6e-3, 0), "points_per_turn: got 0"),
    ],
)
def test_impossible_windings_are_refused_by_name(make, named):
    with pytest.raises(ValueError, match=f"^{named}"):
        make()


@pytest.mark.parametrize(
    ("smallest", "named"),
    [
        (lambda factor: DoubleHelix(pitch=factor * 0.1778e-3), "pitch"),
        (lambda factor: SixHelix(pitch=factor * 3 * 0.1778e-3), "pitch"),
        (lambda factor: Ring(factor * 0.1778e-3), "spacing"),
    ],
)
def test_turns_closer_than_the_threads_diameter_are_refused(smallest, named):
    smallest(1.001).refuse_overlap(Thread())
    with pytest.raises(ValueError, match=f"^{named}: got .* mm, expected more than .*: turns of a thread"):
        smallest(0.999).refuse_overlap(Thread())
