"""The compiled rod through Python: what it takes, what it says, rows and threads, poses along it."""

import math
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest

import rodmodel
from rodmodel import Actuator, CoreRod, Domain
from rodmodel.core import Result

DATASETS = Path(__file__).parents[4] / "calibration" / "datasets"
PRESSURE = np.array([30e3, 8e3, 2e3])
FORCE = np.array([0.01, -0.02, 0.005])
GRAVITY = np.array([0.0, 0.0, -9.81])


@pytest.fixture(scope="module")
def rod() -> CoreRod:
    return rodmodel.load_core("double-helix")


@pytest.fixture(scope="module")
def plain() -> CoreRod:
    """Linear law, EI = GJ = 1, L = 1, no cap."""
    return CoreRod.linear(
        np.eye(3), np.zeros((3, 3)), Actuator(1.0, 0.0, 0.1, 0.0, 0.0), Domain((1.0, 1.0, 1.0), 3.0, 1e9)
    )


def rotation(vector: np.ndarray) -> np.ndarray:
    from scipy.spatial.transform import Rotation

    return Rotation.from_rotvec(vector).as_matrix()


def test_an_arc_is_one_in_closed_form(rod: CoreRod) -> None:
    solution = rod.solve(PRESSURE)
    s = np.linspace(0.0, 0.057, 9)
    curvature = solution.curvature(s)
    np.testing.assert_allclose(curvature, np.broadcast_to(curvature[0], (9, 3)), rtol=1e-13)
    # Frames along an arc: each is the first one turned by the same axis.
    frames = solution.frames(s)
    for part, frame in zip(s, frames, strict=True):
        np.testing.assert_allclose(frame, frames[0] @ rotation(part * curvature[0]), atol=1e-13)


def test_stations_meet_the_tip_and_end_beyond_it(rod: CoreRod) -> None:
    solution = rod.solve(PRESSURE, FORCE, gravity=GRAVITY)
    end = rod.actuator.body_length + rod.actuator.cap_length
    np.testing.assert_allclose(solution.centreline(0.0), 0.0, atol=1e-18)
    np.testing.assert_allclose(solution.centreline(end), solution.tip_position, atol=1e-15)
    np.testing.assert_allclose(solution.frames(end), solution.tip_rotation, atol=1e-15)
    assert np.all(solution.curvature([end, 0.061]) == 0.0)
    assert np.all(np.isnan(solution.centreline([-1e-6, end + 1e-6])))
    assert solution.frames(np.zeros((2, 4))).shape == (2, 4, 3, 3)
    # Between the nodes: of order 4, so 64 steps and 256 differ by (1/64)^4 of the curvature's scale.
    fine = rod.solve(PRESSURE, FORCE, gravity=GRAVITY, steps=256)
    coarse = rod.solve(PRESSURE, FORCE, gravity=GRAVITY, steps=64)
    s = np.linspace(0.0, end, 41)
    np.testing.assert_allclose(coarse.centreline(s), fine.centreline(s), atol=1e-9)
    np.testing.assert_allclose(coarse.curvature(s[:-8]), fine.curvature(s[:-8]), atol=2e-4)


def test_the_base_moves_all_of_it(rod: CoreRod) -> None:
    turn, place = rotation(np.array([0.3, -0.5, 0.2])), np.array([0.1, 0.2, -0.3])
    loads = {"tip_force": FORCE, "gravity": GRAVITY, "distributed_force": [0.1, 0.0, 0.05]}
    still = rod.solve(PRESSURE, **loads, follower_force=[0.002, 0.0, -0.01])
    moved = rod.solve(
        PRESSURE,
        **{name: turn @ np.array(load) for name, load in loads.items()},
        follower_force=[0.002, 0.0, -0.01],
        base_position=place,
        base_rotation=turn,
    )
    np.testing.assert_allclose(moved.tip_position, place + turn @ still.tip_position, atol=1e-14)
    np.testing.assert_allclose(moved.tip_rotation, turn @ still.tip_rotation, atol=1e-12)
    np.testing.assert_allclose(
        moved.centreline([0.02, 0.05]), place + still.centreline([0.02, 0.05]) @ turn.T, atol=1e-13
    )
    assert moved.bending_angle == pytest.approx(still.bending_angle, abs=1e-12)


def test_a_straight_rod_has_a_bend_and_no_plane(rod: CoreRod) -> None:
    solution, jacobian = rod.jacobian([0.0, 0.0, 0.0])
    np.testing.assert_allclose(solution.bend, 0.0, atol=1e-15)
    assert np.all(np.isnan(jacobian.bending_angle["pressure"]))
    assert np.all(np.isnan(jacobian.bending_plane["pressure"]))
    # Chamber k bends towards its own azimuth; 1 Pa by some 4e-7 rad, differences of 100 Pa to 1e-3 of it.
    for chamber in range(3):
        step = 100.0 * np.eye(3)[chamber]
        slope = rod.solve(step).bend / 100.0
        np.testing.assert_allclose(
            jacobian.bend["pressure"][:, chamber], slope, atol=1e-2 * np.abs(slope).max()
        )
        azimuth = np.arctan2(*jacobian.bend["pressure"][::-1, chamber])
        assert math.remainder(azimuth - 2.0 * np.pi / 3.0 * chamber, 2.0 * np.pi) == pytest.approx(
            0.0, abs=0.05
        )


