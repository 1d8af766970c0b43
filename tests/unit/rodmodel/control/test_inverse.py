"""The inverse: pressures for a bend or a tip position, within the domain, without needless co-contraction."""

import numpy as np
import pytest

from rodmodel import CoreRod
from rodmodel.control import inverse_many
from tests.unit.rodmodel.control.conftest import inside

GRAVITY = np.array([0.0, 0.0, -9.81])
#: Of a search that gives up: the grid of 8³, eleven descents of at most 200 steps, 12 for single chambers,
#: and what came before.
MOST_EVALUATIONS = 8**3 + 23 * 200 + 1800


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


def assert_inside(rod: CoreRod, pressure: np.ndarray) -> None:
    """Exactly, but for the rounding of a sum of three."""
    domain, total = rod.domain, pressure.sum(axis=1, keepdims=True)
    assert np.all(pressure >= 0.0)
    assert np.all(pressure <= np.array(domain.pressure_max))
    assert np.all(total <= domain.pressure_sum_max * (1.0 + 1e-15))
    beside = pressure + domain.beside_share * (total - pressure)
    assert np.all(beside <= domain.beside_max * (1.0 + 1e-15))


@pytest.mark.parametrize("kind", ["bend", "position", "loaded"])
def test_with_less_beside_each_other_targets_are_reached_by_pressures_of_the_domain(
    limited: CoreRod, kind: str
) -> None:
    loads = {"tip_force": np.array([0.002, -0.003, 0.001]), "gravity": GRAVITY} if kind == "loaded" else {}
    pressures = inside(limited)[: 200 if loads else None]
    wanted = limited.solve_many(pressure=pressures, steps=8, **loads)
    if kind == "bend":
        found = inverse_many(limited, wanted["bending_angle"], wanted["bending_plane"])
    else:
        found = inverse_many(limited, tip_position=wanted["tip_position"], **loads)
    assert np.all(found["reached"])
    assert np.all(found["solution"]["in_domain"])
    assert_inside(limited, found["pressure"])


def test_with_less_beside_each_other_the_nearest_is_nearest(rod: CoreRod, limited: CoreRod) -> None:
    """Bends out of reach: as near as any of a grid over the domain, on a limit that the rod's own lacks."""
    angles, planes = np.full(24, 3.5), np.linspace(0.0, 2.0 * np.pi, 24)
    found = inverse_many(limited, angles, planes)
    assert np.mean(found["nearest"]) >= 0.9
    assert not np.any(found["reached"])
    assert_inside(limited, found["pressure"])
    total = found["pressure"].sum(axis=1, keepdims=True)
    beside = found["pressure"] + limited.domain.beside_share * (total - found["pressure"])
    held = (beside.max(axis=1) > 66e3 * (1.0 - 1e-9)) | (total[:, 0] > 82e3 * (1.0 - 1e-9))
    assert np.mean(held) > 0.5
    side = np.linspace(0.0, 1.0, 28)
    states = np.stack(np.meshgrid(side, side, side), axis=-1).reshape(-1, 3) * limited.domain.pressure_max
    states = states[limited.domain.covers_pressure(states.T)]
    bends = limited.solve_many(pressure=states)["bend"]
    points = angles[:, None] * np.stack([np.cos(planes), np.sin(planes)], axis=1)
    nearest = np.array([np.linalg.norm(bends - point, axis=1).min() for point in points])
    assert np.all(found["distance"] <= nearest + 1e-3)
    # The whole domain comes nearer.
    assert np.all(inverse_many(rod, angles, planes)["distance"] <= found["distance"] + 1e-3)


def test_targets_under_loads_are_reached(rod: CoreRod, pressures: np.ndarray) -> None:
    random = np.random.default_rng(3)
    force = 0.01 * random.uniform(-1.0, 1.0, (100, 3))
    loads = {"tip_force": force, "gravity": GRAVITY}
    wanted = rod.solve_many(pressure=pressures[:100], steps=8, **loads)
    found = inverse_many(rod, tip_position=wanted["tip_position"], threads=2, **loads)
    assert np.all(found["reached"])


