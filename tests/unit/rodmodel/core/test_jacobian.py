"""Derivatives of the pose, against differences of the solve with the same steps."""

from collections.abc import Mapping

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import rodmodel
from rodmodel import CoreRod
from rodmodel.core import CoreSolution

INPUTS = {
    "pressure": (np.array([20e3, 8e3, 3e3]), 10.0),
    "tip_force": (np.array([0.006, -0.013, 0.004]), 1e-5),
    "tip_moment": (np.array([1e-4, 5e-5, -1e-4]), 1e-7),
    "gravity": (np.array([3.0, -5.0, -7.0]), 1e-2),
}
GIVEN = {name: value for name, (value, _) in INPUTS.items()}
FOLLOWERS = {"follower_force": [0.005, 0.003, -0.01], "follower_moment": [5e-5, -1e-4, 8e-5]}
BASE = {
    "base_position": [0.1, 0.2, 0.3],
    "base_rotation": Rotation.from_rotvec([0.7, -1.9, 0.4]).as_matrix(),
}
DEAD = {**GIVEN, "distributed_force": [0.1, 0.05, -0.1]}
CASES = {
    "free": {"pressure": GIVEN["pressure"]},
    "free, moved base": {"pressure": GIVEN["pressure"], **BASE},
    "dead": DEAD,
    "dead, moved base": {**DEAD, **BASE},
    "follower": {**DEAD, **FOLLOWERS},
    "follower, moved base": {**DEAD, **FOLLOWERS, **BASE},
}
# Base, body, a node of 64 steps, stiff tip, cap.
STATIONS = np.array([0.0, 0.013, 0.03, 0.0571, 0.0595, 0.0605, 0.066])


@pytest.fixture(scope="module")
def rod() -> CoreRod:
    """Shipped, with ends and shear."""
    return rodmodel.load_core("double-helix")


def pose(solution: CoreSolution) -> dict[str, np.ndarray]:
    return {
        "tip_position": solution.tip_position,
        "tip_turn": solution.tip_rotation,
        "bend": solution.bend,
        "bending_angle": np.array(solution.bending_angle),
        "bending_plane": np.array(solution.bending_plane),
        "positions": solution.centreline(STATIONS),
        "turns": solution.frames(STATIONS),
    }


def differences(rod: CoreRod, given: Mapping[str, object], name: str, steps: int) -> dict[str, np.ndarray]:
    """Of order 4, by one of the inputs; turns ω of δR = ω × R."""
    size = INPUTS[name][1]
    here = pose(rod.solve(**given, steps=steps))
    columns = []
    for axis in np.eye(3):
        change = dict.fromkeys(here, 0.0)
        for weight, place in ((1.0, -2.0), (-8.0, -1.0), (8.0, 1.0), (-1.0, 2.0)):
            moved = {**given, name: np.asarray(given[name]) + place * size * axis}
            there = pose(rod.solve(**moved, steps=steps))
            change = {key: change[key] + weight / (12.0 * size) * there[key] for key in here}
        for key in ("tip_turn", "turns"):
            skew = change[key] @ np.swapaxes(here[key], -1, -2)
            change[key] = np.stack([skew[..., 2, 1], skew[..., 0, 2], skew[..., 1, 0]], axis=-1)
        columns.append(change)
    return {key: np.stack([column[key] for column in columns], axis=-1) for key in here}


def errors(rod: CoreRod, given: Mapping[str, object], steps: int) -> dict[tuple[str, str], float]:
    """Of each derivative by each input, of its largest entry."""
    _, jacobian = rod.jacobian(**given, steps=steps, arc_lengths=STATIONS)
    found = {}
    for name in INPUTS:
        if name not in given:
            continue
        for key, expected in differences(rod, given, name, steps).items():
            error = np.abs(getattr(jacobian, key)[name] - expected).max()
            found[key, name] = float(error / np.abs(expected).max())
    return found


@pytest.mark.parametrize("case", CASES)
def test_derivatives_are_those_of_differences(rod: CoreRod, case: str) -> None:
    """The equations are linearised before they are integrated: the two differ by the error of 64 steps.

    That is of order 4, and so is the interpolation between the nodes: 1e-8 of the largest entry, under loads
    that leave a tenth of it. Differences err by 1e-10, of rounding and of the fourth order in their step.
    """
    found = errors(rod, CASES[case], 64)
    assert len(found) == 7 * len(set(INPUTS) & set(CASES[case]))
    assert max(found.values()) < 1e-8, max(found, key=found.__getitem__)


def test_they_come_to_them_with_order_4(rod: CoreRod) -> None:
    """Up to 24 steps: with 36 the tolerance of the solves that are differenced shows, 5e-10 of 5e-9."""
    coarse, fine = (errors(rod, CASES["follower, moved base"], steps) for steps in (8, 24))
    for name in ("tip_force", "tip_moment", "gravity"):
        order = np.log(coarse["tip_position", name] / fine["tip_position", name]) / np.log(3.0)
        assert order == pytest.approx(4.0, abs=0.1)


def test_the_bend_is_smooth_where_the_rod_is_nearly_straight(rod: CoreRod) -> None:
    """Angles on both sides of 1e-4 rad, where a series takes over.

    The bend is θ times the azimuth from which the tangent leans. Between two of them, both on one line of the
    pressures, it grows by the mean of its slopes; what is left is of their second difference, 1e-8 of them.
    """
    way = np.array([1.0, 0.4, 0.0])
    sizes = np.array([2.0, 4.0, 6.0, 7.0, 8.0, 9.0, 12.0, 15.0])
    bends, slopes = [], []
    for size in sizes:
        solution, jacobian = rod.jacobian(size * way)
        tangent = solution.tip_rotation[:, 2]
        sine = np.hypot(tangent[0], tangent[1])
        expected = -np.arctan2(sine, tangent[2]) * tangent[:2] / sine
        np.testing.assert_allclose(solution.bend, expected, rtol=1e-10)
        assert np.hypot(*solution.bend) == pytest.approx(solution.bending_angle, rel=1e-10)
        bends.append(solution.bend)
        slopes.append(jacobian.bend["pressure"] @ way)
    angles = np.linalg.norm(bends, axis=1)
    assert angles[0] < 5e-5
    assert angles[-1] > 1.5e-4
    means = 0.5 * (np.array(slopes[1:]) + np.array(slopes[:-1]))
    np.testing.assert_allclose(np.diff(bends, axis=0) / np.diff(sizes)[:, None], means, rtol=1e-7)
