"""Newton's method on problems of a few unknowns: line search, damping, branches, reach and failure."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import pytest

from fem_reference import newton
from fem_reference.assembly import SparsePattern
from fem_reference.linear_solver import PardisoSolver
from fem_reference.newton import Linearisation, NewtonError, Problem, solve_equilibrium


@dataclass(frozen=True)
class Move:
    positions: np.ndarray


class Diagonal(Problem):
    """Uncoupled unknowns, each with its own force and stiffness under a load."""

    constraints = 0
    noise = 0.0

    def __init__(self, force: Callable, stiffness: Callable, unknowns: int, reach: float) -> None:
        none = np.empty(0, np.int64)
        self.pattern = SparsePattern(unknowns, [np.arange(unknowns)[:, None]], (none, none))
        self.reach = reach
        self._force, self._stiffness = force, stiffness
        self.longest_step = 0.0

    def begin(self, start, target):
        return start

    def linearise(self, at, target):
        return Linearisation(self._force(at) - target, self._stiffness(at), walls_touch=False)

    def convex_walls(self, linear):
        return linear.data

    def imbalance(self, linear, target):
        return 0.0

    def newton_step(self, solver, linear, target):
        return Move(solver.solve(-linear.residual[:, None])[:, 0])

    def size(self, step, linear):
        return float(np.sqrt(np.mean(step.positions**2)))

    def is_small(self, step):
        return True

    def longest(self, step):
        return 1.0

    def advance(self, at, step, fraction, linear):
        self.longest_step = max(self.longest_step, fraction * self.size(step, linear))
        return at + fraction * step.positions

    def allowed(self, linear, trial):
        return 1.0

    def mean(self, states, weights):
        return sum(w * s for w, s in zip(weights, states, strict=True))

    def may_start(self, at, guess):
        return True


def solve(problem: Diagonal, load: float, start: float, inertia: int = 0):
    unknowns = problem.pattern.size
    return solve_equilibrium(
        problem, PardisoSolver(), np.full(unknowns, load), np.full(unknowns, start), inertia
    )


def test_steps_that_grow_are_halved():
    """Plain Newton on arctan diverges from beyond 1.39: its steps grow from the first to the second."""
    problem = Diagonal(np.arctan, lambda x: 1.0 / (1.0 + x**2), 3, reach=20.0)
    found = solve(problem, 0.0, 2.0)
    np.testing.assert_allclose(found.configuration, 0.0, atol=1e-9)
    assert found.excess_negative == 0


@pytest.mark.parametrize(("start", "end"), [(0.1, 1.0), (-0.2, -1.0)])
def test_an_indefinite_matrix_is_left_downhill(start, end):
    """The double well (x² − 1)²/4: Newton's own step from near zero would go to the maximum there."""
    well = Diagonal(lambda x: x**3 - x, lambda x: 3.0 * x**2 - 1.0, 2, reach=0.5)
    found = solve(well, 0.0, start)
    np.testing.assert_allclose(found.configuration, end, atol=1e-9)
    assert found.excess_negative == 0


def test_a_branch_of_saddles_is_followed_where_it_is_asked_for():
    well = Diagonal(lambda x: x**3 - x, lambda x: 3.0 * x**2 - 1.0, 1, reach=0.5)
    found = solve(well, 0.01, 0.1, inertia=1)
    # x³ − x = 0.01 next to zero: x = −0.01 − 10⁻⁶ + ...
    assert found.configuration[0] == pytest.approx(-0.010001, abs=1e-8)
    assert found.excess_negative == 1


def test_no_step_is_longer_than_the_reach():
    spring = Diagonal(lambda x: x, np.ones_like, 2, reach=0.25)
    found = solve(spring, 1.0, 0.0)
    np.testing.assert_allclose(found.configuration, 1.0, atol=1e-9)
    assert spring.longest_step == pytest.approx(0.25)


def test_what_does_not_converge_says_how_far_it_was(monkeypatch):
    monkeypatch.setattr(newton, "MAX_ITERATIONS", 3)
    spring = Diagonal(lambda x: x, np.ones_like, 2, reach=0.1)
    with pytest.raises(NewtonError, match="no convergence in 3 iterations"):
        solve(spring, 1.0, 0.0)


def test_a_force_that_is_not_finite_is_told():
    broken = Diagonal(lambda x: np.full_like(x, np.nan), np.ones_like, 1, reach=1.0)
    with pytest.raises(NewtonError, match="not finite at iteration 0"):
        solve(broken, 0.0, 0.0)