def along_single_chambers(rod: CoreRod, chamber: int, beside: float, count: int) -> np.ndarray:
    """Pressures beyond those that the chamber has beside others."""
    domain, random = rod.domain, np.random.default_rng(chamber)
    pressure = beside * random.uniform(size=(count, 3))
    pressure[:, chamber] = random.uniform(domain.pressure_max[chamber], domain.single_max[chamber], count)
    return pressure


@pytest.mark.parametrize("chamber", [0, 1])
@pytest.mark.parametrize("kind", ["bend", "position", "loaded"])
def test_a_chamber_alone_is_taken_to_its_own_limit(alone: CoreRod, chamber: int, kind: str) -> None:
    """Also with the little that the others may have; nothing outside the domain is answered."""
    loads = {"tip_force": np.array([0.001, -0.002, 0.001]), "gravity": GRAVITY} if kind == "loaded" else {}
    pressure = along_single_chambers(alone, chamber, alone.domain.single_beside, 50)
    wanted = alone.solve_many(pressure=pressure, steps=8, **loads)
    good = wanted["result"] == 0
    assert np.mean(good) > 0.9
    if kind == "bend":
        found = inverse_many(alone, wanted["bending_angle"][good], wanted["bending_plane"][good])
    else:
        found = inverse_many(alone, tip_position=wanted["tip_position"][good], **loads)
    reached = found["reached"] != 0
    # Near the end of the branch poses are folded: a search under loads may end beside its target.
    assert np.mean(reached) >= (0.95 if loads else 1.0)
    assert not np.any(found["nearest"][~reached])
    assert np.all(alone.domain.covers_pressure(found["pressure"].T))


def test_a_bend_of_one_chamber_alone_takes_no_other(alone: CoreRod) -> None:
    wanted = alone.solve([64e3, 0.0, 0.0])
    found = alone.inverse(bending_angle=wanted.bending_angle, bending_plane=0.0)
    np.testing.assert_allclose(found.pressure, [64e3, 0.0, 0.0], atol=50.0)
    assert found.nearest
    np.testing.assert_array_equal(found.pressure[1:], 0.0)


def test_out_of_reach_of_a_chamber_alone_its_end_is_nearest(alone: CoreRod) -> None:
    """It is said to be so, though no pressures beside each other come as near."""
    end = alone.solve([66e3, 0.0, 0.0])
    found = alone.inverse(bending_angle=end.bending_angle + 0.2, bending_plane=0.0)
    assert not found.reached
    assert found.nearest
    assert found.distance <= 0.2 + 1e-3
    assert found.pressure[0] == pytest.approx(66e3, abs=1.0)


def test_the_nearest_is_nearest(plain: CoreRod) -> None:
    """Of a point at the base one chamber comes to 56 mm; two chambers come nearer."""
    found = plain.inverse(tip_position=[0.0, 0.0, 0.0])
    # Where two chambers alike leave the domain.
    edge = plain.domain.reach((0.0, 1.0, 1.0))
    np.testing.assert_allclose(found.pressure, [0.0, edge, edge], atol=1.0)
    own = plain.solve([0.0, edge, edge]).tip_position
    assert found.distance == pytest.approx(float(np.linalg.norm(own)), abs=1e-6)
    beside = plain.solve([plain.domain.pressure_max[0], 0.0, 0.0]).tip_position
    assert found.distance < np.linalg.norm(beside) - 5e-3
    assert found.converged
    assert found.nearest
    assert not found.reached


@pytest.mark.parametrize("targets", [20, pytest.param(200, marks=pytest.mark.slow)])
def test_no_state_of_a_grid_is_nearer(rod: CoreRod, targets: int) -> None:
    """Up to the tolerance of 0.15 % of the length, to which pressures without co-contraction are taken."""
    found, nearest = searched(rod, targets)
    assert np.all(found["distance"] <= nearest + 1e-4)


