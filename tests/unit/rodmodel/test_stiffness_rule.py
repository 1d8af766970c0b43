"""The paper's stiffness rule: distances to crossings, the ratios made of them, and what follows."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from rodmodel.stiffness_rule import crossing_distance, stiffness_ratio

DEGREES = np.linspace(0.0, 60.0, 241)
# Angles of a few radians, added and subtracted some times: errors of 1e-15 rad, 1e-13 deg.
ROUND_OFF = 1e-12


def ratios(degrees) -> np.ndarray:
    return np.asarray(jax.vmap(stiffness_ratio)(jnp.radians(jnp.asarray(degrees))))


@pytest.mark.parametrize(
    ("psi", "distances", "expected"),
    [
        (0.0, (0.0, 60.0, 60.0), (0.0, 1 / 2, 1 / 2)),
        (12.0, (12.0, 72.0, 48.0), (1 / 14, 2 / 3, 4 / 11)),
        (30.0, (30.0, 90.0, 30.0), (1 / 5, 1.0, 1 / 5)),
        (90.0, (90.0, 30.0, 30.0), (1.0, 1 / 5, 1 / 5)),
    ],
)
def test_distances_and_ratios_are_those_counted_out(psi, distances, expected):
    np.testing.assert_allclose(np.degrees(crossing_distance(np.radians(psi).item())), distances, atol=1e-9)
    np.testing.assert_allclose(stiffness_ratio(np.radians(psi).item()), expected, atol=ROUND_OFF)


def test_distances_are_those_to_the_nearer_of_the_two_crossings():
    """By another road: the angle between directions, from their dot products."""
    for psi in np.radians(np.arange(-400.0, 400.0, 7.0)):
        crossing = np.array([np.cos(psi), np.sin(psi)])
        azimuth = np.radians([0.0, 120.0, 240.0])
        cosine = np.column_stack([np.cos(azimuth), np.sin(azimuth)]) @ crossing
        # The arc cosine is worth 1e-8 near a cosine of one.
        expected = np.arccos(np.minimum(np.abs(cosine), 1.0))
        np.testing.assert_allclose(crossing_distance(psi.item()), expected, atol=3e-8)


def test_steps_of_60_degrees_renumber_the_chambers():
    # ψ + 120° moves chamber 1's ratio to chamber 2; ψ + 60° is that, less half a turn: to chamber 3.
    np.testing.assert_allclose(ratios(DEGREES + 120.0), np.roll(ratios(DEGREES), 1, axis=1), atol=ROUND_OFF)
    np.testing.assert_allclose(ratios(DEGREES + 60.0), np.roll(ratios(DEGREES), 2, axis=1), atol=ROUND_OFF)
    np.testing.assert_allclose(ratios(DEGREES + 180.0), ratios(DEGREES), atol=ROUND_OFF)


def test_the_opposite_orientation_is_the_mirror_image():
    np.testing.assert_allclose(ratios(-DEGREES), ratios(DEGREES)[:, [0, 2, 1]], atol=ROUND_OFF)


@pytest.mark.parametrize(
    "measure", [lambda r: r.sum(axis=1), lambda r: r.max(axis=1), lambda r: np.ptp(r, axis=1)]
)
def test_sum_largest_and_spread_rise_from_0_to_30_degrees(measure):
    """What the module says of them: best at 0°, worst at 30°, and 12° nothing special."""
    found = measure(ratios(np.linspace(0.0, 30.0, 121)))
    assert np.all(np.diff(found) > 0.0)


def test_the_ratios_are_evenly_spaced_at_12_degrees_to_a_quarter_of_a_degree():
    low, middle, high = np.sort(ratios([11.5, 12.0])).T
    gap = (high - middle) - (middle - low)
    assert gap[0] * gap[1] < 0.0
    root = 11.5 + 0.5 * gap[0] / (gap[0] - gap[1])
    assert root == pytest.approx(11.75, abs=0.05)
