"""From a layout's name to a rod: which calibration serves it, and what is said when none does."""

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import rodmodel
from rodmodel import ErrorBound
from rodmodel.io import Found, find, find_among
from tests.unit.rodmodel import calibrations

PRESSURE = np.array([20e3, 10e3, 5e3])


@pytest.fixture
def file(tmp_path: Path) -> Path:
    path = tmp_path / "calibration.json"
    rodmodel.save_calibration(calibrations.calibration(), path)
    return path


@pytest.mark.parametrize(
    ("psi_deg", "turns"),
    [(0, 0), (60, 2), (120, 1), (180, 0), (240, 2), (300, 1), (360, 0), (-60, 1), (-120, 2), (420, 2)],
)
def test_every_multiple_of_60_degrees_is_served(file: Path, psi_deg: float, turns: int) -> None:
    found = find("double-helix", math.radians(psi_deg), 3e-3, file)
    assert (found.turns, found.mirrored) == (turns, False)
    assert found.psi == math.radians(psi_deg)
    # The chamber nearest to a crossing is that of the calibration's chamber 1, with its larger pressures.
    assert found.domain.pressure_max == tuple(np.roll([70e3, 60e3, 60e3], turns))
    assert found.domain.moment_max == calibrations.DOMAIN.moment_max


def test_a_limit_beside_is_the_same_for_the_chambers_of_all_orientations() -> None:
    made = calibrations.calibration()
    limited = replace(made, domain=replace(made.domain, beside_share=0.5, beside_max=79e3))
    for psi in (0.0, 60.0, 120.0, 240.0):
        domain = find_among([limited], "double-helix", math.radians(psi), 3e-3).domain
        assert (domain.beside_share, domain.beside_max) == (0.5, 79e3)


@pytest.mark.parametrize("psi", [12.0, -45.0, 1e6])
def test_an_orientation_in_degrees_is_refused(file: Path, psi: float) -> None:
    with pytest.raises(ValueError, match=r"psi: got .* rad, expected -8 to 8 rad; is it in degrees\?"):
        find("double-helix", psi, 3e-3, file)


@pytest.mark.parametrize("psi_deg", [12, 59.9, 90])
def test_an_orientation_that_is_not_calibrated_is_refused(file: Path, psi_deg: float) -> None:
    with pytest.raises(ValueError, match=r"psi: got .* rad, expected double-helix, pitch 3 mm, psi 0 deg"):
        find("double-helix", math.radians(psi_deg), 3e-3, file)


def of_layout(name: str, pitch: float, path: Path) -> Path:
    """The synthetic calibration under another name."""
    layout = rodmodel.Layout(name, 0.0, pitch)
    rodmodel.save_calibration(calibrations.calibration(layout=layout), path)
    return path


def test_a_ring_is_not_taken_for_its_own_half_turn(tmp_path: Path) -> None:
    path = of_layout("ring", 1.5e-3, tmp_path / "ring.json")
    assert find("ring", math.radians(120), 1.5e-3, path).turns == 1
    with pytest.raises(ValueError, match="psi 0 deg and every 120 deg from it"):
        find("ring", math.radians(180), 1.5e-3, path)


def test_six_helices_are_the_same_every_60_degrees(tmp_path: Path) -> None:
    path = of_layout("six-helix", 3e-3, tmp_path / "six.json")
    assert [find("six-helix", math.radians(psi), 3e-3, path).turns for psi in (60, 120, 180)] == [2, 1, 0]
    with pytest.raises(ValueError, match="psi 0 deg and every 60 deg from it"):
        find("six-helix", math.radians(30), 3e-3, path)


@pytest.fixture
def of_twelve(tmp_path: Path) -> Path:
    path = tmp_path / "twelve.json"
    rodmodel.save_calibration(calibrations.of_twelve_degrees(), path)
    return path


@pytest.mark.parametrize(
    ("psi_deg", "mirrored", "turns", "chambers"),
    [(12, False, 0, [0, 1, 2]), (-12, True, 0, [0, 2, 1]), (48, True, 2, [2, 1, 0])],
)
def test_a_section_serves_its_mirror_image(
    of_twelve: Path, psi_deg: float, mirrored: bool, turns: int, chambers: list[int]
) -> None:
    found = find("double-helix", math.radians(psi_deg), 3e-3, of_twelve)
    assert (found.mirrored, found.turns) == (mirrored, turns)
    assert found.domain.pressure_max == tuple(np.array([70e3, 60e3, 60e3])[chambers])
    with pytest.raises(ValueError, match="psi 12 and 48 deg and every 60 deg from them"):
        find("double-helix", math.radians(13), 3e-3, of_twelve)


