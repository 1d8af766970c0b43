"""The picture of a rod: written in each format, with what it says, of either kind of solution."""

from pathlib import Path

import jax
import matplotlib
import numpy as np
import pytest

import rodmodel
from rodmodel.view import plot_rod
from rodmodel.view.rod_shape import pose_of, tints
from tests.unit.rodmodel import calibrations

PRESSURES = [np.array([10e3, 0.0, 0.0]), np.array([60e3, 20e3, 0.0])]


@pytest.fixture(scope="module")
def file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("calibration") / "calibration.json"
    rodmodel.save_calibration(calibrations.calibration(), path)
    return path


@pytest.fixture(scope="module")
def rod(file: Path) -> rodmodel.CoreRod:
    return rodmodel.load_core("double-helix", path=file)


@pytest.fixture
def text_as_text(monkeypatch: pytest.MonkeyPatch) -> None:
    """Not as outlines."""
    monkeypatch.setitem(matplotlib.rcParams, "svg.fonttype", "none")


@pytest.mark.parametrize("poses", [1, 2])
def test_a_picture_names_pressures_and_angles(
    text_as_text: None, tmp_path: Path, rod: rodmodel.CoreRod, poses: int
) -> None:
    drawn = [(pressure, rod.solve(pressure)) for pressure in PRESSURES[-poses:]]
    plot_rod(drawn, rod.actuator, tmp_path / "bent.svg")
    text = (tmp_path / "bent.svg").read_text()
    for pressure, solution in drawn:
        assert f"θ = {np.degrees(solution.bending_angle):.1f}°" in text
        assert " / ".join(f"{1e-3 * p:g}" for p in pressure) + " kPa" in text
    assert f"γ = {np.degrees(drawn[-1][1].bending_plane):.1f}°" in text
    assert f"{1e-3 * drawn[-1][0][2]:g} kPa" in text
    assert text.count("[mm]") == 2
    assert " mm" in text


def test_a_straight_rod_is_drawn_without_a_plane(
    text_as_text: None, tmp_path: Path, rod: rodmodel.CoreRod
) -> None:
    plot_rod([(np.zeros(3), rod.solve(np.zeros(3)))], rod.actuator, tmp_path / "straight.svg")
    text = (tmp_path / "straight.svg").read_text()
    assert "γ" not in text
    assert "−x [mm]" in text


def test_loads_are_drawn_with_their_values(text_as_text: None, tmp_path: Path, rod: rodmodel.CoreRod) -> None:
    given = {
        "tip_force": np.array([0.0, 0.003, 0.004]),
        "tip_moment": np.array([0.0, 2e-4, 0.0]),
        "gravity": np.array([0.0, 0.0, -9.81]),
        "distributed_force": np.array([0.02, 0.0, 0.0]),
        "follower_force": np.array([0.001, 0.0, 0.0]),
        "follower_moment": None,
    }
    solution = rod.solve(PRESSURES[0], **given)
    plot_rod([(PRESSURES[0], solution)], rod.actuator, tmp_path / "loaded.svg", given)
    text = (tmp_path / "loaded.svg").read_text()
    for value in ("0.005 N", "0.2 N mm", "gravity 9.81 m/s²", "0.02 N/m", "0.001 N, turning with the cap"):
        # In space and from the side.
        assert text.count(f">{value}<") == 2
    plot_rod([(PRESSURES[0], solution)], rod.actuator, tmp_path / "bare.svg")
    assert " N<" not in (tmp_path / "bare.svg").read_text()


def test_the_title_says_angle_plane_tip_and_error(
    text_as_text: None, tmp_path: Path, rod: rodmodel.CoreRod
) -> None:
    pressure = PRESSURES[0]
    solution = rod.solve(pressure)
    plot_rod([(pressure, solution)], rod.actuator, tmp_path / "a.svg")
    text = (tmp_path / "a.svg").read_text()
    x, _, z = 1e3 * solution.tip_position
    assert f"tip (−{abs(x):.1f}, 0.0, {z:.1f}) mm" in text
    assert f"within {np.degrees(solution.error_estimate):.2g}°" in text


def test_a_rod_short_of_its_loads_is_drawn_and_said_to_be(
    text_as_text: None, tmp_path: Path, rod: rodmodel.CoreRod
) -> None:
    given = {"tip_force": np.array([0.0, 0.0, -10.0])}
    solution = rod.solve(PRESSURES[0], **given, throw=False)
    assert not solution.converged
    plot_rod([(PRESSURES[0], solution)], rod.actuator, tmp_path / "a.svg", given)
    assert f"at {100.0 * solution.load_fraction:.3g} % of the loads" in (tmp_path / "a.svg").read_text()


