"""Shares of convex contact, and steps with another matrix that are alike: many of them are taken at once."""

import numpy as np
import pytest

from fem_reference.damping import Damping, Stretch
from fem_reference.linear_solver import PardisoSolver
from tests.diagonal_problem import Diagonal, Push

DIRECTION = 1e-3 * np.random.default_rng(0).uniform(-1.0, 1.0, (40, 3))


def factors(ratio: float, count: int, scale: float = 1.0) -> list[float]:
    stretch = Stretch()
    return [stretch.factor(scale * ratio**k * DIRECTION) for k in range(count)]


@pytest.mark.parametrize(("ratio", "expected"), [(0.75, 4.0), (0.97, 8.0), (1.03, 8.0), (1.25, 4.0)])
def test_the_sum_of_what_follows_is_taken_at_once_and_then_three_steps_are_seen_anew(ratio, expected):
    np.testing.assert_allclose(factors(ratio, 6), [1.0, 1.0, expected, 1.0, 1.0, expected], rtol=1e-12)


def test_a_minimum_of_a_parabola_is_met():
    """With four times its stiffness a step goes a quarter of the way, and the next is 0.75 of it."""
    stiffness, wrong = 1.0, 4.0
    x, stretch = DIRECTION.copy(), Stretch()
    for _ in range(3):
        step = -stiffness / wrong * x
        x = x + stretch.factor(step) * step
    assert np.abs(x).max() <= 1e-12 * np.abs(DIRECTION).max()


def test_steps_that_shrink_fast_or_turn_are_left_alone():
    assert factors(0.5, 5) == [1.0] * 5
    stretch, random = Stretch(), np.random.default_rng(1)
    assert [stretch.factor(random.normal(size=(40, 3))) for _ in range(5)] == [1.0] * 5


def test_none_is_lengthened_beyond_a_third_of_a_millimetre():
    *_, last = factors(0.97, 3, scale=100.0)
    largest = 100.0 * 0.97**2 * np.abs(DIRECTION).max()
    assert last * largest == pytest.approx(0.3)
    assert factors(0.97, 3, scale=1e3)[-1] == 1.0


def test_a_step_after_a_break_does_not_follow_from_the_last():
    stretch = Stretch()
    stretch.factor(DIRECTION)
    stretch.factor(DIRECTION)
    stretch.forget()
    assert [stretch.factor(DIRECTION) for _ in range(2)] == [1.0, 1.0]


class Rounded(Diagonal):
    """Springs to which contact adds 4 N/mm where it is taken as convex."""

    exact = False

    def convex_contact(self, linear):
        return linear.data + 4.0


@pytest.mark.parametrize(
    ("softening", "least", "expected"),
    [
        (0.9, 0.0, [0.25, 0.125]),  # the first share serves, and less may
        (0.9, 1.0, [1.0, 0.5]),  # what is not tried is not known to be too little
        (1.5, 0.0, [0.5, 0.5]),  # a quarter was too little
        (1.5, 0.5, [0.5, 0.25]),
        (2.5, 0.5, [1.0, 1.0]),  # a half was too little
    ],
)
def test_shares_of_convex_contact(softening, least, expected):
    problem = Rounded(lambda x: -softening * x, lambda x: np.full_like(x, -softening), 1, reach=1.0)
    damping = Damping(problem, PardisoSolver(), 0, viscous=False, least=least)
    at = np.zeros(1)
    damping.factorise(at, problem.linearise(at, Push(at)), first=False)
    assert [damping.share, damping.next_share] == expected
