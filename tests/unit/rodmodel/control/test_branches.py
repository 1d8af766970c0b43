"""Branches: which one an actuator is on, by where it comes from."""

import math
from pathlib import Path

import numpy as np
import pytest

import rodmodel
from rodmodel import Branch, Branches
from rodmodel.control import LOADING, inverse_many, workspace
from tests.unit.rodmodel import calibrations

UP, DOWN = Branch(2, 1), Branch(2, -1)


@pytest.fixture(scope="module")
def branches(tmp_path_factory: pytest.TempPathFactory) -> Branches:
    """The loading branch ends at 60 kPa in chamber 2, the snapped ones at 40 kPa on the way down."""
    file = tmp_path_factory.mktemp("calibration") / "snapped.json"
    rodmodel.save_calibration(calibrations.with_snapped((2, 1), (2, -1)), file)
    return rodmodel.load_branches("double-helix", path=file)


def path_of(branches: Branches, kilopascals: list[float]) -> list[Branch]:
    found, before = [], LOADING
    for p in kilopascals:
        before = branches.branch_at([0.0, 1e3 * p, 0.0], before)
        found.append(before)
    return found


def test_a_cycle_jumps_where_the_branches_end(branches: Branches) -> None:
    up = path_of(branches, [30, 50, 59, 61, 69, 50, 41, 39, 50])
    assert up == [LOADING, LOADING, LOADING, UP, UP, UP, UP, LOADING, LOADING]


def test_where_no_branch_goes_on_the_last_one_is_kept(branches: Branches) -> None:
    assert path_of(branches, [69, 75]) == [UP, UP]
    assert not branches.solve([0.0, 75e3, 0.0], UP, throw=False).solution.in_domain


def test_a_solution_tells_its_branch_whether_it_jumped_and_how_far_it_goes_on(branches: Branches) -> None:
    first = branches.solve([0.0, 50e3, 0.0])
    assert (first.branch, first.jumped, first.other_possible) == (LOADING, False, True)
    assert first.reach == pytest.approx(60.0 / 50.0)
    second = branches.solve([0.0, 65e3, 0.0], first.branch)
    assert (second.branch, second.jumped, second.other_possible) == (UP, True, False)
    assert second.solution.in_domain
    assert branches.solve([0.0, 0.0, 0.0]).reach == math.inf
    assert not branches.solve([0.0, 30e3, 0.0]).other_possible


def test_a_snapped_branch_bends_to_its_side_as_its_rod_does(branches: Branches) -> None:
    aside = np.array([math.cos(2.0 * math.pi / 3.0), math.sin(2.0 * math.pi / 3.0), 0.0])
    upright = aside @ branches.solve([0.0, 50e3, 0.0]).solution.curvature(0.03)
    for branch, sign in ((UP, 1.0), (DOWN, -1.0)):
        found = branches.solve([0.0, 50e3, 0.0], branch)
        assert found.branch == branch
        # Some 50 1/m in the plane, a third as much aside.
        assert sign * (aside @ found.solution.curvature(0.03) - upright) > 5.0
        own = branches.rod(branch).solve([0.0, 50e3, 0.0])
        np.testing.assert_array_equal(found.solution.tip_position, own.tip_position)


def test_a_branch_can_be_asked_for(branches: Branches) -> None:
    pressure = [0.0, 50e3, 0.0]
    assert branches.solve(pressure, UP, branch="loading").branch == LOADING
    assert branches.solve(pressure, branch="snapped").branch == UP
    assert branches.solve(pressure, DOWN, branch="snapped").branch == DOWN


def test_no_inverse_and_no_workspace_is_of_a_snapped_branch(branches: Branches) -> None:
    """Both fill a domain from no pressure on; a snapped branch ends before."""
    rod = branches.rod(UP)
    for call in (
        lambda: rod.inverse(bending_angle=1.0, bending_plane=2.0),
        lambda: inverse_many(rod, bending_angle=[1.0], bending_plane=[2.0]),
        lambda: workspace(rod, 100, {}, lambda done, of: None),
    ):
        with pytest.raises(ValueError, match="rod: got one of a snapped branch, expected the loading"):
            call()


def test_the_core_takes_a_branch_that_is_none_for_rest(branches: Branches) -> None:
    """As of memory that was overwritten: no place outside the list is read."""
    pressure = np.array([0.0, 50e3, 0.0])
    for number in (-(2**31), -2, len(branches.snapped) + 1, 2**31 - 1):
        assert branches._choice.at(pressure, number) == branches._choice.at(pressure, 0)


def test_bad_input_is_said_by_name(branches: Branches) -> None:
    for chamber, side in ((5, 1), (2, 0), (0, 1), (2, 9)):
        with pytest.raises(
            ValueError, match=f"Branch: got chamber {chamber} and side {side}, expected 1, 2 or"
        ):
            Branch(chamber, side)
    with pytest.raises(ValueError, match="branch: got 'up', expected auto, loading, snapped"):
        branches.solve([0.0, 0.0, 0.0], branch="up")
    with pytest.raises(ValueError, match="largest pressure in chamber 1, expected a snapped branch that"):
        branches.solve([50e3, 0.0, 0.0], branch="snapped")
    with pytest.raises(ValueError, match=r"pressure: got shape \(2,\)"):
        branches.branch_at([0.0, 0.0])
    with pytest.raises(ValueError, match="branch: got snapped by chamber 1, to larger bending planes"):
        branches.rod(Branch(1, 1))


@pytest.mark.parametrize("psi_deg", [120, 240])
def test_a_turned_section_has_its_branches_turned(tmp_path: Path, psi_deg: int) -> None:
    """A double helix at ψ + 120° is the same body, turned: chamber k + 1 is what chamber k was."""
    file = tmp_path / "c.json"
    rodmodel.save_calibration(calibrations.with_snapped((2, 1)), file)
    own = rodmodel.load_branches("double-helix", path=file)
    turned = rodmodel.load_branches("double-helix", psi=math.radians(psi_deg), path=file)
    turns = psi_deg // 120
    pressure = np.array([3e3, 55e3, 8e3])
    there = turned.solve(np.roll(pressure, turns), branch="snapped")
    here = own.solve(pressure, branch="snapped")
    assert there.branch == Branch((2 - 1 + turns) % 3 + 1, 1)
    assert there.solution.in_domain
    np.testing.assert_allclose(there.solution.bending_angle, here.solution.bending_angle, rtol=1e-9)
    turn = math.radians(psi_deg)
    rotation = np.array(
        [[math.cos(turn), -math.sin(turn), 0], [math.sin(turn), math.cos(turn), 0], [0, 0, 1]]
    )
    np.testing.assert_allclose(there.solution.tip_position, rotation @ here.solution.tip_position, atol=1e-9)


def test_a_section_with_a_plane_of_symmetry_has_each_branch_mirrored(tmp_path: Path) -> None:
    """The image of chamber 2's branch to larger planes is chamber 3's to smaller ones, y → −y."""
    file = tmp_path / "c.json"
    rodmodel.save_calibration(calibrations.with_snapped((2, 1)), file)
    branches = rodmodel.load_branches("double-helix", path=file)
    assert set(branches.snapped) == {Branch(2, 1), Branch(3, -1)}
    one = branches.solve([3e3, 55e3, 8e3], branch="snapped").solution
    other = branches.solve([3e3, 8e3, 55e3], branch="snapped")
    assert other.branch == Branch(3, -1)
    np.testing.assert_allclose(other.solution.tip_position, one.tip_position * [1.0, -1.0, 1.0], atol=1e-9)
