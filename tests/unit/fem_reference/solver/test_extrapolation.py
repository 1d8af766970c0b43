"""Extrapolation along a path: exact for polynomials, and steps by what it leaves."""

import numpy as np
import pytest

from fem_reference.solver import weights
from fem_reference.solver.extrapolation import allowed_step


@pytest.mark.parametrize("back", [[], [0.7], [0.7, 1.9]])
def test_polynomials_through_all_states_are_continued_exactly(back):
    nodes = np.array([0.0, *(-b for b in back)])
    polynomial = np.poly1d(np.arange(1.0, len(nodes) + 1.0))
    found = weights(1.3, back) @ polynomial(nodes)
    assert found == pytest.approx(polynomial(1.3), rel=1e-13)
    assert sum(weights(1.3, back)) == pytest.approx(1.0, rel=1e-13)


@pytest.mark.parametrize("back", [[0.7], [0.7, 1.9]])
def test_the_next_step_misses_by_the_stride_what_the_last_missed_by_its_error(back):
    """A polynomial of one degree more than is extrapolated has that error exactly."""
    step, stride = 1.3, 0.1
    nodes = np.array([0.0, *(-b for b in back)])
    curve = np.poly1d([2.0, -1.0, 0.5, 3.0][-len(nodes) - 1 :])

    def missed(at: float, distance: float, states: list[float]) -> float:
        places = at + np.array([0.0, *(-b for b in states)])
        return abs(weights(distance, states) @ curve(places) - curve(at + distance))

    ahead = [step, *(b + step for b in back)][: len(back)]
    found = allowed_step(step, back, ahead, missed(0.0, step, back), stride)
    assert missed(step, found, ahead) == pytest.approx(stride, rel=1e-10)


def test_without_states_behind_an_error_or_a_stride_any_step_is_allowed():
    assert allowed_step(1.0, [], [1.0], 0.3, 0.1) == np.inf
    assert allowed_step(1.0, [1.0], [1.0, 2.0], 0.0, 0.1) == np.inf
    assert allowed_step(1.0, [1.0], [1.0, 2.0], 0.3, np.inf) == np.inf