@pytest.mark.parametrize("targets", [20, pytest.param(200, marks=pytest.mark.slow)])
def test_what_is_called_nearest_is_nearest(rod: CoreRod, targets: int) -> None:
    """And nearly all that is answered is called so."""
    found, nearest = searched(rod, targets)
    called = found["nearest"] != 0
    assert np.mean(called) >= 0.9
    assert np.all(found["distance"][called] <= nearest[called] + 1e-4)


def searched(rod: CoreRod, targets: int) -> tuple[np.ndarray, np.ndarray]:
    """Return what the inverse finds for random tips, and their distances from a grid over the domain."""
    random = np.random.default_rng(1)
    states = random.uniform(size=(60_000, 3)) * np.array(rod.domain.pressure_max)
    states = states[rod.domain.covers_pressure(states.T)][:20_000]
    tips = rod.solve_many(pressure=states, steps=8)["tip_position"]
    points = random.uniform([-0.07, -0.07, -0.07], [0.07, 0.07, 0.08], (targets, 3))
    nearest = np.array([np.linalg.norm(tips - point, axis=1).min() for point in points])
    return inverse_many(rod, tip_position=points), nearest


@pytest.mark.parametrize(
    "target",
    [
        {"tip_position": [1e300, 0.0, 0.0]},
        {"tip_position": [np.nan, 0.0, 0.0]},
        {"tip_position": [-20.5, -11.8, 60.5]},
        {"bending_angle": 1e9, "bending_plane": 0.0},
        {"bending_angle": 60.0, "bending_plane": 90.0},
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


@pytest.mark.parametrize("plane", np.linspace(0.0, 2.0 * np.pi, 13))
def test_planes_all_round_are_met_without_a_third_chamber(rod: CoreRod, plane: float) -> None:
    found = rod.inverse(bending_angle=0.7, bending_plane=plane)
    assert found.reached
    assert found.converged
    assert found.solution.bending_angle == pytest.approx(0.7, abs=1e-3)
    assert np.cos(found.solution.bending_plane - plane) == pytest.approx(1.0, abs=2e-6)
    # Where a chamber points that way, the search may end within rounding of the valves from the face.
    assert np.min(found.pressure) < 1.0


def test_a_straight_rod_takes_no_pressure(rod: CoreRod) -> None:
    for found in (rod.inverse(0.0, 1.0), rod.inverse(tip_position=[0.0, 0.0, 0.066])):
        assert found.reached
        assert np.all(found.pressure < 500.0)


def test_an_angle_out_of_reach_ends_on_the_bound(plain: CoreRod) -> None:
    """No pressures of the domain bend the rod to 6 rad; none on the edge where it bends most come nearer."""
    found = plain.inverse(bending_angle=6.0, bending_plane=0.0)
    assert not found.reached
    assert found.nearest
    assert plain.domain.covers_pressure(found.pressure)
    first, total = plain.domain.pressure_max[0], plain.domain.pressure_sum_max
    rest = np.linspace(0.0, total - first, 201)
    edge = np.stack([np.full(201, first), 0.5 * rest, 0.5 * rest], axis=1)
    bends = plain.solve_many(pressure=edge, steps=8)["bend"]
    assert found.distance <= np.linalg.norm(bends - [6.0, 0.0], axis=1).min() + 1e-3


def test_rows_are_single_targets_and_a_bad_one_spoils_no_other(rod: CoreRod) -> None:
    """On one thread as on two, with a load a row."""
    tip = rod.solve([30e3, 5e3, 0.0]).tip_position
    points = np.stack([tip, [np.nan, 0.0, 0.0], [0.0, 0.0, 0.3], tip * [1.0, -1.0, 1.0], [0.0, 0.0, 0.066]])
    forces = 0.004 * np.random.default_rng(4).normal(size=(5, 3))
    one, two = (
        inverse_many(rod, tip_position=points, tip_force=forces, threads=threads) for threads in (1, 2)
    )
    assert one.tobytes() == two.tobytes()
    np.testing.assert_array_equal(one["converged"], [1, 0, 1, 1, 1])
    assert np.all(np.isnan(one["pressure"][1]))
    for row in (0, 2, 3, 4):
        alone = rod.inverse(tip_position=points[row], tip_force=forces[row])
        np.testing.assert_array_equal(one["pressure"][row], alone.pressure)
        assert one["evaluations"][row] == alone.steps


def test_the_distance_is_that_of_the_solution(rod: CoreRod) -> None:
    loads = {"tip_force": [0.004, -0.006, 0.002], "gravity": GRAVITY}
    point = rod.solve([30e3, 10e3, 0.0], **loads, steps=8).tip_position
    found = rod.inverse(tip_position=point, **loads)
    again = rod.solve(found.pressure, **loads, steps=8).tip_position
    np.testing.assert_array_equal(found.solution.tip_position, again)
    assert found.reached
    assert found.distance == pytest.approx(np.linalg.norm(again - point), rel=1e-9)
    # Without the loads these pressures miss it.
    assert np.linalg.norm(rod.solve(found.pressure).tip_position - point) > 1e-3


@pytest.mark.parametrize("given", ["follower_force", "base_position"])
def test_loads_of_all_kinds_are_made_up_for(rod: CoreRod, given: str) -> None:
    load = {"follower_force": [0.003, -0.002, -0.01], "base_position": [0.1, -0.2, 0.05]}[given]
    pressures = np.array([[30e3, 8e3, 0.0], [0.0, 20e3, 25e3], [10e3, 0.0, 35e3]])
    wanted = rod.solve_many(pressure=pressures, steps=8, **{given: load})["tip_position"]
    found = inverse_many(rod, tip_position=wanted, **{given: load})
    assert np.all(found["reached"])
    back = rod.solve_many(pressure=found["pressure"], steps=8, **{given: load})["tip_position"]
    np.testing.assert_allclose(back, wanted, atol=1e-4)


def test_arguments_of_many_targets_are_said_by_name(rod: CoreRod) -> None:
    with pytest.raises(
        ValueError, match="bending_angle, bending_plane: got 3 and 2 numbers, expected as many"
    ):
        inverse_many(rod, bending_angle=[1.0, 1.0, 1.0], bending_plane=[0.0, 1.0])
    for name, said in (("pressure", "got one, expected targets"), ("wind", "got an argument of that name")):
        with pytest.raises(ValueError, match=f"{name}: {said}"):
            inverse_many(rod, tip_position=[[0.0, 0.0, 0.06]], **{name: [0.0, 0.0, 0.0]})
    many = inverse_many(rod, bending_angle=0.5, bending_plane=[0.0, 1.0], follower_force=[0.0, 0.0, -0.01])
    assert many["reached"].all()
    with pytest.raises(ValueError, match=r"base_rotation: got shape \(3,\), expected \(3, 3\): a rotation"):
        inverse_many(rod, tip_position=[[0.0, 0.0, 0.06]], base_rotation=[0.0, 0.0, 1.0])


@pytest.mark.parametrize("rows", [1, 2, 3])
def test_a_turned_base_is_made_up_for(rod: CoreRod, rows: int) -> None:
    turn = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    pressures = np.array([[30e3, 8e3, 0.0], [0.0, 20e3, 25e3], [10e3, 0.0, 35e3]])[:rows]
    wanted = rod.solve_many(pressure=pressures, steps=8, base_rotation=turn)["tip_position"]
    found = inverse_many(rod, tip_position=wanted, base_rotation=turn)
    assert np.all(found["reached"])
    back = rod.solve_many(pressure=found["pressure"], steps=8, base_rotation=turn)["tip_position"]
    np.testing.assert_allclose(back, wanted, atol=1e-4)
