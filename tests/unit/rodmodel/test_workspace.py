"""The workspace: which pressures are sampled, and what is drawn of them."""

from pathlib import Path

import jax
import numpy as np
import pytest

import rodmodel
from rodmodel._workspace import Workspace, workspace
from rodmodel._workspace_plot import plot_workspace
from tests.unit.rodmodel import synthetic


@pytest.fixture(scope="module")
def rod() -> rodmodel.Rod:
    return synthetic.rod(synthetic.bending_law())


@pytest.fixture(scope="module")
def space(rod: rodmodel.Rod) -> Workspace:
    return workspace(rod.solve, rod.domain, 2000, lambda done, total: None)


def test_samples_lie_in_the_domain_and_reach_its_corners(rod: rodmodel.Rod, space: Workspace) -> None:
    assert len(space.pressure) == pytest.approx(2000, rel=0.1)
    assert all(rod.domain.covers_pressure(pressure) for pressure in space.pressure)
    assert np.all(space.pressure >= 0.0)
    corners = [[0, 0, 0], [70e3, 0, 0], [0, 60e3, 0], [0, 0, 60e3], [70e3, 30e3, 0], [40e3, 60e3, 0]]
    corners += [[70e3, 0, 30e3], [40e3, 0, 60e3], [0, 60e3, 40e3], [0, 40e3, 60e3]]
    for corner in corners:
        assert np.min(np.linalg.norm(space.pressure - np.array(corner), axis=1)) < 1.0
    for chamber in range(3):
        assert np.all(space.pressure[space.face == chamber, chamber] == 0.0)
    inside = space.pressure[space.face == 3]
    assert np.all(inside > 0.0)
    # Evenly: the mean is the domain's centre of mass, to the error of a quasi-random sum.
    rng = np.random.default_rng(0)
    random = rng.uniform(size=(200_000, 3)) * np.array(rod.domain.pressure_max)
    centre = random[random.sum(axis=1) <= rod.domain.pressure_sum_max].mean(axis=0)
    np.testing.assert_allclose(inside.mean(axis=0), centre, rtol=0.03)


def test_poses_are_those_of_the_rod(rod: rodmodel.Rod, space: Workspace) -> None:
    rows = np.linspace(0, len(space.pressure) - 1, 7).astype(int)
    solutions = jax.vmap(rod.solve)(space.pressure[rows])
    np.testing.assert_allclose(space.tip_position[rows], solutions.tip_position, atol=1e-15)
    np.testing.assert_allclose(space.bending_angle[rows], solutions.bending_angle, atol=1e-14)
    np.testing.assert_allclose(space.bending_plane[rows], solutions.bending_plane, atol=1e-14)
    assert np.all(space.converged)


def test_what_cannot_be_solved_is_left_out(rod: rodmodel.Rod) -> None:
    told = []
    force = np.array([0.0, 0.0, np.nan])
    space = workspace(
        lambda pressure: rod.solve(pressure, tip_force=force, throw=False),
        rod.domain,
        100,
        lambda done, total: told.append((done, total)),
    )
    assert not np.any(space.converged)
    assert np.all(np.isnan(space.tip_position))
    assert told[-1] == (len(space.pressure), len(space.pressure))


def test_the_picture_is_written(rod: rodmodel.Rod, space: Workspace, tmp_path: Path) -> None:
    file = tmp_path / "space.png"
    plot_workspace(space, rod.actuator, file)
    assert file.read_bytes().startswith(b"\x89PNG")
