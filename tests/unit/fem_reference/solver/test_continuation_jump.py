"""Following loads past a fold: the body relaxes to the next equilibrium, and the path goes on."""

import numpy as np
import pytest

from fem_reference.algebra.factorisation import PardisoSolver
from fem_reference.errors import NewtonError, UnstableError
from fem_reference.solver import PathError, PathFollower, SolverOptions, continuation, solve_equilibrium
from fem_reference.solver.viscous_relaxation import relax
from tests.diagonal_problem import FOLD, Diagonal, Push, double_well, tolerate, well_minimum

# Forces of 1e-9 N are left; a spring at the loads below has at least 0.2 N/mm.
SETTLED = 1e-8


class Jumps:
    """The path's own relaxation, with a record of the loads that it was called for."""

    def __init__(self) -> None:
        self.loads: list[float] = []

    def __call__(self, problem, solver, target, start, options, within):
        self.loads.append(float(target.pressure[0]))
        return relax(problem, solver, target, start, options, within)


@pytest.fixture
def jumps(monkeypatch) -> Jumps:
    record = Jumps()
    monkeypatch.setattr(continuation, "relax", record)
    return record


def follower(problem: Diagonal, start: float, creeps: bool = True) -> PathFollower:
    """At the unloaded equilibrium that is found from ``start``."""
    solver, unloaded = PardisoSolver(), Push(np.zeros(problem.pattern.size))
    at = solve_equilibrium(problem, solver, unloaded, np.full(problem.pattern.size, start))
    return PathFollower(problem, solver, at, unloaded, creeps=creeps)


def test_up_to_the_fold_the_near_branch_is_followed(jumps):
    along = follower(double_well(reach=0.1), -1.0)
    for share in (0.3, 0.6, 0.9, 0.98):
        found = along.follow(Push(np.full(1, share * FOLD)))
        np.testing.assert_allclose(
            found.configuration, well_minimum(share * FOLD, -1.0), rtol=0, atol=SETTLED
        )
        assert found.excess_negative == 0
        assert not along.jumped
    assert jumps.loads == []


def test_beyond_the_fold_the_path_jumps_to_the_far_branch_and_goes_on(jumps):
    along = follower(double_well(reach=0.1), -1.0)
    for load in (0.3, 0.5, 0.7):
        found = along.follow(Push(np.full(1, load)))
        side = -1.0 if load < FOLD else 1.0
        np.testing.assert_allclose(found.configuration, well_minimum(load, side), rtol=0, atol=SETTLED)
        assert found.excess_negative == 0
        # Told with the goal that the jump was on the way to, and not with the next.
        assert along.jumped is (load == 0.5)
    # Once, for a load beyond the fold, and no farther beyond than a step.
    (load,) = jumps.loads
    assert FOLD < load <= 0.5


def test_a_path_that_is_not_to_jump_ends_below_the_fold(jumps):
    along = follower(double_well(reach=0.1), -1.0, creeps=False)
    with pytest.raises(PathError, match=r"^walls lose their balance") as caught:
        along.follow(Push(np.full(1, 0.5)))
    assert caught.value.unstable
    # A body that slides a short way to its next place would go on; this one moves by more than 1 mm.
    (load,) = jumps.loads
    last = float(caught.value.target.pressure[0])
    assert last < FOLD < load
    assert not along.jumped
    np.testing.assert_allclose(
        caught.value.last.configuration, well_minimum(last, -1.0), rtol=0, atol=SETTLED
    )


