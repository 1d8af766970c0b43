"""Cell and actuator as problems for Newton's method: residuals taken anew, resistance to leaving a state."""

import dataclasses
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest
import scipy.sparse as sparse

from fem_reference import ActuatorGeometry, ActuatorLoad, DoubleHelix, Ogden, Thread
from fem_reference.actuator.equations import ActuatorEquations
from fem_reference.actuator.model import ActuatorModel
from fem_reference.actuator.problem import ActuatorProblem
from fem_reference.algebra import default_solver
from fem_reference.cell.equations import CellEquations
from fem_reference.cell.problem import CellProblem, CellTarget
from fem_reference.solver import Problem
from tests.fem_fixtures import QUADRATIC, TINY, bent_configuration, difference, relative_error

CURVATURE = np.array([0.006, -0.02, 0.004])
PRESSURE = np.array([0.03, 0.01, 0.02])


@dataclass
class Case:
    """A problem at a state, and that state with its nodes moved."""

    problem: Problem
    target: Any
    at: Any
    moved: Any
    #: The move in the unknowns of the sparse system.
    move: np.ndarray

    def matrix(self, data: np.ndarray) -> sparse.csr_matrix:
        upper = self.problem.pattern.matrix(data)
        return (upper + sparse.triu(upper, 1).T).tocsr()


def cell(level) -> Case:
    equations = CellEquations(ActuatorGeometry(), Ogden(), DoubleHelix(), Thread(), level)
    at = bent_configuration(equations, CURVATURE)
    move = 1e-3 * np.random.default_rng(9).uniform(-1.0, 1.0, at.positions.shape)
    moved = dataclasses.replace(at, positions=at.positions + move)
    target = CellTarget(PRESSURE, moment=np.array([0.1, -0.2, 0.05]))
    return Case(CellProblem(equations), target, at, moved, np.append(move.ravel(), [0.0, 0.0]))


def actuator(level) -> Case:
    short = ActuatorGeometry(body_length=6e-3, cap_length=3e-3)
    equations = ActuatorEquations(
        ActuatorModel(short, Ogden(), DoubleHelix(), Thread(), level, 1070.0, "cap")
    )
    at = equations.rest()
    widened = at.positions.copy()
    # Wider sections keep the cavity off the barrier's wall.
    widened[: equations.nodes, :2] *= 1.002
    rng = np.random.default_rng(9)
    free = ~equations.clamped
    start = np.where(free, widened + 5e-4 * rng.uniform(-1.0, 1.0, widened.shape), at.positions)
    move = np.where(free, 5e-4 * rng.uniform(-1.0, 1.0, widened.shape), 0.0)
    at, moved = (dataclasses.replace(at, positions=x) for x in (start, start + move))
    load = ActuatorLoad((9e3, 4e3, 2e3), tip_force=(0.01, 0.0, 0.02), gravity=(1.0, 2.0, -9.81))
    return Case(ActuatorProblem(equations), load.target(), at, moved, equations.fold @ move.ravel())


CASES: dict[str, Callable[[], Case]] = {
    "cell": lambda: cell(TINY),
    "quadratic cell": lambda: cell(QUADRATIC),
    "actuator": lambda: actuator(TINY),
}


@pytest.fixture(scope="module", params=CASES)
def case(request) -> Case:
    return CASES[request.param]()


@pytest.mark.parametrize("rate", [None, 0.7])
def test_a_residual_taken_anew_is_that_of_a_whole_linearisation(case, rate):
    problem, target = case.problem, case.target
    viscous = None if rate is None else problem.viscous(case.at, rate)
    linear = problem.linearise(case.at, target, viscous)
    whole = problem.linearise(case.moved, target, viscous)
    anew = problem.update_forces(linear, case.moved, target, viscous)
    assert relative_error(anew.residual, whole.residual) <= 1e-12
    assert problem.imbalance(anew, target) == pytest.approx(problem.imbalance(whole, target), rel=1e-10)
    assert anew.walls_touch == whole.walls_touch
    # The stiffness stays, the other residual does not.
    np.testing.assert_array_equal(anew.data, linear.data)
    assert relative_error(linear.residual, whole.residual) > 1e-3


