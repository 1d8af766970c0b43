"""The bound of a prediction's errors: its values, its nodes, and the numbers that it refuses."""

import json
import math
from dataclasses import replace

import numpy as np
import pytest

from rodmodel import Calibration, ErrorBound, read_calibration, save_calibration
from rodmodel.error_bound import MOST_NODES
from rodmodel.io import Adjustment
from tests.unit.rodmodel import calibrations

BOUND = ErrorBound((10e3, 30e3, 90e3), (0.01, 0.03, 0.09), (1e-4, 1e-4, 4e-4), 2.0, 0.5)
BY_BEND = replace(BOUND, bending_angle=(0.5, 1.5), angle_by_bend=(0.0, 0.02), tip_by_bend=(1e-5, 3e-5))


@pytest.mark.parametrize(
    ("pressure_sum", "moment", "angle", "tip"),
    [
        (0.0, 0.0, 0.01, 1e-4),
        (10e3, 0.0, 0.01, 1e-4),
        (20e3, 0.0, 0.02, 1e-4),
        (30e3, 1e-3, 0.032, 6e-4),
        (60e3, 0.0, 0.06, 2.5e-4),
        (500e3, 2e-3, 0.094, 14e-4),
    ],
)
def test_the_bound_is_linear_between_nodes_and_in_the_moment(pressure_sum, moment, angle, tip):
    assert BOUND.at(pressure_sum, moment) == pytest.approx((angle, tip), rel=1e-12)
    both = BOUND.at(np.array([pressure_sum, 30e3]), np.array([moment, 0.0]))
    np.testing.assert_allclose(both, [(angle, 0.03), (tip, 1e-4)], rtol=1e-12)
    assert BOUND.padded.at(pressure_sum, moment) == pytest.approx((angle, tip), rel=1e-12)


@pytest.mark.parametrize(
    ("bending_angle", "angle", "tip"),
    [(0.0, 0.0, 1e-5), (0.5, 0.0, 1e-5), (1.0, 0.01, 2e-5), (1.5, 0.02, 3e-5), (3.0, 0.02, 3e-5)],
)
def test_the_bound_grows_with_the_bend_between_nodes(bending_angle, angle, tip):
    straight = BOUND.at(20e3, 1e-3)
    expected = (straight[0] + angle, straight[1] + tip)
    for bound in (BY_BEND, BY_BEND.padded):
        assert bound.at(20e3, 1e-3, bending_angle=bending_angle) == pytest.approx(expected, rel=1e-12)
    both = BY_BEND.at(20e3, 1e-3, bending_angle=np.array([bending_angle, 0.0]))
    np.testing.assert_allclose(both[0], [expected[0], straight[0]], rtol=1e-12)
    # A bound without such a term says the same of all.
    assert BOUND.at(20e3, 1e-3, bending_angle=bending_angle) == straight
    assert BY_BEND.largest_angle == pytest.approx(0.11)
    # Without an angle nothing is promised that a bent rod would not keep.
    assert BY_BEND.at(20e3, 1e-3) == BY_BEND.at(20e3, 1e-3, bending_angle=math.pi)
    assert BY_BEND.without_bend == BOUND


def test_padding_fills_the_room_and_stays_so():
    padded = BY_BEND.padded
    for name in ("pressure_sum", "angle", "tip", "bending_angle", "angle_by_bend", "tip_by_bend"):
        assert len(getattr(padded, name)) == MOST_NODES
    assert padded.padded == padded