def test_a_soft_body_that_is_not_to_jump_ends_too(monkeypatch):
    """Thirty times as soft: the load itself moves it too far over the shortest step for a failure to tell."""
    tried = []

    def solve(problem, solver, target, *arguments, **named):
        tried.append(float(target.pressure[0]))
        assert len(tried) < 100, f"the path goes on for ever: {tried[-5:]}"
        return solve_equilibrium(problem, solver, target, *arguments, **named)

    soft = Diagonal(
        lambda x: (x / 30.0) ** 3 - x / 30.0, lambda x: (3.0 * (x / 30.0) ** 2 - 1.0) / 30.0, 1, reach=3.0
    )
    along = follower(soft, -30.0, creeps=False)
    monkeypatch.setattr(continuation, "solve_equilibrium", solve)
    with pytest.raises(PathError, match=r"^walls lose their balance") as caught:
        along.follow(Push(np.full(1, 0.5)))
    assert caught.value.unstable
    assert FOLD - SolverOptions().continuation.shortest <= float(caught.value.target.pressure[0]) < FOLD
    assert not along.jumped


@pytest.mark.parametrize("creeps", [True, False])
def test_a_body_that_slides_a_short_way_to_its_next_place_has_not_jumped(jumps, creeps):
    """Wells 0.04 mm apart: past the fold the body comes to rest 0.05 mm away, less than `slide`."""
    width = 0.02
    small = Diagonal(
        lambda x: width * ((x / width) ** 3 - x / width),
        lambda x: 3.0 * (x / width) ** 2 - 1.0,
        1,
        reach=0.01,
    )
    along = follower(small, -width, creeps=creeps)
    found = along.follow(Push(np.full(1, 0.5 * width)))
    np.testing.assert_allclose(found.configuration, width * well_minimum(0.5, 1.0), rtol=0, atol=SETTLED)
    assert len(jumps.loads) == 1
    assert not along.jumped


def test_a_goal_without_an_equilibrium_ends_a_path_that_is_not_to_jump_from_nearby(monkeypatch):
    """Rough states can be had as near to it as one likes, which would halve the way there for ever."""
    tried = []

    def solve(problem, solver, target, *arguments, on_the_way=False, **named):
        tried.append(float(target.pressure[0]))
        if not on_the_way:
            raise NewtonError("none here")
        return solve_equilibrium(problem, solver, target, *arguments, on_the_way=on_the_way, **named)

    def no_rest(*_):
        raise NewtonError("no rest either")

    along = follower(Diagonal(np.sinh, np.cosh, 1, reach=20.0), 0.0, creeps=False)
    monkeypatch.setattr(continuation, "solve_equilibrium", solve)
    monkeypatch.setattr(continuation, "relax", no_rest)
    with pytest.raises(PathError, match=r"^stopped at pressures") as caught:
        along.follow(Push(np.full(1, 10.0)))
    assert not caught.value.unstable
    left = 1.0 - float(caught.value.target.pressure[0]) / 10.0
    missed = SolverOptions().continuation.missed_share
    assert 0.5 * missed <= left < missed
    assert tried.count(10.0) > 1
    assert max(tried[:-1]) == 10.0 == tried[-1]


@pytest.mark.parametrize("beyond", [5.0, 10.3])
def test_iterations_that_fail_over_a_long_step_are_no_loss_of_balance(monkeypatch, beyond):
    """The load itself takes this body farther than the slide in every such step: only shorter ones can tell.

    Beyond a load steps of more than 0.1 N fail as at a loss of balance: on the way, or at the end of the leg.
    """
    at = [0.0]

    def solve(problem, solver, target, *arguments, **named):
        load = float(target.pressure[0])
        if load > beyond and load - at[-1] > 0.1:
            raise UnstableError("no equilibrium after 8 steps with another stiffness")
        found = solve_equilibrium(problem, solver, target, *arguments, **named)
        at.append(load)
        return found

    along = follower(Diagonal(lambda x: x, np.ones_like, 1, reach=20.0), 0.0, creeps=False)
    monkeypatch.setattr(continuation, "solve_equilibrium", solve)
    found = along.follow(Push(np.full(1, 10.5)))
    np.testing.assert_allclose(found.configuration, 10.5, rtol=0, atol=SETTLED)
    assert not along.jumped


