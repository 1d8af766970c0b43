"""From a layout's name to a rod: which calibration serves it, and what is said when none does."""

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import rodmodel
from rodmodel import TurnedLaw
from tests.unit.rodmodel import synthetic


@pytest.fixture
def file(tmp_path: Path) -> Path:
    path = tmp_path / "calibration.json"
    rodmodel.save_calibration(synthetic.calibration(), path)
    return path


@pytest.mark.parametrize(
    ("psi_deg", "turns"),
    [(0, 0), (60, 2), (120, 1), (180, 0), (240, 2), (300, 1), (360, 0), (-60, 1), (-120, 2), (720, 0)],
)
def test_every_multiple_of_60_degrees_is_served(file: Path, psi_deg: float, turns: int) -> None:
    rod = rodmodel.load("double-helix", psi=math.radians(psi_deg), pitch=3e-3, path=file)
    law = rod.section
    assert (law.turns if isinstance(law, TurnedLaw) else 0) == turns
    # The chamber nearest to a crossing is that of the calibration's chamber 1, with its larger pressures.
    assert rod.domain.pressure_max == tuple(np.roll([70e3, 60e3, 60e3], turns))


@pytest.mark.parametrize("psi_deg", [12, 59.9, 90])
def test_an_orientation_that_is_not_calibrated_is_refused(file: Path, psi_deg: float) -> None:
    with pytest.raises(ValueError, match=r"psi: got .* rad, expected double-helix, pitch 3 mm, psi 0 deg"):
        rodmodel.load("double-helix", psi=math.radians(psi_deg), path=file)


def of_layout(layout: rodmodel.Layout, path: Path) -> Path:
    """The synthetic calibration under another name."""
    rodmodel.save_calibration(replace(synthetic.calibration(), layout=layout), path)
    return path


def test_a_ring_is_not_taken_for_its_own_half_turn(tmp_path: Path) -> None:
    path = of_layout(rodmodel.Layout("ring", 0.0, 1.5e-3), tmp_path / "ring.json")
    rodmodel.load("ring", psi=math.radians(120), pitch=1.5e-3, path=path)
    with pytest.raises(ValueError, match="psi 0 deg and every 120 deg from it"):
        rodmodel.load("ring", psi=math.radians(180), pitch=1.5e-3, path=path)


def test_six_helices_are_the_same_every_60_degrees(tmp_path: Path) -> None:
    path = of_layout(rodmodel.Layout("six-helix", 0.0, 3e-3), tmp_path / "six.json")
    for psi_deg in (60, 120, 180):
        rodmodel.load("six-helix", psi=math.radians(psi_deg), path=path)
    with pytest.raises(ValueError, match="psi 0 deg and every 60 deg from it"):
        rodmodel.load("six-helix", psi=math.radians(30), path=path)


@pytest.mark.parametrize(("psi_deg", "chambers"), [(12, [0, 1, 2]), (-12, [0, 2, 1]), (48, [2, 1, 0])])
def test_a_section_serves_its_mirror_image(tmp_path: Path, psi_deg: float, chambers: list[int]) -> None:
    """The rod at −12 deg is the mirror image under pressures that are mirrored too; 48 is −12 + 60."""
    law = synthetic.bending_law(mirror=False)
    path = tmp_path / "twelve.json"
    layout = rodmodel.Layout("double-helix", math.radians(12), 3e-3)
    rodmodel.save_calibration(replace(synthetic.calibration(law), layout=layout), path)
    rod = rodmodel.load("double-helix", psi=math.radians(psi_deg), path=path)
    assert rod.domain.pressure_max == tuple(np.array([70e3, 60e3, 60e3])[chambers])
    given = rodmodel.load("double-helix", psi=math.radians(12), path=path)
    pressure = np.array([20e3, 10e3, 5e3])
    there, here = rod.solve(pressure[chambers]), given.solve(pressure)
    np.testing.assert_allclose(there.bending_angle, here.bending_angle, rtol=1e-12)
    volumes = np.asarray(here.chamber_volume)[chambers]
    np.testing.assert_allclose(there.chamber_volume, volumes, rtol=1e-12)
    with pytest.raises(ValueError, match="psi 12 and 48 deg and every 60 deg from them"):
        rodmodel.load("double-helix", psi=math.radians(13), path=path)


def test_an_unknown_layout_or_pitch_is_refused(file: Path) -> None:
    with pytest.raises(ValueError, match="layout: got 'ring', expected double-helix"):
        rodmodel.load("ring", path=file)
    with pytest.raises(ValueError, match=r"pitch: got 0.004 m, expected double-helix, pitch 3 mm"):
        rodmodel.load("double-helix", pitch=4e-3, path=file)


@pytest.mark.parametrize("pitch", [0.0, -3e-3, math.nan, math.inf])
def test_an_impossible_pitch_is_refused(pitch: float) -> None:
    with pytest.raises(ValueError, match=r"pitch: got .*, expected a positive length \[m\]"):
        rodmodel.load("double-helix", pitch=pitch)


def test_an_orientation_that_is_no_number_is_refused() -> None:
    with pytest.raises(ValueError, match=r"psi: got nan, expected a finite angle \[rad\]"):
        rodmodel.load("double-helix", psi=math.nan)


def test_the_rod_has_what_the_file_says(file: Path) -> None:
    rod = rodmodel.load("double-helix", path=file)
    assert (rod.actuator, rod.domain) == (synthetic.ACTUATOR, synthetic.DOMAIN)
    assert rod.angle_error == 0.016


def test_each_shipped_calibration_loads_under_its_own_name() -> None:
    for calibration in rodmodel.shipped_calibrations():
        layout = calibration.layout
        rod = rodmodel.load(layout.name, 0.77 if layout.psi is None else layout.psi, layout.pitch)
        assert rod.actuator == calibration.actuator