def test_no_poses_and_poses_without_a_shape_are_refused(tmp_path: Path, rod: rodmodel.CoreRod) -> None:
    with pytest.raises(ValueError, match="poses: got none, expected at least one"):
        plot_rod([], rod.actuator, tmp_path / "a.png")
    bad = rod.solve(np.array([-1.0, 0.0, 0.0]), throw=False)
    with pytest.raises(ValueError, match="poses: got a solution without a shape"):
        plot_rod([(np.zeros(3), bad)], rod.actuator, tmp_path / "a.png")


@pytest.mark.parametrize("kpa", [(5.0, 0.0, 0.0), (30.0, 0.0, 0.0), (52.0, 0.0, 0.0), (0.0, 45.0, 45.0)])
@pytest.mark.parametrize("psi_deg", [0.0, 17.0])
def test_the_drawn_axis_bends_one_way_and_ends_in_the_cap(kpa: tuple[float, ...], psi_deg: float) -> None:
    """Under chamber pressures alone the curvature has one sign all along, as that of an actuator."""
    rod = rodmodel.load_core("double-helix", psi=np.radians(psi_deg))
    pressure = 1e3 * np.array(kpa)
    solution = rod.solve(pressure)
    pose = pose_of(pressure, pressure.max(), solution, rod.actuator)
    np.testing.assert_allclose(pose.centre[-1], 1e3 * solution.tip_position, atol=0.02)
    np.testing.assert_allclose(pose.centre[0], 0.0, atol=1e-9)
    ahead = -np.array([np.cos(pose.plane), np.sin(pose.plane), 0.0])
    tangent = np.diff(pose.centre[~np.append(pose.in_cap, True)], axis=0)
    lean = np.unwrap(np.arctan2(tangent @ ahead, tangent[:, 2]))
    # Nowhere less than a twentieth of the mean curvature.
    assert np.all(np.diff(lean) > 0.05 * lean[-1] / len(lean))
    # As long as the rod, but for the cap's way aside on the outside of the bend.
    assert 66.0 * 0.999 < pose.length < 66.0 * 1.04


def test_chambers_without_pressure_differ_from_each_other_and_from_loaded_ones() -> None:
    empty, loaded = tints(np.zeros(3)), tints(np.array([0.02, 0.5, 1.0]))
    pairs = [(0, 1), (1, 2), (0, 2)]
    assert min(np.abs(empty[a] - empty[b]).max() for a, b in pairs) > 0.05
    assert np.abs(empty - loaded).max(axis=1).min() > 0.1


def test_a_base_that_hangs_is_drawn_hanging(
    text_as_text: None, tmp_path: Path, rod: rodmodel.CoreRod
) -> None:
    given = {"base_position": np.array([0.0, 0.0, 0.1]), "base_rotation": np.diag([1.0, -1.0, -1.0])}
    solution = rod.solve(PRESSURES[0], **given)
    plot_rod([(PRESSURES[0], solution)], rod.actuator, tmp_path / "a.svg", given)
    assert "along the axis of the base [mm]" in (tmp_path / "a.svg").read_text()


def test_both_rods_are_drawn_alike(
    text_as_text: None, tmp_path: Path, file: Path, rod: rodmodel.CoreRod, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(matplotlib.rcParams, "svg.hashsalt", "same")
    reference = rodmodel.load("double-helix", path=file)
    pressure = PRESSURES[1]
    solutions = {"compiled": rod.solve(pressure), "jax": jax.jit(reference.solve)(pressure)}
    for name, solution in solutions.items():
        plot_rod([(pressure, solution)], rod.actuator, tmp_path / f"{name}.png")
    compiled, differentiable = (matplotlib.image.imread(tmp_path / f"{name}.png") for name in solutions)
    np.testing.assert_allclose(compiled, differentiable, atol=0.01)


@pytest.mark.parametrize(("name", "start"), [("a.png", b"\x89PNG"), ("a.pdf", b"%PDF")])
def test_the_suffix_is_the_format(tmp_path: Path, rod: rodmodel.CoreRod, name: str, start: bytes) -> None:
    plot_rod([(PRESSURES[0], rod.solve(PRESSURES[0]))], rod.actuator, tmp_path / name)
    assert (tmp_path / name).read_bytes().startswith(start)


def test_a_place_that_cannot_be_written_raises(tmp_path: Path, rod: rodmodel.CoreRod) -> None:
    with pytest.raises(OSError, match="No such file"):
        plot_rod([(PRESSURES[0], rod.solve(PRESSURES[0]))], rod.actuator, tmp_path / "no" / "a.png")
