"""Anderson acceleration: equations with a few soft directions take as many steps, saddles too."""

import numpy as np
import pytest

from fem_reference.algebra.factorisation import PardisoSolver
from fem_reference.solver import SolverOptions
from fem_reference.solver.anderson import AndersonMixing
from fem_reference.solver.modified_newton import anderson_steps
from tests.diagonal_problem import Diagonal, Push

# A⁻¹K in three directions, of both signs; one in all others.
SOFT = {0: 0.05, 1: -0.15, 2: 0.4}
UNKNOWNS = 30


@pytest.fixture
def stiffness() -> np.ndarray:
    values = np.ones(UNKNOWNS)
    values[list(SOFT)] = list(SOFT.values())
    turn = np.linalg.qr(np.random.default_rng(0).normal(size=(UNKNOWNS, UNKNOWNS)))[0]
    return turn.T @ np.diag(values) @ turn


def mixed(stiffness: np.ndarray, iterations: int) -> tuple[list[float], AndersonMixing]:
    """Sizes of steps −(K x − b) towards the solution of K x = b."""
    springs = Diagonal(lambda x: x, np.ones_like, UNKNOWNS, 1.0)
    mixing, x, right = AndersonMixing(springs), np.zeros(UNKNOWNS), np.arange(1.0, UNKNOWNS + 1.0)
    sizes = []
    for _ in range(iterations):
        step = right - stiffness @ x
        sizes.append(float(np.linalg.norm(step)))
        x = mixing.next(x + step, step)
    return sizes, mixing


def test_four_different_eigenvalues_take_five_steps(stiffness):
    """As GMRES does; plain steps grow by 1.15 each."""
    sizes, _ = mixed(stiffness, 6)
    assert sizes[4] > 1e-3 * sizes[0]
    assert sizes[5] < 1e-9 * sizes[0]


def test_they_tell_the_least_eigenvalue(stiffness):
    _, mixing = mixed(stiffness, 5)
    assert mixing.smallest == pytest.approx(-0.15, abs=1e-6)
    _, mixing = mixed(stiffness + 0.25 * np.eye(UNKNOWNS), 5)
    assert mixing.smallest == pytest.approx(0.1, abs=1e-6)


def test_two_states_do_not_tell_it(stiffness):
    _, mixing = mixed(stiffness, 2)
    assert mixing.smallest == np.inf


def test_a_mean_far_beyond_the_step_is_not_taken():
    """Along a direction of a hundredth of the stiffness a combined step could be a hundred plain ones."""
    most = SolverOptions().anderson.farthest
    springs, x = Diagonal(lambda x: x, np.ones_like, 2, 1.0), np.zeros(2)
    stiffness, mixing = np.diag([0.01, 1.0]), AndersonMixing(springs)
    for _ in range(4):
        step = np.ones(2) - stiffness @ x
        before, x = x, mixing.next(x + step, step)
        assert np.linalg.norm(x - before) <= most * np.linalg.norm(step)


@pytest.mark.parametrize(("weakest", "tried"), [(1e-3, 0.0), (0.5, 1.0)])
def test_steps_beyond_the_problems_reach_are_not_tried(weakest, tried):
    """Walls in the way of a step of metres would fill the memory; 1 N on a spring of 1 N/m goes one."""
    springs = Diagonal(lambda x: weakest * x, lambda x: np.full_like(x, weakest), 3, reach=5.0)
    target, at, solver = Push(np.ones(3)), np.zeros(3), PardisoSolver()
    linear = springs.linearise(at, target)
    solver.factorise(springs.pattern.matrix(linear.data), 0)
    found, *_, softest = anderson_steps(springs, solver, target, at, linear, rough=False)
    assert (softest is None) == (tried == 0.0)
    np.testing.assert_allclose(found, tried * 2.0)
    assert springs.longest_step == pytest.approx(tried * 2.0)
