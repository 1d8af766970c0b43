"""Inertia correction, and longer steps where steps with a corrected matrix are alike."""

from dataclasses import replace

import numpy as np
import pytest

from fem_reference.algebra.factorisation import PardisoSolver
from fem_reference.errors import UnstableError
from fem_reference.solver import Contact, SolverOptions
from fem_reference.solver.inertia_correction import InertiaCorrection
from fem_reference.solver.step_lengthening import StepLengthening
from tests.diagonal_problem import Counted, Diagonal, Push, tolerate

DIRECTION = 1e-3 * np.random.default_rng(0).uniform(-1.0, 1.0, (40, 3))


def factors(ratio: float, count: int, scale: float = 1.0) -> list[float]:
    stretch = StepLengthening()
    return [stretch.factor(scale * ratio**k * DIRECTION) for k in range(count)]


@pytest.mark.parametrize(("ratio", "expected"), [(0.75, 4.0), (0.97, 8.0), (1.03, 8.0), (1.25, 4.0)])
def test_the_sum_of_what_follows_is_taken_at_once_after_three_steps(ratio: float, expected: float) -> None:
    np.testing.assert_allclose(factors(ratio, 3), [1.0, 1.0, expected], rtol=1e-12)


def led(stiffness: float, wrong: float, count: int) -> tuple[np.ndarray, list[float]]:
    """Where a parabola's steps with a wrong stiffness lead from `DIRECTION`, and their factors."""
    x, stretch, taken = DIRECTION.copy(), StepLengthening(), []
    for _ in range(count):
        step = -stiffness / wrong * x
        taken.append(stretch.factor(step))
        x = x + taken[-1] * step
    return x, taken


def test_a_minimum_of_a_parabola_is_met() -> None:
    """With four times its stiffness a step goes a quarter of the way, and the next is 0.75 of it."""
    x, _ = led(1.0, 4.0, 3)
    assert np.abs(x).max() <= 1e-12 * np.abs(DIRECTION).max()


def test_after_one_that_was_lengthened_the_next_is_so_at_once_and_farther() -> None:
    """A hundred times as stiff, of which each that is lengthened tells as much as the first three."""
    x, taken = led(1.0, 100.0, 7)
    np.testing.assert_allclose(taken, [1.0, 1.0, 8.0, 16.0, 32.0, 64.0, 100.0], rtol=1e-9)
    assert np.abs(x).max() <= 1e-9 * np.abs(DIRECTION).max()


def test_one_much_shorter_after_one_that_was_lengthened_still_follows_from_it() -> None:
    """0.88 of the way are gone by the eight; 0.12 is left, in steps of a ninth."""
    x, taken = led(1.0, 9.0, 4)
    np.testing.assert_allclose(taken, [1.0, 1.0, 8.0, 9.0], rtol=1e-9)
    assert np.abs(x).max() <= 1e-12 * np.abs(DIRECTION).max()


def test_steps_away_from_a_saddle_go_on_away_from_it() -> None:
    x, taken = led(-1.0, 20.0, 5)
    np.testing.assert_allclose(taken, [1.0, 1.0, 8.0, 16.0, 20.0], rtol=1e-9)
    assert np.vdot(x, DIRECTION) > 1.4 * np.vdot(DIRECTION, DIRECTION)


def test_steps_that_shrink_fast_or_turn_are_left_alone():
    assert factors(0.5, 5) == [1.0] * 5
    stretch, random = StepLengthening(), np.random.default_rng(1)
    assert [stretch.factor(random.normal(size=(40, 3))) for _ in range(5)] == [1.0] * 5


def test_none_is_lengthened_beyond_a_millimetre():
    *_, last = factors(0.97, 3, scale=300.0)
    largest = 300.0 * 0.97**2 * np.abs(DIRECTION).max()
    assert last * largest == pytest.approx(1.0)
    assert factors(0.97, 3, scale=3e3)[-1] == 1.0


def test_a_step_after_a_break_does_not_follow_from_the_last():
    stretch = StepLengthening()
    stretch.factor(DIRECTION)
    stretch.factor(DIRECTION)
    stretch.forget()
    assert [stretch.factor(DIRECTION) for _ in range(2)] == [1.0, 1.0]


class Sliding(Contact):
    """Contact of walls that slide, −1 N/mm, and with a round core, −4 N/mm."""

    def convexified(self, linear):
        return linear.data + 1.0

    def core_curvature_stiffness(self, linear):
        return np.full_like(linear.data, -4.0)


class Rounded(Diagonal):
    """Springs with `Sliding` contact."""

    tolerances = replace(Diagonal.tolerances, exact_stiffness=False)
    contact = Sliding()


