"""The inverse: pressures for a bend or a tip position, within the domain, without needless co-contraction."""

import numpy as np
import pytest

from rodmodel import CoreRod
from rodmodel.control import inverse_many

GRAVITY = np.array([0.0, 0.0, -9.81])
#: Of a search that gives up: the grid of 8³, eleven descents of at most 200 steps, and what came before.
MOST_EVALUATIONS = 8**3 + 11 * 200 + 1800


@pytest.mark.parametrize("kind", ["bend", "position"])
def test_1000_reachable_targets_are_reached(rod: CoreRod, pressures: np.ndarray, kind: str) -> None:
    wanted = rod.solve_many(pressure=pressures, steps=8)
    if kind == "bend":
        found = inverse_many(rod, wanted["bending_angle"], wanted["bending_plane"])
    else:
        found = inverse_many(rod, tip_position=wanted["tip_position"])
    assert np.all(found["reached"])
    assert np.all(found["pressure"] >= 0.0)
    assert np.all(found["pressure"].sum(axis=1) <= rod.domain.pressure_sum_max * (1.0 + 1e-12))
    if kind == "bend":
        # Two chambers make every bend that three make, to the tolerance of 1e-3 rad: 0.1 kPa of a third.
        assert np.all(found["pressure"].min(axis=1) <= 100.0)
        assert np.mean(found["pressure"].min(axis=1) == 0.0) >= 0.99
        assert np.all(found["pressure"].sum(axis=1) <= pressures.sum(axis=1) + 1e3)


def test_targets_under_loads_are_reached(rod: CoreRod, pressures: np.ndarray) -> None:
    random = np.random.default_rng(3)
    force = 0.01 * random.uniform(-1.0, 1.0, (100, 3))
    loads = {"tip_force": force, "gravity": GRAVITY}
    wanted = rod.solve_many(pressure=pressures[:100], steps=8, **loads)
    found = inverse_many(rod, tip_position=wanted["tip_position"], threads=2, **loads)
    assert np.all(found["reached"])


def test_the_nearest_is_nearest(rod: CoreRod) -> None:
    """Of a point at the base, (54, 0, 0) kPa comes to 56.7 mm; two chambers come nearer."""
    found = rod.inverse(tip_position=[0.0, 0.0, 0.0])
    np.testing.assert_allclose(found.pressure, [0.0, 50e3, 50e3], atol=1.0)
    assert found.distance == pytest.approx(50.2e-3, abs=0.05e-3)
    assert found.converged
    assert found.nearest
    assert not found.reached


@pytest.mark.parametrize("targets", [20, pytest.param(200, marks=pytest.mark.slow)])
def test_no_state_of_a_grid_is_nearer(rod: CoreRod, targets: int) -> None:
    """Up to the tolerance of 0.1 mm, within which the pressures without co-contraction are taken."""
    random = np.random.default_rng(1)
    states = random.uniform(size=(60_000, 3)) * np.array(rod.domain.pressure_max)
    states = states[states.sum(axis=1) <= rod.domain.pressure_sum_max][:20_000]
    tips = rod.solve_many(pressure=states, steps=8)["tip_position"]
    points = random.uniform([-0.07, -0.07, -0.07], [0.07, 0.07, 0.08], (targets, 3))
    found = inverse_many(rod, tip_position=points)
    nearest = np.array([np.linalg.norm(tips - point, axis=1).min() for point in points])
    assert np.all(found["distance"] <= nearest + 1e-4)
    assert np.mean(found["nearest"]) >= 0.9


@pytest.mark.parametrize(
    "target",
    [
        {"tip_position": [1e300, 0.0, 0.0]},
        {"tip_position": [np.nan, 0.0, 0.0]},
        {"bending_angle": 1e9, "bending_plane": 0.0},
        {"bending_angle": -1.0, "bending_plane": 0.0},
    ],
)
def test_what_no_rod_meets_is_refused(rod: CoreRod, target: dict[str, object]) -> None:
    found = rod.inverse(**target, throw=False)
    assert not (found.reached)
    assert not (found.converged)
    assert not (found.nearest)
    assert np.all(np.isnan(found.pressure))
    assert found.steps == 0
    with pytest.raises(RuntimeError, match=r"inverse: got a target that is not finite.*throw=False"):
        rod.inverse(**target)


def test_hopeless_loads_end_after_bounded_work(rod: CoreRod) -> None:
    found = rod.inverse(tip_position=[0.02, 0.0, 0.05], tip_force=[100.0, 0.0, 0.0], throw=False)
    assert not found.reached
    assert found.steps <= MOST_EVALUATIONS


def test_arguments_that_do_not_fit_are_named(rod: CoreRod) -> None:
    with pytest.raises(ValueError, match=r"got bending_angle, expected bending_angle and bending_plane, or"):
        rod.inverse(bending_angle=1.0)
    with pytest.raises(ValueError, match=r"tip_position: got shape \(2,\), expected \(3,\)"):
        rod.inverse(tip_position=[0.0, 0.0])
    with pytest.raises(ValueError, match=r"tip_force: got shape \(2,\), expected \(3,\): three components"):
        rod.inverse(tip_position=[0.0, 0.0, 0.06], tip_force=[0.0, 0.0])