def test_resistance_is_linear_in_the_move_and_nothing_at_its_origin(case):
    problem, target = case.problem, case.target
    viscous = problem.viscous(case.at, 0.7)
    plain, resisted = (problem.linearise(case.at, target, v) for v in (None, viscous))
    np.testing.assert_array_equal(resisted.residual, plain.residual)
    added = case.matrix(resisted.data) - case.matrix(plain.data)
    force = problem.linearise(case.moved, target, viscous).residual
    force = force - problem.linearise(case.moved, target).residual
    # Round-off of the stiff parts' forces, some newtons, over forces of 1e-4 N.
    assert relative_error(added @ case.move, force) <= 1e-9


def test_a_stiffened_matrix_is_that_of_a_step_in_time(case):
    problem, target = case.problem, case.target
    viscous = problem.viscous(case.at, 0.35)
    plain, resisted = (problem.linearise(case.at, target, v) for v in (None, viscous.times(2.0)))
    before = plain.data.copy()
    stiffer = problem.stiffened(plain.data, viscous.times(2.0), plain)
    assert relative_error(stiffer, resisted.data) <= 1e-13
    np.testing.assert_array_equal(plain.data, before)
    np.testing.assert_allclose(
        viscous.times(2.0).matrices, problem.viscous(case.at, 0.7).matrices, rtol=1e-14
    )


@pytest.mark.parametrize("level", [TINY, QUADRATIC], ids=["linear", "quadratic"])
def test_resistance_to_a_change_of_the_strain_is_an_exact_derivative_too(level):
    """From the straight cell's positions to those of a bent one: the top face moves with the strain."""
    case = cell(level)
    equations = case.problem.equations
    viscous = case.problem.viscous(equations.rest(), 0.7)

    def linearise(t: float, i: int):
        at = dataclasses.replace(case.at, strain=case.at.strain + t * np.eye(4)[i])
        return equations.linearise(at, PRESSURE, exact=True, viscous=viscous)

    linear = linearise(0.0, 0)
    for i in range(4):
        # The step and the tolerance of the cell's own derivatives.
        slope = difference(lambda t, i=i: linearise(t, i).residual[:-2], 1e-6)
        assert relative_error(linear.node_strain[:-2, i], slope) <= 1e-6
        slope = difference(lambda t, i=i: linearise(t, i).strain_residual, 1e-6)
        assert relative_error(linear.strain_strain[i], slope) <= 1e-6


def test_a_bend_of_more_than_two_radians_is_shortened():
    """Beyond, the rigid motions along the rod are not told; a mean of states may ask for it."""
    case = cell(TINY)
    linear = case.problem.linearise(case.at, case.target)
    bend = case.at.strain + np.array([0.0, 2.1 / case.problem.equations.period, 0.0, 0.0])
    assert case.problem.allowed(linear, case.at) == 1.0
    assert case.problem.allowed(linear, dataclasses.replace(case.at, strain=bend)) == 0.5


def test_a_step_is_that_of_the_factors_at_hand_whatever_steps_were_taken_before():
    """What nodes do with the strain is kept with the factors, and goes with them."""
    case, solver = cell(TINY), default_solver(definite=True)
    problem, pattern, equations = case.problem, case.problem.pattern, case.problem.equations
    linear = problem.linearise(case.at, case.target)
    stiffer = 2.0 * linear.data
    steps = (
        (linear.data, linear),
        (None, problem.update_forces(linear, case.moved, case.target)),
        (stiffer, linear),
        (None, problem.linearise(case.moved, case.target)),
    )
    sizes = []
    for data, at in steps:
        if data is not None:
            solver.factorise(pattern.matrix(data), pattern.revision)
        found = problem.newton_step(solver, at, case.target)
        expected = CellProblem(equations).newton_step(solver, at, case.target)
        # One column or four at a time: the same to round-off, which the condition of some 1e5 makes more of.
        assert relative_error(found.strain, expected.strain) <= 1e-9
        assert relative_error(found.positions, expected.positions) <= 1e-9
        sizes.append(problem.size(found, at))
    assert len(set(sizes)) == len(sizes)
