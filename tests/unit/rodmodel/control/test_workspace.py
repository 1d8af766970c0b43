"""The workspace: which pressures are sampled, and what the rod does there."""

from itertools import product

import numpy as np
import pytest

from rodmodel import CoreRod
from rodmodel.control import Workspace, workspace


@pytest.fixture(scope="module")
def space(rod: CoreRod) -> Workspace:
    return workspace(rod, 2000, {}, lambda done, total: None)


def test_samples_lie_in_the_domain_and_reach_its_corners(rod: CoreRod, space: Workspace) -> None:
    assert len(space.pressure) == pytest.approx(2000, rel=0.1)
    assert all(rod.domain.covers_pressure(pressure) for pressure in space.pressure)
    assert np.all(space.pressure >= 0.0)
    # Two chambers alike leave the domain at a corner of its limit beside a chamber.
    ways = [way for way in product((0.0, 1.0), repeat=3) if 0.0 < sum(way) < 3.0]
    corners = [[0.0, 0.0, 0.0], *([rod.domain.reach(way) * p for p in way] for way in ways)]
    for corner in corners:
        assert np.min(np.linalg.norm(space.pressure - np.array(corner), axis=1)) < 1.0
    for chamber in range(3):
        assert np.all(space.pressure[space.face == chamber, chamber] == 0.0)
    inside = space.pressure[space.face == 3]
    assert np.all(inside > 0.0)
    # Evenly: the mean is the domain's centre of mass, to the error of a quasi-random sum.
    random = np.random.default_rng(0).uniform(size=(200_000, 3)) * np.array(rod.domain.pressure_max)
    centre = random[rod.domain.covers_pressure(random.T)].mean(axis=0)
    np.testing.assert_allclose(inside.mean(axis=0), centre, rtol=0.03)


def test_samples_keep_less_beside_each_other_and_reach_the_corners_of_that(limited: CoreRod) -> None:
    """Along the edge of two chambers: 54 kPa beside 21, then 134/3 beside 112/3 kPa, where the sum begins."""
    space = workspace(limited, 2000, {}, lambda done, total: None)
    assert len(space.pressure) == pytest.approx(2000, rel=0.1)
    assert np.all(limited.domain.covers_pressure(space.pressure.T))
    assert np.all(space.in_domain)
    for face in range(3):
        first, second = ((face + 1) % 3, (face + 2) % 3)
        one = (66e3 - 4.0 / 7.0 * 82e3) * 7.0 / 3.0
        for pair in ((first, second), (second, first)):
            largest = limited.domain.pressure_max[pair[0]]
            for corner in ((largest, (66e3 - largest) * 7.0 / 4.0), (one, 82e3 - one)):
                gap = np.linalg.norm(space.pressure[:, pair] - corner, axis=1) + space.pressure[:, face]
                assert gap.min() < 1.0
    inside = space.pressure[space.face == 3]
    random = np.random.default_rng(0).uniform(size=(200_000, 3)) * np.array(limited.domain.pressure_max)
    centre = random[limited.domain.covers_pressure(random.T)].mean(axis=0)
    np.testing.assert_allclose(inside.mean(axis=0), centre, rtol=0.03)


def test_a_chamber_alone_is_sampled_to_its_own_limit(alone: CoreRod) -> None:
    """Chamber 1 to 66 kPa and chamber 2 to 58, chamber 3 to the 50 that all have beside others."""
    space = workspace(alone, 2000, {}, lambda done, total: None)
    assert len(space.pressure) == pytest.approx(2000, rel=0.1)
    assert np.all(space.in_domain)
    beyond = space.pressure[space.face == 4]
    assert np.all(np.count_nonzero(beyond, axis=1) == 1)
    assert beyond.max(axis=0) == pytest.approx([66e3, 58e3, 0.0])
    assert [beyond[beyond[:, k] > 0.0, k].min() for k in (0, 1)] == pytest.approx([50e3, 50e3])
    assert space.pressure[space.face < 4].max(axis=0) == pytest.approx([50e3] * 3)


def test_poses_are_those_of_the_rod(rod: CoreRod, space: Workspace) -> None:
    for row in np.linspace(0, len(space.pressure) - 1, 7).astype(int):
        solution = rod.solve(space.pressure[row], steps=32)
        np.testing.assert_array_equal(space.tip_position[row], solution.tip_position)
        assert space.bending_angle[row] == solution.bending_angle
        assert space.bending_plane[row] == solution.bending_plane
    assert np.all(space.converged)


def test_what_cannot_be_solved_is_left_out(rod: CoreRod) -> None:
    told: list[tuple[int, int]] = []
    force = np.array([0.0, 0.0, np.nan])
    space = workspace(rod, 100, {"tip_force": force}, lambda done, total: told.append((done, total)))
    assert not np.any(space.converged)
    assert np.all(np.isnan(space.tip_position))
    assert told[-1] == (len(space.pressure), len(space.pressure))
