"""Curves of a cycle: solid where calibrated, dashed elsewhere, with a gap where a plane changes sides."""

import numpy as np
import pytest
from matplotlib.figure import Figure

from rodmodel.view import changes_side, draw_cycle

LEVELS = (10.0, 20.0, 30.0, 20.0, 10.0)


def record(planes, inside=(True,) * 5, branches=("loading",) * 5):
    """Up to 30 kPa and down again."""
    rows = zip(LEVELS, planes, inside, branches, strict=True)
    return {
        "states": [
            {"pressure_kpa": [p, 0.0, 0.0], "bending_plane_deg": plane, "in_domain": known, "branch": branch}
            for p, plane, known, branch in rows
        ]
    }


def drawn(made):
    """Heights of the curves up, up outside, down and down outside, by the level of pressure."""
    axes = Figure().subplots()
    draw_cycle(axes, made, np.arange(1.0, 6.0))
    lines = [line.get_ydata() for line in axes.lines[:4]]
    return [np.asarray(line, float).tolist() for line in lines]


@pytest.mark.parametrize(
    ("plane", "expected"),
    [
        ([10.0, 12.0, 192.0, 190.0], [False, False, True, False]),
        # Near a whole turn nothing changes.
        ([359.0, 1.0, 358.0], [False, False, False]),
        ([None, 10.0, 100.5], [False, False, True]),
    ],
)
def test_a_plane_changes_sides_by_more_than_a_quarter_turn(plane, expected):
    assert changes_side(np.array(plane, float)).tolist() == expected


def test_there_is_a_gap_where_a_plane_changes_sides_and_none_at_a_jump_to_another_branch():
    planes = (120.0, 120.0, 300.0, 300.0, 120.0)
    up, _, down, _ = drawn(record(planes))
    np.testing.assert_array_equal(up, [1.0, 2.0, np.nan])
    np.testing.assert_array_equal(down, [np.nan, 4.0, np.nan])
    up, _, down, _ = drawn(record(planes, branches=("loading", "loading", "snapped", "snapped", "loading")))
    np.testing.assert_array_equal(up, [1.0, 2.0, 3.0])
    np.testing.assert_array_equal(down, [3.0, 4.0, 5.0])


def test_what_is_not_calibrated_is_dashed_to_its_calibrated_neighbours():
    up, up_beyond, down, _ = drawn(record((120.0,) * 5, inside=(True, False, True, True, True)))
    np.testing.assert_array_equal(up, [1.0, np.nan, 3.0])
    np.testing.assert_array_equal(up_beyond, [1.0, 2.0, 3.0])
    np.testing.assert_array_equal(down, [3.0, 4.0, 5.0])
