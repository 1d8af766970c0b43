"""Files that commands write: what cannot be written, or read again, is told and leaves the old file."""

from dataclasses import replace
from pathlib import Path

import pytest

import rodmodel
from calibration.cli._arguments import BadInputError
from calibration.cli._files import write_calibration_file
from fem_reference import level_from_record, level_record
from tests.faults import full_disk
from tests.fem_fixtures import TINY
from tests.unit.rodmodel import calibrations


def test_a_calibration_is_written(tmp_path: Path) -> None:
    file = tmp_path / "law.json"
    write_calibration_file(calibrations.calibration(), str(file))
    assert rodmodel.read_calibration(file).actuator == calibrations.ACTUATOR


def test_ends_that_no_file_may_hold_are_told_and_the_old_file_stays(tmp_path: Path) -> None:
    file = tmp_path / "law.json"
    write_calibration_file(calibrations.calibration(), str(file))
    before = file.read_bytes()
    softened = replace(calibrations.ACTUATOR, base_stiffness=-1e-3)
    with pytest.raises(BadInputError) as caught:
        write_calibration_file(replace(calibrations.calibration(), actuator=softened), str(file))
    assert str(caught.value) == (
        f"{file}: actuator.base_stiffness_n_m2: got -0.001, expected a number from 0 to 1e+06 N m2; "
        "nothing is written"
    )
    assert file.read_bytes() == before


def test_a_place_that_takes_no_file_is_told(tmp_path: Path) -> None:
    with pytest.raises(
        BadInputError, match=r"law\.json: got No such file or directory, expected a file that"
    ):
        write_calibration_file(calibrations.calibration(), str(tmp_path / "no" / "law.json"))


def test_a_mesh_of_ones_own_goes_into_the_file_by_its_counts(tmp_path: Path) -> None:
    file = tmp_path / "law.json"
    provenance = {"mesh": level_record(TINY)}
    write_calibration_file(replace(calibrations.calibration(), provenance=provenance), str(file))
    found = rodmodel.read_calibration(file).provenance["mesh"]
    assert level_from_record(found, "mesh") == TINY


def test_a_full_disk_is_told_and_leaves_the_old_file(tmp_path: Path) -> None:
    file = tmp_path / "law.json"
    write_calibration_file(calibrations.calibration(), str(file))
    before = file.read_bytes()
    with full_disk(len(before) // 2), pytest.raises(BadInputError, match=r"law\.json: got File too large"):
        write_calibration_file(calibrations.calibration(), str(file))
    assert file.read_bytes() == before
    assert list(tmp_path.iterdir()) == [file]