@pytest.mark.parametrize(
    ("stiffness", "least", "expected"),
    [
        (-0.9, 0.0, [0.0, 0.0]),  # convex walls are enough
        (-0.9, 1.0, [1.0, 0.5]),  # what is not tried is not known to be too little
        (-0.9, 0.25, [0.25, 0.0]),
        (-1.5, 0.0, [0.25, 0.25]),  # all of the roundness was too much
        (-2.5, 0.0, [0.5, 0.5]),
        (-2.5, 0.5, [0.5, 0.25]),
        (-3.5, 0.5, [1.0, 1.0]),  # half of it was too much
    ],
)
def test_as_much_of_the_roundness_is_left_out_as_it_takes(stiffness, least, expected):
    problem = Rounded(lambda x: stiffness * x, lambda x: np.full_like(x, stiffness), 1, reach=1.0)
    damping = InertiaCorrection(problem, PardisoSolver(), 0, viscous=False, least=least)
    at = np.zeros(1)
    damping.factorise(at, problem.linearise(at, Push(at)), first=False)
    assert [damping.share, damping.next_share] == expected


def tried(stiffness: float, unknowns: int, exact: bool, viscous: bool) -> list[float]:
    """The least numbers of all matrices that are tried for equal springs."""
    problem = Rounded(lambda x: stiffness * x, lambda x: np.full_like(x, stiffness), unknowns, reach=1.0)
    tolerate(problem, exact_stiffness=exact)
    solver, at = Counted(), np.zeros(unknowns)
    damping = InertiaCorrection(problem, solver, 0, viscous)
    damping.factorise(at, problem.linearise(at, Push(at)), first=False)
    return solver.least


@pytest.mark.parametrize(("unknowns", "expected"), [(8, [-1.5, -0.5, 0.5]), (9, [-1.5, 2.5])])
def test_many_negative_pivots_have_all_of_the_roundness_left_out_at_once(unknowns, expected):
    """Convex walls take −2.5 N/mm to −1.5, a quarter of the roundness each 1 N/mm more."""
    np.testing.assert_allclose(tried(-2.5, unknowns, exact=False, viscous=False), expected)


@pytest.mark.parametrize(
    ("unknowns", "exact", "rates"),
    [(1, False, [0.2, 0.8]), (2, False, [0.2, 3.2]), (3, False, [0.2, 12.8]), (3, True, [0.2, 0.8])],
)
def test_the_more_negative_pivots_are_left_the_faster_viscosity_grows(unknowns, exact, rates):
    """Without the concave part of contact −5.5 N/mm are −0.5."""
    least = tried(-5.5, unknowns, exact, viscous=True)
    np.testing.assert_allclose(least[-3:], [-0.5, *(rate - 0.5 for rate in rates)])


def test_where_the_stiffness_must_be_its_own_all_of_the_roundness_is_left_out():
    problem = Rounded(lambda x: -0.9 * x, lambda x: np.full_like(x, -0.9), 1, reach=1.0)
    tolerate(problem, exact_stiffness=True)
    damping = InertiaCorrection(problem, PardisoSolver(), 0, viscous=False)
    at = np.zeros(1)
    damping.factorise(at, problem.linearise(at, Push(at)), first=False)
    assert damping.share == 1.0


def test_what_no_share_changes_leaves_the_roundness_as_it_is():
    """A single element that lacks its pressure, where steps begin."""
    stiffness = np.array([-0.9, -100.0])
    problem = Rounded(lambda x: stiffness * x, lambda x: stiffness, 2, reach=1.0)
    damping = InertiaCorrection(problem, PardisoSolver(), 0, viscous=False)
    at = np.zeros(2)
    damping.factorise(at, problem.linearise(at, Push(at)), first=True)
    assert [damping.share, damping.next_share] == [0.0, 0.0]
    with pytest.raises(UnstableError, match="1 negative eigenvalues more than the branch"):
        damping.factorise(at, problem.linearise(at, Push(at)), first=False)


@pytest.mark.parametrize("exact", [True, False])
def test_it_is_given_up_after_many_steps(exact):
    """On the way to another equilibrium they grow away from a saddle and shrink again, over 20 and more."""
    options = SolverOptions().inertia_correction
    most = options.exact_steps if exact else options.steps
    assert exact or most > 20
    problem = Rounded(lambda x: -0.9 * x, lambda x: np.full_like(x, -0.9), 1, reach=1.0)
    tolerate(problem, exact_stiffness=exact)
    damping = InertiaCorrection(problem, PardisoSolver(), 0, viscous=False)
    at = np.zeros(1)
    linear = problem.linearise(at, Push(at))
    for _ in range(most):
        damping.factorise(at, linear, first=False)
    with pytest.raises(UnstableError, match=f"no equilibrium after {most} steps"):
        damping.factorise(at, linear, first=False)
