"""What a state of the cell says of a whole body."""

import math

import numpy as np
import pytest

from fem_reference import Load, PeriodCell
from tests.fem_fixtures import TINY


@pytest.mark.parametrize(("chamber", "plane"), [(1, 0.0), (2, 120.0), (3, -120.0)])
def test_a_body_bends_away_from_its_chamber_by_its_length_times_the_curvature(chamber, plane):
    pressures = 4e3 * np.eye(3)[chamber - 1]
    state = PeriodCell(level=TINY).solve(Load((pressures[0], pressures[1], pressures[2])))
    angle, azimuth = state.bending(0.06)
    assert angle == pytest.approx(0.06 * np.linalg.norm(state.curvature[:2]), rel=1e-14)
    # The double helix turns the bend of chambers 2 and 3 by the asymmetry of their crossings.
    assert math.degrees(azimuth) == pytest.approx(plane, abs=5.0)


def test_half_as_long_a_body_bends_half_as_far_in_the_same_plane():
    state = PeriodCell(level=TINY).solve(Load((4e3, 1e3, 0.0)))
    (angle, plane), (half, same) = state.bending(0.06), state.bending(0.03)
    assert half == pytest.approx(angle / 2.0, rel=1e-15)
    assert same == plane
