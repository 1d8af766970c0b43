"""Following loads: the state at a load is the load's own, and a path that ends too early says where."""

import numpy as np
import pytest

from fem_reference import CellError, Load, PeriodCell, follow
from fem_reference.algebra.factorisation import SuperLuSolver
from fem_reference.cell.problem import CellProblem, CellTarget
from fem_reference.errors import NewtonError
from fem_reference.solver import SolverOptions, solve_equilibrium
from fem_reference.solver.options import NewtonOptions, ViscousRelaxationOptions
from tests.fem_fixtures import TINY, load_of, relative_error

PRESSURE, MOMENT = (6e3, 4e3, 1e3), (1e-4, -2e-4, 5e-5)
LOAD = Load(PRESSURE, moment=MOMENT)
UNLOADED = Load((0.0, 0.0, 0.0))


@pytest.fixture(scope="module")
def state(small_cell):
    return small_cell.solve(LOAD)


def distance(found, expected) -> float:
    """Largest relative difference of two states' curvatures, volumes and Hessians."""
    return max(
        relative_error(found.curvature, expected.curvature),
        relative_error(found.volume, expected.volume),
        relative_error(found.hessian[:3, :3], expected.hessian[:3, :3]),
    )


# Nodal forces of 1e-9 N are left, of 1e-2 N applied; curvatures and volumes follow in proportion.
SETTLED = 1e-6


def test_a_state_answers_its_load(state):
    np.testing.assert_allclose(state.pressure, PRESSURE, rtol=1e-15)
    # The moment's tolerance is 1e-8 N mm.
    np.testing.assert_allclose(state.moment, MOMENT, rtol=0, atol=1e-11)
    assert state.load is LOAD
    assert state.converged
    assert state.stable
    assert 0.0 <= state.residual <= SolverOptions().convergence.force
    assert state.iterations > 0


def test_the_state_does_not_depend_on_the_way_there(small_cell, state):
    *_, detour = follow(small_cell, [Load((0.0, 8e3, 0.0)), Load((9e3, 0.0, 3e3)), LOAD])
    assert distance(detour, state) <= SETTLED
    assert detour.energy == pytest.approx(state.energy, rel=SETTLED)


def test_a_path_leads_back_to_rest(small_cell, state):
    back = small_cell.solve(UNLOADED, start=state)
    rest = small_cell.solve(UNLOADED)
    np.testing.assert_allclose(back.curvature, rest.curvature, rtol=0, atol=1e-6)
    np.testing.assert_allclose(back.volume, rest.volume, rtol=1e-6)
    # Against 0.1 J/m of the loaded state.
    assert abs(back.energy - rest.energy) <= 1e-9


def test_a_path_can_be_resumed_from_any_state(small_cell, state):
    goal = Load((8e3, 4e3, 1e3), moment=MOMENT)
    *_, straight = follow(small_cell, [LOAD, goal])
    assert distance(small_cell.solve(goal, start=state), straight) <= SETTLED


def test_the_state_at_hand_is_found_again_at_once(small_cell, state):
    again = small_cell.solve(LOAD, start=state)
    assert again.iterations == 0
    np.testing.assert_array_equal(again.curvature, state.curvature)


def test_imposing_the_free_curvature_takes_the_free_moment(small_cell, state):
    held = load_of(PRESSURE, curvature=state.curvature)
    for found in (small_cell.solve(held, start=state), small_cell.solve(held)):
        # A curvature off by 1e-6 of itself changes the moment of 4e-4 N m by as much.
        np.testing.assert_allclose(found.moment, MOMENT, rtol=0, atol=1e-9)
        np.testing.assert_array_equal(found.curvature, state.curvature)
        assert distance(found, state) <= SETTLED


def test_releasing_an_imposed_curvature_finds_the_free_state(small_cell, state):
    held = Load(PRESSURE, curvature=(0.5, -1.0, 0.2))
    *_, released = follow(small_cell, [held, LOAD])
    assert distance(released, state) <= SETTLED


#: Only what is in equilibrium already converges.
STOPPED = SolverOptions(
    newton=NewtonOptions(iterations=1), viscous_relaxation=ViscousRelaxationOptions(steps=1)
)


def test_failure_carries_the_last_good_state(small_cell, monkeypatch):
    first = small_cell.solve(Load((2e3, 0.0, 0.0)))
    monkeypatch.setattr(small_cell, "options", STOPPED)
    with pytest.raises(
        CellError, match=r"^the cell did not converge: stopped at pressures \[2. 0. 0.\] kPa"
    ) as caught:
        small_cell.solve(Load((30e3, 0.0, 0.0)), start=first)
    last, reached = caught.value.last_good, caught.value.reached
    np.testing.assert_allclose(last.pressure, first.pressure, rtol=1e-12)
    np.testing.assert_array_equal(last.curvature, first.curvature)
    assert reached.pressure == pytest.approx((2e3, 0.0, 0.0))


def test_failure_from_rest_carries_the_unloaded_state(small_cell, monkeypatch):
    small_cell.solve(UNLOADED)
    monkeypatch.setattr(small_cell, "options", STOPPED)
    with pytest.raises(CellError) as caught:
        small_cell.solve(Load((2e3, 0.0, 0.0), curvature=(0.0, 1.0, 0.0)))
    last = caught.value.last_good
    np.testing.assert_array_equal(last.pressure, 0.0)


def test_a_cell_that_has_no_rest_state_says_so_without_one():
    cell = PeriodCell(level=TINY, options=SolverOptions(newton=NewtonOptions(iterations=0)))
    with pytest.raises(CellError, match="did not converge") as caught:
        cell.solve(Load((2e3, 0.0, 0.0)))
    assert caught.value.last_good is None
    assert caught.value.reached is None


def test_a_step_that_puts_the_cavity_inside_the_rod_is_refused(small_cell):
    """Rest positions with a curvature of 300 1/m: the rod moves by more than half its radius."""
    equations = small_cell.equations
    target = CellTarget(np.zeros(3), curvature=np.array([0.0, 0.3, 0.0]))
    with pytest.raises(NewtonError, match="inside the rod"):
        solve_equilibrium(CellProblem(equations), SuperLuSolver(), target, equations.rest())
