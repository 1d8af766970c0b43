"""Where pressures fall on a path, a body would jump as they rise: states and their records say from where."""

from dataclasses import replace

import numpy as np
import pytest

from fem_reference import Actuator, ActuatorLoad
from fem_reference.actuator import VolumeState
from fem_reference.actuator.volume_continuation import VolumePathFollower
from fem_reference.cli._actuator import _text
from fem_reference.io import ActuatorRun, state_record
from fem_reference.solver import solve_equilibrium
from tests.fem_fixtures import TINY
from tests.unit.fem_reference.actuator.test_volume_control import SHORT


@pytest.fixture(scope="module")
def short() -> Actuator:
    return Actuator(SHORT, level=TINY)


@pytest.mark.parametrize(
    ("way", "limit"),
    [
        ((1.0, 2.0, 3.0), None),
        ((1.0, 2.0, 1.2, 1.7, 3.0), 2.0),
        # The first of two; by and by; and what rough states may leave is none.
        ((2.0, 1.2, 2.5, 2.2, 3.0), 2.0),
        ((1.0, 2.0, 1.85, 1.7, 3.0), 2.0),
        ((1.0, 2.0, 1.85, 1.95, 3.0), None),
    ],
)
def test_the_limit_is_where_pressures_first_fall(short, monkeypatch, way, limit):
    unloaded, goal = (ActuatorLoad((p, 0.0, 0.0)).target() for p in (0.0, 3e3))
    at = solve_equilibrium(short._problem, short._solver, unloaded, short.equations.rest())
    along = VolumePathFollower(short._problem, short._solver, at, unloaded)
    pressures = iter(way)

    def step(leg, here):
        pressure = 1e-3 * next(pressures)
        found = replace(at, configuration=VolumeState(at.configuration, pressure), linear=None)
        return found, goal if pressure == leg.end else leg.target(pressure), 1.0

    monkeypatch.setattr(along, "_next", step)
    along.follow(goal)
    assert along.jumped is (limit is not None)
    if limit is not None:
        np.testing.assert_allclose(along.limit.pressure, [1e-3 * limit, 0.0, 0.0], rtol=1e-12)
    # The next goal's way is another.
    along.follow(goal)
    assert not along.jumped


@pytest.mark.parametrize("limit", [None, np.array([2e3, 0.0, 1e3])])
def test_the_limit_is_told_and_kept(short, tmp_path, limit):
    load = ActuatorLoad((3e3, 0.0, 1.5e3))
    state = short.solve(load)
    assert not state.settled.jumped
    assert state.settled.limit_pressure is None
    state = replace(state, settled=replace(state.settled, limit_pressure=limit))
    record = state_record(state)
    assert record["limit_pressure_kpa"] == (None if limit is None else pytest.approx([2.0, 0.0, 1.0]))
    assert ("(stable, after a jump at 2  0  1 kPa)" in _text({**record, "elements": 1, "unknowns": 1})) is (
        limit is not None
    )
    run = ActuatorRun(tmp_path, {"case": 1})
    run._save(state, 1)
    kept, done = run.checkpoint(short, [load])
    assert done == 1
    assert kept.settled.jumped is state.settled.jumped
    np.testing.assert_equal(kept.settled.limit_pressure, limit)
