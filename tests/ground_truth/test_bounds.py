"""Bounds of the shipped calibrations against the full actuator's runs in the limit of fine meshes."""

from typing import Any

import numpy as np
import pytest

import rodmodel
from calibration.truth import (
    SHIPPED,
    Verdict,
    bound_for,
    compare_with_truth,
    coverage_by,
    load_truth,
    scales,
    title,
)

# Of fewer states one may be beyond a bound that holds for 80 %: such layouts count together.
_FEW = 5


@pytest.fixture(scope="module")
def verdict() -> Verdict:
    return compare_with_truth(load_truth(SHIPPED))


@pytest.fixture(scope="module")
def shares(verdict: Verdict) -> dict[str, Any]:
    return coverage_by(verdict)


@pytest.mark.parametrize("quantity", ["angle", "tip"])
def test_nine_states_in_ten_keep_the_stated_bound(shares: dict[str, Any], quantity: str) -> None:
    """By bounds of the issue's own: over all, in each layout and in each fifth of the pressures' sum."""
    assert shares["all"]["states"] >= 100
    assert 0.87 <= shares["all"][quantity] <= 0.96
    for row in shares["fifths"]:
        assert row[quantity] >= 0.8, row
    for name, row in shares["layouts"].items():
        assert row["states"] < _FEW or row[quantity] >= 0.8, name


# Of four states at a pitch of 6 mm, the only layout of so few, one angle and two tips are within: by its ends
# and, from 45 kPa on, by its mesh.
too_few = pytest.mark.xfail(strict=True, reason="one chamber at a pitch of 6 mm")


@too_few
@pytest.mark.parametrize("quantity", ["angle", "tip"])
def test_layouts_of_few_states_keep_it_together(shares: dict[str, Any], quantity: str) -> None:
    few = [row for row in shares["layouts"].values() if row["states"] < _FEW]
    kept = sum(row["states"] * row[quantity] for row in few)
    assert kept >= 0.8 * sum(row["states"] for row in few)


def test_the_bound_is_narrow_where_pressures_are_low(shares: dict[str, Any]) -> None:
    assert shares["median_bound_below_30_kpa_deg"] <= 1.5


def test_the_bound_is_narrow_where_a_rod_bends_by_a_quarter_turn(verdict: Verdict) -> None:
    """No wider than the limit of meshes, the map and the ends add up to there, each with 2 % of the angle."""
    bent = (verdict.rod_angle > np.deg2rad(60.0)) & (verdict.rod_angle < np.deg2rad(90.0)) & verdict.judged
    assert bent.sum() >= 15
    assert np.median(verdict.stated[bent] / verdict.rod_angle[bent]) <= 0.06


def test_each_file_has_the_bound_that_the_truth_of_the_others_tells(verdict: Verdict) -> None:
    """As `rodmodel-calibrate bounds` makes it of the laws, ends and runs that ship now."""
    scale = scales(verdict)
    for calibration in rodmodel.shipped_calibrations():
        made, note = bound_for(verdict, scale, calibration.layout)
        name = title(calibration.layout)
        assert calibration.bound is not None, name
        for key in (
            "angle",
            "tip",
            "angle_per_moment",
            "tip_per_moment",
            "bending_angle",
            "angle_by_bend",
            "tip_by_bend",
        ):
            np.testing.assert_allclose(getattr(calibration.bound, key), getattr(made, key), rtol=1e-6)
        stated = calibration.provenance["bound"]["judge_states_of_other_layouts"]
        assert stated == note["judge_states_of_other_layouts"]
        assert name not in stated
