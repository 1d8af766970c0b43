"""The rod's screw motions: against the matrix exponential, and their derivatives against differences."""

import numpy as np
import pytest
from scipy.linalg import expm

from fem_reference.cell.screw_motion import screw_series
from fem_reference.rotations import cross_matrix
from tests.fem_fixtures import difference

LENGTH = 6.0
CURVATURES = {
    "straight": np.zeros(3),
    "working range": np.array([0.01, -0.05, 0.004]),
    "nearly the limit": np.array([0.2, -0.2, 0.15]),
}


@pytest.fixture(params=list(CURVATURES.values()), ids=list(CURVATURES))
def curvature(request: pytest.FixtureRequest) -> np.ndarray:
    return request.param


def exponential(curvature: np.ndarray, s: float, stretch: float = 1.0) -> np.ndarray:
    generator = np.zeros((4, 4))
    generator[:3, :3] = cross_matrix(curvature)
    generator[2, 3] = stretch
    return expm(s * generator)


# The first omitted term is (s|u|)²²/22!, at most 2²²/22! = 4e-15; its derivatives in u carry a factor of up
# to s²·22².
@pytest.mark.parametrize("s", [-LENGTH, -0.7, 0.0, 3.0, LENGTH])
def test_the_series_is_the_matrix_exponential(curvature, s):
    value = screw_series(curvature, LENGTH).at(s)[0]
    np.testing.assert_allclose(value, exponential(curvature, s), rtol=0, atol=2e-14)


@pytest.mark.parametrize("s", [-LENGTH, 3.0, LENGTH])
def test_derivatives_are_the_slopes_in_curvature_and_stretch(curvature, s):
    # A step of 1e-3 in u turns by 6e-3 rad: the differences lose s (6e-3)⁴/30 = 3e-10 and round-off of 1e-12.
    strain = np.append(curvature, 1.02)

    def series(strain):
        return screw_series(strain[:3], LENGTH, strain[3])

    _, first, second = series(strain).at(s)
    for i, e in enumerate(np.eye(4)):
        slope = difference(lambda t, e=e: exponential((strain + t * e)[:3], s, (strain + t * e)[3]), 1e-3)
        np.testing.assert_allclose(first[i], slope, rtol=0, atol=1e-9)
        slope = difference(lambda t, e=e: series(strain + t * e).at(s)[1], 1e-3)
        # s²: one order of u more.
        np.testing.assert_allclose(second[i], slope, rtol=0, atol=1e-8)


def test_second_derivatives_commute(curvature):
    second = screw_series(curvature, LENGTH).at(LENGTH)[2]
    np.testing.assert_allclose(second, second.transpose(1, 0, 2, 3), rtol=0, atol=1e-13)


def test_the_motions_along_one_rod_compose(curvature):
    series = screw_series(curvature, LENGTH)
    np.testing.assert_allclose(series.at(2.5)[0] @ series.at(3.5)[0], series.at(6.0)[0], rtol=0, atol=5e-14)


def test_a_positive_second_curvature_bends_the_rod_towards_x():
    """r = ((1 − cos us)/u, 0, sin us/u): the exact arc of unit speed."""
    u, s = 0.05, 3.0
    motion = screw_series(np.array([0.0, u, 0.0]), s).at(s)[0]
    np.testing.assert_allclose(
        motion[:3, 3], [(1.0 - np.cos(u * s)) / u, 0.0, np.sin(u * s) / u], rtol=0, atol=1e-14
    )
    assert motion[0, 3] > 0.0


def test_cross_matrix_is_the_cross_product():
    a, b = np.array([1.0, -2.0, 3.0]), np.array([0.5, 4.0, -1.0])
    np.testing.assert_array_equal(cross_matrix(a) @ b, np.cross(a, b))


@pytest.mark.parametrize("curvature", [np.array([0.0, 0.4, 0.0]), np.array([0.0, np.nan, 0.0])])
def test_more_bending_than_the_series_can_take_is_refused(curvature):
    with pytest.raises(
        ValueError, match=r"curvature: got .* rad of bending over 6 mm, expected at most 2.0 rad"
    ):
        screw_series(curvature, LENGTH)
