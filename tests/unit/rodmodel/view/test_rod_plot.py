"""The picture of a rod: written in each format, with what it says, of either kind of solution."""

from pathlib import Path

import jax
import matplotlib
import numpy as np
import pytest

import rodmodel
from rodmodel.view import plot_rod
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
    assert "chamber 3: 0 kPa" in text
    assert text.count("[mm]") >= 4


def test_a_straight_rod_is_drawn_without_a_plane(
    text_as_text: None, tmp_path: Path, rod: rodmodel.CoreRod
) -> None:
    plot_rod([(np.zeros(3), rod.solve(np.zeros(3)))], rod.actuator, tmp_path / "straight.svg")
    text = (tmp_path / "straight.svg").read_text()
    assert "γ" not in text
    assert "−x [mm]" in text


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