def test_a_number_is_a_constant_bound_of_the_angle():
    bound = ErrorBound.of(0.02)
    angle, tip = bound.at(np.array([0.0, 50e3, 1e6]), 5e-3)
    np.testing.assert_array_equal(angle, 0.02)
    assert np.isnan(tip).all()
    assert ErrorBound.of(BOUND) is BOUND
    assert bound == ErrorBound.of(0.02)
    assert np.isnan(bound.padded.tip).all()
    assert bound.at_least(0.03, 1e-3) == ErrorBound.of(0.03)
    assert BOUND.largest_angle == 0.09


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"pressure_sum": (), "angle": (), "tip": ()}, "pressure_sum: got 0 nodes, expected 1 to 8"),
        ({"pressure_sum": (10e3, 10e3, 20e3)}, "pressure_sum: got 10000 after 10000, .* increasing"),
        ({"angle": (0.1, 0.2)}, "angle: got 2 numbers, expected 3, one at each node"),
        ({"angle": (0.1, 0.2, 0.1)}, "angle: got 0.1 after 0.2, expected numbers that are not decreasing"),
        ({"angle": (0.1, math.nan, 0.3)}, "angle: got nan, expected finite numbers of 0 or more"),
        ({"tip": (0.1, math.nan, 0.3)}, "tip: got nan, expected finite numbers of 0 or more"),
        ({"tip": (-0.1, 0.2, 0.3)}, "tip: got -0.1, expected finite numbers of 0 or more"),
        ({"angle_per_moment": math.inf}, "angle_per_moment: got inf, expected finite"),
        ({"tip_per_moment": -1.0}, "tip_per_moment: got -1, expected finite"),
        ({"bending_angle": (0.0, 1.0)}, "angle_by_bend: got 1 numbers, expected 2, one at each node"),
        ({"tip_by_bend": ()}, "tip_by_bend: got 0 numbers, expected 1, one at each node"),
        ({"bending_angle": (math.nan,)}, "bending_angle: got nan, expected finite"),
        ({"angle_by_bend": (-0.1,)}, "angle_by_bend: got -0.1, expected finite"),
    ],
)
def test_what_tells_no_bound_is_refused(changes, said):
    with pytest.raises(ValueError, match=f"^{said}"):
        replace(BOUND, **changes)


def test_what_was_measured_lifts_the_bound_where_it_is_lower():
    measured = {"measured_angle_rad": {"p90": 0.02}}
    error = {**calibrations.calibration().error, **measured}
    found = replace(calibrations.calibration(), bound=BOUND, error=error).error_bound
    assert found.angle == (0.02, 0.03, 0.09)
    # A straight arc's tip moves by half its length and the cap for each radian: 0.036 m.
    assert found.tip == pytest.approx((7.2e-4, 7.2e-4, 7.2e-4))
    assert (found.angle_per_moment, found.tip_per_moment) == (2.0, 0.5)


def test_an_adjusted_law_states_the_bound_of_the_pressures_inside_it():
    gain = np.array([1.1, 0.9, 1.0])
    adjustment = Adjustment(1.0, gain, np.array([2e3, 0.0, 3e3]), np.zeros(3))
    found = adjustment.bound(BOUND)
    for reading in ((0.0, 0.0, 0.0), (20e3, 5e3, 0.0), (0.0, 30e3, 9e3), (60e3, 30e3, 30e3)):
        inside = np.sum(gain * reading + adjustment.pressure_offset)
        for mine, maps in zip(found.at(sum(reading), 1e-3), BOUND.at(inside, 1e-3), strict=True):
            assert mine >= maps - 1e-15
    # What the bend adds is the same.
    assert adjustment.bound(BY_BEND).at(0.0, bending_angle=1.0)[0] == pytest.approx(found.at(0.0)[0] + 0.01)
    assert adjustment.bound(BY_BEND).without_bend == found
    # Between equal gains they are the same.
    same = replace(adjustment, pressure_gain=np.full(3, 1.1)).bound(BOUND)
    assert same.at(40e3) == pytest.approx(BOUND.at(1.1 * 40e3 + 5e3), rel=1e-12)


def test_a_file_keeps_the_bound_and_one_of_before_has_no_growth_with_the_bend(tmp_path):
    file = tmp_path / "file.json"
    save_calibration(replace(calibrations.calibration(), bound=BY_BEND), file)
    assert read_calibration(file).bound == BY_BEND
    content = json.loads(file.read_text())
    for key in ("bending_angle_rad", "angle_by_bend_rad", "tip_by_bend_m"):
        del content["bound"][key]
    file.write_text(json.dumps(content))
    assert read_calibration(file).bound == BOUND


def test_the_old_name_of_the_bound_still_answers(tmp_path):
    save_calibration(replace(calibrations.calibration(), bound=BOUND), tmp_path / "file.json")
    read: Calibration = read_calibration(tmp_path / "file.json")
    assert read.bound == BOUND
    with pytest.warns(DeprecationWarning, match="Calibration.error_bound"):
        assert read.angle_error == 0.09
