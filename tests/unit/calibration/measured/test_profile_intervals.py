"""Intervals from the profile of the squares: right where they are known, and said where there is none."""

import numpy as np
import pytest

from calibration.measured.profile_intervals import LowerMinimumError, profile_intervals

RISE = 3.84
WIDE = np.full(2, 1e3)
# Ends are found to a fiftieth of the half width.
CLOSE = 0.02
DESIGN = np.array([[1.0, 0.2], [0.9, 1.1], [1.2, -0.4], [0.7, 0.5]])
DATA = np.array([2.0, 3.1, 1.4, 2.2])


def linear(x):
    return DESIGN @ x - DATA, DESIGN


def test_of_a_linear_model_they_are_those_of_the_covariance():
    found = np.linalg.lstsq(DESIGN, DATA, rcond=None)[0]
    half = np.sqrt(RISE * np.diag(np.linalg.inv(DESIGN.T @ DESIGN)))
    ends = profile_intervals(linear, found, RISE, -WIDE, WIDE)
    np.testing.assert_allclose((ends - found[:, None]) / half[:, None], [[-1, 1], [-1, 1]], atol=CLOSE)


def test_they_move_with_a_change_of_parameters():
    # The same model of the squares of the parameters: an interval's ends are the roots of its ends.
    def squared(y):
        return DESIGN @ y**2 - DATA, DESIGN * (2.0 * y)

    found = np.linalg.lstsq(DESIGN, DATA, rcond=None)[0]
    rise = 0.3
    ends = profile_intervals(linear, found, rise, -WIDE, WIDE)
    assert np.all(ends > 0.0)
    of_roots = profile_intervals(squared, np.sqrt(found), rise, 0.0 * WIDE, WIDE)
    np.testing.assert_allclose(
        of_roots**2 - found[:, None], ends - found[:, None], atol=2 * CLOSE * np.ptp(ends, axis=1).max()
    )
    # The linearised model has them even about the estimate, which they are not, by more than their error.
    off = np.abs(of_roots - np.sqrt(found)[:, None])
    assert np.all(off[:, 0] > (1.0 + 2 * CLOSE) * off[:, 1])


def test_a_bound_ends_an_interval_that_the_data_leave_open():
    found = np.linalg.lstsq(DESIGN, DATA, rcond=None)[0]
    ends = profile_intervals(
        linear, found, RISE, found - np.array([0.1, 50.0]), found + np.array([50.0, 0.1])
    )
    assert ends[0, 0] == pytest.approx(found[0] - 0.1, rel=1e-12)
    assert ends[1, 1] == pytest.approx(found[1] + 0.1, rel=1e-12)
    assert ends[0, 1] < found[0] + 49.0
    assert ends[1, 0] > found[1] - 49.0


def test_where_the_model_ends_before_the_squares_have_risen_so_does_what_is_known():
    found = np.linalg.lstsq(DESIGN, DATA, rcond=None)[0]

    def ending(x):
        residual, slopes = linear(x)
        return (residual if x[0] < found[0] + 0.2 else np.full(4, np.nan)), slopes

    ends = profile_intervals(ending, found, RISE, -WIDE, WIDE)
    assert ends[0, 1] == np.inf
    whole = profile_intervals(linear, found, RISE, -WIDE, WIDE)
    np.testing.assert_allclose(ends[0, 0], whole[0, 0], rtol=1e-12)


def test_a_local_minimum_is_told_with_where_the_squares_are_less():
    def double(x):
        # Two wells near ±1, of which the second residual raises the one at -1.
        residual = np.array([x[0] ** 2 - 1.0 - 0.2 * x[0], 0.5 * x[1], 0.5 * (x[0] - 1.0)])
        return residual, np.array([[2.0 * x[0] - 0.2, 0.0], [0.0, 0.5], [0.5, 0.0]])

    local = np.array([-0.75, 0.0])
    for _ in range(50):
        residual, slopes = double(local)
        local -= 0.2 * np.linalg.lstsq(slopes, residual, rcond=None)[0]
    assert local[0] < 0.0
    with pytest.raises(LowerMinimumError, match="local minimum") as caught:
        profile_intervals(double, local, RISE, -WIDE, WIDE)
    assert np.sum(double(caught.value.parameters)[0] ** 2) < np.sum(double(local)[0] ** 2)
