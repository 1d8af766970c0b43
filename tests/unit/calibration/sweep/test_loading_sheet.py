"""A path goes on at imposed curvature where the section gives way, until its walls do.

The section here has a potential in closed form: its walls may lean aside by an amount a,
Π = EI/2 (u1² + u2²) + GJ/2 u3² − g p u2 + k(p)/2 a² − c a u1, with k(p) falling through zero.
"""

from dataclasses import replace

import numpy as np
import pytest
from manufactured_cell import without_nodes

from calibration.sweep.design import LoadingPath
from calibration.sweep.loading_sheet import STEPS, foreseen_curvature, only_gives_way
from calibration.sweep.tracing import trace_path
from fem_reference import CellError, CellState, Load

EI, GJ, G, C = 2e-4, 1.5e-4, -2e-7, 1.0
# Pressures at which the section gives way, where k = c²/EI, and where the walls do, where k = 0 [Pa].
SECTION, WALLS = 57.7e3, 65e3


def state_at(load: Load) -> CellState:
    pressure = np.asarray(load.pressure)
    walls = C**2 / EI * (WALLS - pressure[0]) / (WALLS - SECTION)
    stiffness = np.diag([EI - C**2 / walls, EI, GJ])
    push = np.array([0.0, G * pressure[0], 0.0])
    if load.curvature is None:
        moment = np.asarray(load.moment or (0.0, 0.0, 0.0))
        curvature = np.linalg.solve(stiffness, moment + push)
    else:
        curvature = np.asarray(load.curvature)
        moment = stiffness @ curvature - push
    hessian = np.zeros((6, 6))
    hessian[:3, :3] = stiffness
    hessian[1, 3] = hessian[3, 1] = -G
    negative = int(walls < 0.0) + (0 if load.curvature is not None else int(stiffness[0, 0] < 0.0))
    return CellState(
        load=load,
        pressure=pressure,
        curvature=curvature,
        moment=moment,
        stretch=1.0,
        energy=0.0,
        volume=np.zeros(3),
        hessian=hessian,
        iterations=1,
        residual=0.0,
        stable=negative == 0,
        negative_directions=negative,
        jumped=False,
        configuration=without_nodes(curvature),
    )


def trace(loads, start):
    for load in loads:
        yield state_at(load)


def path_to(kpa: float, step: float = 3.0) -> LoadingPath:
    return LoadingPath("p", "train", tuple(Load((1e3 * p, 0.0, 0.0)) for p in np.arange(step, kpa, step)))


def test_beyond_the_loss_of_lateral_stability_curvature_is_imposed_until_the_walls_lose_theirs():
    *states, end = trace_path(trace, path_to(80.0))
    pressure = np.array([state["pressure"][0] for state in states])
    held = np.array([state["held"] for state in states])
    np.testing.assert_array_equal(held, pressure > SECTION)
    step = 3e3 / STEPS
    np.testing.assert_allclose(np.diff(pressure[held == 1]), step)
    assert pressure[-1] < WALLS <= pressure[-1] + step
    assert all(state["stable"] == 1 for state in states)
    assert end["end"]["unstable"]["pressure"][0] == pressure[-1]
    # Here the curvature in the plane is linear in the pressure, so that it is foreseen exactly.
    np.testing.assert_allclose([state["moment"] for state in states], 0.0, atol=1e-15)
    np.testing.assert_allclose([state["curvature"][1] for state in states], G / EI * pressure, rtol=1e-12)


def test_in_the_plane_of_symmetry_the_load_stays_and_only_the_derivatives_across_are_kept():
    def symmetric(loads, start):
        for load in loads:
            yield replace(state_at(load), hessian=np.diag([0.0, 3e-4, 0.0, 1e-9, 2e-9, 2e-9]), stable=True)

    *states, end = trace_path(trace, path_to(80.0), in_plane=lambda: symmetric)
    pressure = np.array([state["pressure"][0] for state in states])
    held = np.array([bool(state["held"]) for state in states])
    np.testing.assert_array_equal(held, pressure > SECTION)
    assert end == {"end": {"attempts": 1}}
    last = np.array(states[held.argmax() - 1]["hessian"])
    for state in np.array([state["hessian"] for state in states])[held]:
        np.testing.assert_allclose(state[[0, 2], [0, 2]], last[[0, 2], [0, 2]])
        assert state[1, 1] == 3e-4
        np.testing.assert_allclose(state[4:, 4:], np.full((2, 2), 1e-9), atol=1e-15)


def test_loads_out_of_the_plane_are_followed_at_imposed_curvature():
    def never():
        raise AssertionError("the plane is left")

    loads = tuple(Load((1e3 * p, 1e3, 0.0)) for p in np.arange(3.0, 80.0, 3.0))
    *states, _ = trace_path(trace, LoadingPath("p", "train", loads), in_plane=never)
    assert any(state["held"] for state in states)


def test_a_path_that_ends_before_is_as_it_was():
    *states, end = trace_path(trace, path_to(50.0))
    assert not any(state["held"] for state in states)
    assert end == {"end": {"attempts": 1}}


def test_a_path_ends_where_walls_snap_aside():
    """The state after the snap is stable, and stiffer than the one before."""

    def snapping(loads, start):
        for state in trace(loads, start):
            if state.pressure[0] > 60e3 and state.load.curvature is not None:
                state = replace(state, hessian=np.diag([1e-4, EI, GJ, 0.0, 0.0, 0.0]), stable=True)
            yield state

    *states, end = trace_path(snapping, path_to(80.0))
    assert states[-1]["pressure"][0] == 60e3
    assert end["end"]["unstable"]["pressure"][0] == 60e3


def test_a_held_state_that_does_not_converge_ends_the_path():
    def failing(loads, start):
        for state in trace(loads, start):
            if state.load.curvature is not None:
                raise CellError("no", None)
            yield state

    *states, end = trace_path(failing, path_to(80.0))
    assert states[-1]["pressure"][0] == 57e3
    assert end["end"]["unstable"]["pressure"][0] == 60e3


def test_the_foreseen_curvature_leaves_a_direction_that_gives_way_alone():
    state = state_at(Load((60e3, 0.0, 0.0), curvature=(3.0, -50.0, 1.0)))
    assert not only_gives_way(state)
    u = foreseen_curvature(state, Load((60e3, 0.0, 0.0)))
    assert u[0] == pytest.approx(3.0, rel=1e-12)
    assert u[1:] == pytest.approx((G * 60e3 / EI, 0.0), rel=1e-12, abs=1e-12)


def test_a_section_whose_walls_give_way_too_is_not_held():
    assert only_gives_way(state_at(Load((60e3, 0.0, 0.0))))
    assert not only_gives_way(replace(state_at(Load((60e3, 0.0, 0.0))), negative_directions=2))
    assert not only_gives_way(replace(state_at(Load((60e3, 0.0, 0.0))), jumped=True))
