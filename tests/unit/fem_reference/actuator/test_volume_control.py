"""A path that is led by volume: its bordered system, its gradient, and the states of a path by load."""

from dataclasses import replace

import numpy as np
import pytest

from fem_reference import Actuator, ActuatorGeometry, ActuatorLoad
from fem_reference.actuator import VolumeState
from fem_reference.actuator.volume_continuation import VolumePathFollower
from fem_reference.actuator.volume_control import StopCondition, Volume, VolumeControlledProblem
from fem_reference.solver import PathFollower, solve_equilibrium
from tests.fem_fixtures import TINY, difference, relative_error

SHORT = ActuatorGeometry(body_length=9e-3, cap_length=3e-3)
GOAL = (9e3, 3e3, 0.0)


@pytest.fixture(scope="module")
def short() -> Actuator:
    return Actuator(SHORT, level=TINY)


def leg(actuator: Actuator, **loads) -> VolumeControlledProblem:
    origin, goal = (ActuatorLoad(p, **loads).target() for p in ((2e3, 1e3, 0.0), GOAL))
    return VolumeControlledProblem(actuator._problem, origin, goal)


def shaken(actuator: Actuator, pressure: float) -> VolumeState:
    rest = actuator.equations.rest()
    noise = 1e-3 * np.random.default_rng(0).uniform(-1.0, 1.0, rest.positions.shape)
    noise[actuator.equations.clamped] = 0.0
    return VolumeState(replace(rest, positions=rest.positions + noise), pressure)


def test_pressures_lie_on_the_path_at_its_own_scale(short):
    path = leg(short)
    for pressure, load in ((path.start, (2e3, 1e3, 0.0)), (path.end, GOAL)):
        np.testing.assert_allclose(path.target(pressure).pressure * 1e6, load, rtol=1e-13, atol=1e-9)
    # On with the same heading, π goes on where it was.
    after = VolumeControlledProblem(
        short._problem, path.goal, ActuatorLoad(tuple(2.0 * np.array(GOAL) - (2e3, 1e3, 0.0))).target()
    )
    assert after.start == pytest.approx(path.end, rel=1e-13)


def test_the_gradient_is_that_of_the_volume_and_of_the_residual_by_pressure(short):
    path, at = leg(short), shaken(short, 4e-3)
    linear = path.linearise(at, Volume(0.0))
    direction = np.random.default_rng(1).uniform(-1.0, 1.0, at.deformation.positions.shape)
    direction[short.equations.clamped] = 0.0

    def volume(t: float) -> float:
        moved = replace(at.deformation, positions=at.deformation.positions + t * direction)
        return path.volume(VolumeState(moved, at.pressure))

    free = short.equations.fold @ direction.ravel()
    # The volume is a cubic polynomial: the difference is exact but for 1e-14 of 1e3 mm³ over the step.
    assert linear.gradient @ free == pytest.approx(difference(volume, 1e-3), rel=1e-8)
    more = path.linearise(VolumeState(at.deformation, at.pressure + 1e-3), Volume(0.0))
    assert relative_error((linear.residual - more.residual) / 1e-3, linear.gradient) < 1e-9


@pytest.mark.parametrize("force", [(0.0, 0.0, 0.0), (0.02, -0.01, 0.01)])
def test_a_step_solves_the_bordered_system(short, force):
    path, at = leg(short, tip_force=force, follower=True), shaken(short, 4e-3)
    target = Volume(path.volume(at) + 1.0)
    linear = path.linearise(at, target)
    short._solver.factorise(path.pattern.matrix(linear.data), path.pattern.revision)
    step = path.newton_step(short._solver, linear, target)
    upper = path.pattern.matrix(linear.data)
    free = short.equations.fold @ step.positions.ravel()
    product = upper @ free + upper.T @ free - upper.diagonal() * free
    if linear.load_columns is not None:
        product -= linear.load_columns @ (linear.load_rows @ free)
    # PARDISO refines no further than 1e-9 of matrices with the stiff thread in them.
    found = product - step.pressure * linear.gradient
    np.testing.assert_allclose(found, -linear.residual, rtol=0, atol=1e-8 * np.abs(linear.residual).max())
    assert linear.gradient @ free == pytest.approx(1.0, rel=1e-8)


def test_an_arrival_asks_for_the_volume_that_the_path_gives_the_pressure_left():
    arrival = StopCondition(20e-3, 5e3)
    assert arrival.missing(123.0, 18e-3) == pytest.approx(10.0)
    assert arrival.imbalance(10.0) == pytest.approx(2e-3)


def test_an_arrival_holds_the_volume_where_the_stiffness_at_hand_is_much_too_stiff(short):
    path, at = leg(short), shaken(short, 4e-3)
    arrival = StopCondition(path.end, 5e3)
    linear = path.linearise(at, arrival)
    assert linear.missing == pytest.approx(5e3 * (path.end - 4e-3))
    touching = replace(linear, walls_touch=True)
    assert arrival.pressure_step(touching, 2.0, 1e3) == pytest.approx(-2.0 / 1e3)
    assert arrival.pressure_step(touching, 2.0, 4.5e3) == pytest.approx((linear.missing - 2.0) / 4.5e3)
    # A stiffness without walls in contact is exact: what is left of the pressure is made up for at once.
    assert arrival.pressure_step(linear, 2.0, 4.5e3) == pytest.approx(path.end - 4e-3)
    assert arrival.pressure_step(linear, 2.0, 1e3) == pytest.approx(-2.0 / 1e3)


class Softened:
    """A solver whose factors answer with a softness of the other sign."""

    factors = 0

    def factorise(self, upper, revision: int) -> int:
        return 1

    def solve(self, right: np.ndarray) -> np.ndarray:
        return -right


def test_one_negative_pivot_is_the_bordered_minimums_where_the_volume_falls_with_pressure(short):
    path = leg(short)
    linear = path.linearise(shaken(short, 4e-3), Volume(0.0))
    assert path.excess(Softened(), linear, 1) == 0
    assert path.excess(Softened(), linear, 3) == 2
    assert path.excess(Softened(), linear, 0) == 0
    assert path.excess(Softened(), linear, None) is None


def follower(actuator: Actuator, kind: type[PathFollower]) -> PathFollower:
    unloaded = ActuatorLoad().target()
    at = solve_equilibrium(actuator._problem, actuator._solver, unloaded, actuator.equations.rest())
    return kind(actuator._problem, actuator._solver, at, unloaded, 4.0)


def test_states_are_those_of_a_path_that_is_led_by_load(short):
    goals = [ActuatorLoad(p).target() for p in ((12e3, 4e3, 0.0), (3e3, 1e3, 0.0), (3e3, 1e3, 5e3))]
    by_load, by_volume = (follower(short, kind) for kind in (PathFollower, VolumePathFollower))
    for goal in goals:
        expected, found = by_load.follow(goal), by_volume.follow(goal)
        places, other = (each.configuration.positions for each in (found, expected))
        # Steps of 1e-6 mm in the root mean square are left to both; all of one may be in a single place.
        np.testing.assert_allclose(places, other, rtol=0, atol=2e-6 * np.sqrt(places.size))
        assert found.excess_negative == 0
        assert by_volume.target is goal
