"""What is no calibration, or has a law that no file holds, is refused by kind; nothing is written."""

from pathlib import Path
from typing import Any

import jax.numpy as jnp
import pytest

from rodmodel import Calibration, CalibrationFileError, LinearLaw, read_calibration, save_calibration
from tests.unit.rodmodel import calibrations


def made_with(**law: Any) -> Calibration:
    made = calibrations.calibration()
    return Calibration(
        layout=made.layout,
        actuator=made.actuator,
        domain=made.domain,
        error=made.error,
        provenance=made.provenance,
        **law,
    )


@pytest.mark.parametrize(
    ("name", "expected"),
    [
        ("law", "law: got a LinearLaw, expected RidgeArrays; section_law takes a RidgeNetwork"),
        ("section_law", "section_law: got a LinearLaw, expected a RidgeNetwork or an OrientedNetwork"),
    ],
)
def test_a_calibration_of_a_linear_law_is_refused(unchecked: None, name: str, expected: str) -> None:
    with pytest.raises(ValueError, match=f"^{expected}"):
        made_with(**{name: LinearLaw(jnp.eye(3), jnp.zeros((3, 3)))})


@pytest.mark.parametrize(
    "what", [LinearLaw(jnp.eye(3), jnp.zeros((3, 3))), calibrations.ridge_arrays()], ids=["linear", "ridges"]
)
def test_a_law_alone_cannot_be_saved(unchecked: None, tmp_path: Path, what: Any) -> None:
    kind = type(what).__name__
    with pytest.raises(ValueError, match=f"^calibration: got a {kind}, expected a Calibration, which has"):
        save_calibration(what, tmp_path / "law.json")
    assert not list(tmp_path.iterdir())


def test_a_file_of_an_implausible_actuator_is_refused_by_its_name(tmp_path: Path) -> None:
    file = tmp_path / "heavy.json"
    save_calibration(calibrations.calibration(), file)
    text = file.read_text()
    assert '"mass_per_length_kg_per_m": 0.068' in text
    file.write_text(text.replace('"mass_per_length_kg_per_m": 0.068', '"mass_per_length_kg_per_m": 68.0'))
    with pytest.raises(CalibrationFileError, match=r"heavy\.json: actuator\.mass_per_length: got 68 kg/m"):
        read_calibration(file)