def test_bad_input_is_said_by_name(rod: CoreRod) -> None:
    with pytest.raises(ValueError, match=r"pressure: got shape \(2,\), expected \(3,\): three gauge"):
        rod.solve([1.0, 2.0])
    with pytest.raises(ValueError, match=r"tip_force: got 'up', expected three components \[N\]"):
        rod.solve(PRESSURE, "up")
    with pytest.raises(RuntimeError, match="a pressure is negative"):
        rod.solve([-1.0, 0.0, 0.0])
    with pytest.raises(RuntimeError, match=r"pressure: got \[80000.0, 0.0, 0.0\] Pa, expected what"):
        rod.solve([80e3, 0.0, 0.0])
    solution = rod.solve([-1.0, 0.0, 0.0], throw=False)
    assert solution.result is Result.bad_input
    assert np.all(np.isnan(solution.tip_position))
    assert not (solution.stable)
    assert not (solution.in_domain)
    assert not (solution.converged)
    mirror = np.diag([1.0, 1.0, -1.0])
    assert rod.solve(PRESSURE, base_rotation=mirror, throw=False).result is Result.bad_input


def test_results_say_what_stopped_a_solve(rod: CoreRod, plain: CoreRod) -> None:
    none = np.zeros(3)
    assert plain.solve(none, [100.0, 0.0, 0.0], throw=False, steps=8).result is Result.unresolved
    assert plain.solve(none, [0.0, 0.0, -5.0], throw=False).result is Result.unstable
    assert plain.solve(none, [1e4, 0.0, 0.0], throw=False, steps=64).result is Result.too_many_shots
    with pytest.raises(RuntimeError, match="solve: the rod would snap, or buckle"):
        plain.solve(none, [0.0, 0.0, -5.0])


def test_a_section_that_gives_way_is_unstable() -> None:
    """Legendre's condition: beyond 15.4 % of this moment the softest stiffness of a section is negative.

    The law is that of the coarse mesh, whose domain goes farther than that of the law that ships.
    """
    ring = rodmodel.load_core("ring", path=DATASETS / "near" / "ring_pitch3.json")
    pressure, moment = [53710.0, 13461.0, 13547.0], np.array([0.0004203, -0.00058412, -0.00015645])
    solution = ring.solve(pressure, tip_moment=moment, throw=False)
    assert solution.result is Result.unstable
    assert solution.load_fraction == pytest.approx(0.154, abs=0.001)
    assert ring.solve(pressure, tip_moment=0.14 * moment).stable


def test_rows_are_single_solves_and_a_bad_one_spoils_no_other(rod: CoreRod) -> None:
    pressures = np.stack([PRESSURE, [np.nan, 0.0, 0.0], [-1.0, 0.0, 0.0], 0.5 * PRESSURE])
    one, two = (
        rod.solve_many(pressure=pressures, tip_force=FORCE, threads=threads, volumes=True)
        for threads in (1, 2)
    )
    assert one.tobytes() == two.tobytes()
    np.testing.assert_array_equal(one["result"], [0, 1, 1, 0])
    for row in (0, 3):
        alone = rod.solve(pressures[row], FORCE, steps=32)
        np.testing.assert_array_equal(one["tip_position"][row], alone.tip_position)
        np.testing.assert_array_equal(one["chamber_volume"][row], alone.chamber_volume)
    assert np.all(np.isnan(one["tip_position"][1:3]))


def test_threads_share_a_rod(rod: CoreRod) -> None:
    pressures = np.random.default_rng(0).uniform(0.0, 30e3, (200, 3))
    expected = rod.solve_many(pressure=pressures, gravity=GRAVITY)["tip_position"]
    with ThreadPoolExecutor(2) as pool:
        found = list(pool.map(lambda p: rod.solve(p, gravity=GRAVITY, steps=32).tip_position, pressures))
    np.testing.assert_array_equal(found, expected)


def test_a_warm_start_finds_the_same_in_fewer_shots(rod: CoreRod) -> None:
    first = rod.solve(PRESSURE, FORCE)
    cold = rod.solve(1.001 * PRESSURE, FORCE)
    warm = rod.solve(1.001 * PRESSURE, FORCE, start=first)
    np.testing.assert_allclose(warm.tip_position, cold.tip_position, atol=1e-12)
    assert warm.shots < cold.shots


