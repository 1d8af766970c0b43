"""Files that commands write: what cannot be written, or read again, is told and leaves the old file."""

from dataclasses import replace
from pathlib import Path

import pytest

import rodmodel
from calibration.cli._arguments import BadInputError
from calibration.cli._files import write_calibration_file
from tests.unit.rodmodel import calibrations


def test_a_calibration_is_written(tmp_path: Path) -> None:
    file = tmp_path / "law.json"
    write_calibration_file(calibrations.calibration(), str(file))
    assert rodmodel.read_calibration(file).actuator == calibrations.ACTUATOR


def test_ends_that_no_file_may_hold_are_told_and_the_old_file_stays(tmp_path: Path) -> None:
    file = tmp_path / "law.json"
    write_calibration_file(calibrations.calibration(), str(file))
    before = file.read_bytes()
    stretched = replace(calibrations.ACTUATOR, stiff_tip=-1e-3)
    with pytest.raises(BadInputError) as caught:
        write_calibration_file(replace(calibrations.calibration(), actuator=stretched), str(file))
    assert str(caught.value) == (
        f"{file}: actuator.stiff_tip_m: got -0.001, expected a number from 0 to 10 m; nothing is written"
    )
    assert file.read_bytes() == before


def test_a_place_that_takes_no_file_is_told(tmp_path: Path) -> None:
    with pytest.raises(
        BadInputError, match=r"law\.json: got No such file or directory, expected a file that"
    ):
        write_calibration_file(calibrations.calibration(), str(tmp_path / "no" / "law.json"))