def test_the_solver_may_be_used_by_others_between_two_goals():
    """Where extrapolation is refused the next start comes from the stiffness at hand, not from theirs."""
    goals = [Push(np.full(1, 1.0)), Push(np.full(1, 2.0))]
    found = {}
    for disturbed in (False, True):
        spring = Diagonal(np.sinh, np.cosh, 1, reach=20.0)
        spring.may_start = lambda at, guess: False
        along = follower(spring, 0.0)
        along.follow(goals[0])
        if disturbed:
            along.solver.factorise(spring.pattern.matrix(np.full(1, 1e-3)), spring.pattern.revision)
        found[disturbed] = along.follow(goals[1]).configuration[0], along.iterations
    assert found[True] == found[False]


def test_on_the_way_back_the_far_branch_is_kept_to_its_own_fold(jumps):
    """The cycle's two folds are at ±0.3849 N: a spring that snapped stays on its side to the lower one."""
    along = follower(double_well(reach=0.1), -1.0)
    ends = [float(along.follow(Push(np.full(1, load))).configuration[0]) for load in (0.5, 0.0, -0.3, -0.5)]
    expected = [well_minimum(load, side) for load, side in ((0.5, 1), (0.0, 1), (-0.3, 1), (-0.5, -1))]
    np.testing.assert_allclose(ends, expected, rtol=0, atol=SETTLED)
    assert len(jumps.loads) == 2


def test_steps_of_the_load_leave_newtons_method_a_short_way(monkeypatch):
    """On a spring of the force sinh x, to 100 N."""
    longest: dict[float, list[float]] = {}
    for stride in (np.inf, 0.01):
        spring = Diagonal(np.sinh, np.cosh, 1, reach=20.0)
        tolerate(spring, desired_step=stride)
        sizes = longest[stride] = []

        def solve(*arguments, sizes=sizes, **named):
            found = solve_equilibrium(*arguments, **named)
            sizes.append(found.longest)
            return found

        along = follower(spring, 0.0)
        monkeypatch.setattr(continuation, "solve_equilibrium", solve)
        found = along.follow(Push(np.full(1, 100.0)))
        np.testing.assert_allclose(found.configuration, np.arcsinh(100.0), rtol=0, atol=SETTLED)
    # The first steps have nothing to extrapolate from, and each is chosen by the one before.
    assert max(longest[0.01][8:]) <= 2.0 * 0.01 < max(longest[np.inf][8:])
    assert len(longest[np.inf]) < len(longest[0.01])


def test_springs_that_do_not_snap_are_taken_along(jumps):
    """One snaps; the other, twice as strong, has its fold at twice the force."""
    strength = np.array([1.0, 2.0])
    pair = Diagonal(lambda x: strength * (x**3 - x), lambda x: strength * (3.0 * x**2 - 1.0), 2, reach=0.1)
    found = follower(pair, -1.0).follow(Push(np.full(2, 0.5)))
    expected = [well_minimum(0.5, 1.0), well_minimum(0.25, -1.0)]
    np.testing.assert_allclose(found.configuration, expected, rtol=0, atol=SETTLED)
    assert len(jumps.loads) == 1


def test_a_fold_with_nothing_beyond_it_ends_the_path(jumps):
    """x − x³/3 carries 2/3 N and not more: there is no branch to jump to."""
    along = follower(Diagonal(lambda x: x - x**3 / 3.0, lambda x: 1.0 - x**2, 1, reach=0.1), 0.0)
    with pytest.raises(
        PathError, match=r"^stopped at pressures \[6\d\d\.?\d*\] kPa, where steps down to"
    ) as caught:
        along.follow(Push(np.ones(1)))
    last = float(caught.value.target.pressure[0])
    assert 0.6 < last <= 2.0 / 3.0
    roots = np.roots([-1.0 / 3.0, 0.0, 1.0, -last])
    # The stiffness falls to √(4/3 · (2/3 − f)) near the fold, 0.1 N/mm at 1e-2 N from it.
    assert np.abs(roots - caught.value.last.configuration[0]).min() <= 1e-6
    assert jumps.loads
    assert min(jumps.loads) > 2.0 / 3.0