def test_the_volumes_are_those_of_the_section_over_an_arc(rod: CoreRod) -> None:
    """And over a loaded rod by Gregory's rule: of order 10, so 16 steps and 32 agree to rounding of 1e-9."""
    few, many = (rod.solve(PRESSURE, FORCE, gravity=GRAVITY, steps=n).chamber_volume for n in (32, 64))
    np.testing.assert_allclose(few, many, rtol=1e-6)
    arc = rod.solve(PRESSURE).chamber_volume
    light = rod.solve(PRESSURE, 1e-9 * FORCE).chamber_volume
    np.testing.assert_allclose(light, arc, rtol=1e-8)


def test_the_jacobian_along_the_rod_is_that_of_differences(rod: CoreRod) -> None:
    """Of order 4 in the steps: at 64, 1e-8 of the largest entry; differences of order 4 err by 1e-9 of it."""
    s = np.array([0.0, 0.013, 0.03, 0.0571, 0.0605, 0.066])
    inputs = {
        "pressure": (PRESSURE, 10.0),
        "tip_force": (FORCE, 1e-5),
        "tip_moment": (np.array([1e-4, 5e-5, -1e-4]), 1e-7),
        "gravity": (GRAVITY, 1e-2),
    }
    given = {name: value for name, (value, _) in inputs.items()}
    _, jacobian = rod.jacobian(**given, arc_lengths=s, steps=64)
    for name, (value, size) in inputs.items():
        for axis, unit in enumerate(np.eye(3)):
            slope: dict[str, np.ndarray] = {"tip_position": 0.0, "bend": 0.0, "positions": 0.0}
            for weight, place in ((1.0, -2.0), (-8.0, -1.0), (8.0, 1.0), (-1.0, 2.0)):
                there = rod.solve(**{**given, name: value + place * size * unit}, steps=64)
                parts = {
                    "tip_position": there.tip_position,
                    "bend": there.bend,
                    "positions": there.centreline(s),
                }
                slope = {key: slope[key] + weight / (12.0 * size) * part for key, part in parts.items()}
            for key, expected in slope.items():
                found = getattr(jacobian, key)[name][..., axis]
                np.testing.assert_allclose(found, expected, atol=1e-7 * np.abs(expected).max())


def test_rows_may_each_have_their_own_base(rod: CoreRod) -> None:
    places = np.array([[0.0, 0.0, 0.0], [0.1, -0.2, 0.3]])
    turns = np.stack([np.eye(3), rotation(np.array([0.4, 0.9, -1.3]))])
    own = rod.solve_many(pressure=PRESSURE, tip_force=FORCE, base_position=places, base_rotation=turns)
    shared = rod.solve_many(pressure=PRESSURE, tip_force=FORCE, base_position=places, base_rotation=turns[1])
    for row, (place, turn) in enumerate(zip(places, turns, strict=True)):
        alone = rod.solve(PRESSURE, FORCE, base_position=place, base_rotation=turn, steps=32)
        np.testing.assert_array_equal(own["tip_position"][row], alone.tip_position)
    assert shared.size == 2
    np.testing.assert_array_equal(shared["tip_position"][1], own["tip_position"][1])
    one = rod.solve_many(pressure=PRESSURE, base_rotation=turns[1])
    assert one.size == 1


def test_arguments_of_rows_are_said_by_name(rod: CoreRod) -> None:
    with pytest.raises(ValueError, match=r"pressure: got shape \(2, 3\), expected \(3,\) or \(3, 3\)"):
        rod.solve_many(pressure=np.zeros((2, 3)), tip_force=np.zeros((3, 3)))
    with pytest.raises(ValueError, match=r"pressure: got 'high', expected three gauge pressures \[Pa\]"):
        rod.solve_many(pressure="high")
    with pytest.raises(ValueError, match="pressure: got None, expected three gauge pressures"):
        rod.solve_many(tip_force=FORCE)
    with pytest.raises(
        ValueError, match="wind: got an argument of that name, expected any of pressure, tip_"
    ):
        rod.solve_many(pressure=PRESSURE, wind=FORCE)
    with pytest.raises(
        ValueError, match="wind: got an argument of that name, expected any of pressure, tip_"
    ):
        rod.jacobian(PRESSURE, wind=FORCE)
    with pytest.raises(ValueError, match="threads: got 0, expected 1 or more"):
        rod.solve_many(pressure=PRESSURE, threads=0)
    for call in (
        rod.solve,
        rod.jacobian,
        lambda pressure, steps: rod.solve_many(pressure=pressure, steps=steps),
    ):
        with pytest.raises(ValueError, match="steps: got 0, expected a whole number of 1 or more"):
            call(PRESSURE, steps=0)
    assert rod.solve_many(pressure=np.zeros((0, 3)), threads=2).size == 0