# Turned in the mirror is both, of the rod that JAX compiles; the compiled core takes each.
@pytest.mark.parametrize(
    ("load", "psi_deg", "chambers"),
    [
        (rodmodel.load_core, -12, [0, 2, 1]),
        (rodmodel.load_core, 48, [2, 1, 0]),
        (rodmodel.load_core, 132, [2, 0, 1]),
        pytest.param(rodmodel.load, -12, [0, 2, 1], marks=pytest.mark.slow),
        (rodmodel.load, 48, [2, 1, 0]),
        pytest.param(rodmodel.load, 132, [2, 0, 1], marks=pytest.mark.slow),
    ],
)
def test_rods_of_another_orientation_are_the_given_one_renumbered(
    of_twelve: Path, load, psi_deg: float, chambers: list[int]
) -> None:
    """The rod at −12 deg is the mirror image under pressures that are mirrored too; 48 is −12 + 60."""
    given = load("double-helix", psi=math.radians(12), path=of_twelve).solve(PRESSURE)
    there = load("double-helix", psi=math.radians(psi_deg), path=of_twelve).solve(PRESSURE[chambers])
    np.testing.assert_allclose(there.bending_angle, given.bending_angle, rtol=1e-12)
    volumes = np.asarray(given.chamber_volume)[chambers]
    np.testing.assert_allclose(there.chamber_volume, volumes, rtol=1e-12)


# JAX compiles each; that of the test above is turned as at 60.
@pytest.mark.parametrize(
    "psi_deg", [pytest.param(0, marks=pytest.mark.slow), pytest.param(60, marks=pytest.mark.slow), 120]
)
def test_both_rods_are_the_same(file: Path, psi_deg: float) -> None:
    psi = math.radians(psi_deg)
    compiled = rodmodel.load_core("double-helix", psi, path=file).solve(PRESSURE)
    reference = rodmodel.load("double-helix", psi, path=file).solve(PRESSURE)
    np.testing.assert_allclose(compiled.tip_position, reference.tip_position, atol=1e-11)


def test_an_orientation_without_a_law_of_its_own_is_of_all(tmp_path: Path) -> None:
    path = tmp_path / "all.json"
    rodmodel.save_calibration(calibrations.oriented_calibration(), path)
    found = find("double-helix", 0.3, 3e-3, path)
    assert (found.psi, found.turns, found.mirrored) == (0.3, 0, False)
    rods = rodmodel.load_oriented("double-helix", path=path)
    compiled = rodmodel.load_core("double-helix", 0.3, path=path).solve(PRESSURE)
    for rod in (rods.at_psi(0.3), rodmodel.load("double-helix", 0.3, path=path)):
        np.testing.assert_allclose(rod.solve(PRESSURE).tip_position, compiled.tip_position, atol=1e-11)


def test_rods_of_all_orientations_need_a_law_of_all(file: Path) -> None:
    with pytest.raises(
        ValueError, match="layout: got 'double-helix' at any psi, expected double-helix, pitch"
    ):
        rodmodel.load_oriented("double-helix", path=file)


def test_an_unknown_layout_or_pitch_is_refused(file: Path) -> None:
    with pytest.raises(ValueError, match="layout: got 'ring', expected double-helix"):
        find("ring", 0.0, 3e-3, file)
    with pytest.raises(ValueError, match=r"pitch: got 0.004 m, expected double-helix, pitch 3 mm"):
        find("double-helix", 0.0, 4e-3, file)


@pytest.mark.parametrize("load", [rodmodel.load, rodmodel.load_core])
@pytest.mark.parametrize("pitch", [0.0, -3e-3, math.nan, math.inf])
def test_an_impossible_pitch_is_refused(load, pitch: float) -> None:
    with pytest.raises(ValueError, match=r"pitch: got .*, expected a positive length \[m\]"):
        load("double-helix", pitch=pitch)


@pytest.mark.parametrize("load", [rodmodel.load, rodmodel.load_core])
def test_an_orientation_that_is_no_number_is_refused(load) -> None:
    with pytest.raises(ValueError, match=r"psi: got nan, expected a finite angle \[rad\]"):
        load("double-helix", psi=math.nan)


def test_the_rod_has_what_the_file_says(file: Path) -> None:
    for rod in (rodmodel.load("double-helix", path=file), rodmodel.load_core("double-helix", path=file)):
        assert (rod.actuator, rod.domain) == (calibrations.ACTUATOR, calibrations.DOMAIN)
        assert rod.error_bound == ErrorBound.constant(0.016)


def test_each_shipped_calibration_is_found_under_its_own_name() -> None:
    for calibration in rodmodel.shipped_calibrations():
        layout = calibration.layout
        found: Found = find(layout.name, 0.77 if layout.psi is None else layout.psi, layout.pitch)
        assert found.calibration.layout == layout
        assert found.calibration.actuator == calibration.actuator
