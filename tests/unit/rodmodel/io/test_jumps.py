"""Where the full actuator jumped, in calibration files and in what is printed of them."""

import json
from dataclasses import replace
from pathlib import Path

import pytest

import rodmodel
from rodmodel import CalibrationFileError
from rodmodel.io import Jump, calibration_record, calibration_text
from tests.unit.rodmodel import calibrations

JUMPS = (Jump(2, 60e3, 65e3, "chamber2", "coarse"), Jump(3, 70e3, None, "chamber3", "fine"))


@pytest.fixture
def file(tmp_path: Path) -> Path:
    path = tmp_path / "jumps.json"
    rodmodel.save_calibration(replace(calibrations.calibration(), jumps=JUMPS), path)
    return path


def test_a_file_gives_back_what_was_saved(file: Path) -> None:
    assert rodmodel.read_calibration(file).jumps == JUMPS


def test_a_file_without_them_has_no_such_key(tmp_path: Path) -> None:
    path = tmp_path / "c.json"
    rodmodel.save_calibration(calibrations.calibration(), path)
    assert "jumps" not in json.loads(path.read_text())
    assert rodmodel.read_calibration(path).jumps == ()


def test_the_text_has_both_pressures_or_that_the_run_stood(file: Path) -> None:
    record = calibration_record(rodmodel.read_calibration(file))
    assert record["jumps"][0] == {
        "chamber": 2,
        "stood_kpa": 60.0,
        "jumped_kpa": 65.0,
        "run": "chamber2",
        "mesh": "coarse",
    }
    text = calibration_text(record)
    assert "one chamber alone: chamber 2 stood at 60 kPa and had jumped at 65;" in text
    assert text.endswith("chamber 3 stood at 70 kPa")
    assert "jumps" not in calibration_text({**record, "jumps": []})


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"chamber": 4}, r"chamber: got 4, expected 1, 2 or 3, in jumps\[0\]"),
        ({"stood_pa": -1}, r"stood_pa: got -1, expected a number from 0 to 1e\+08 Pa"),
        ({"stood_pa": True}, r"stood_pa: got True, expected a number"),
        (
            {"jumped_pa": 60000},
            r"jumped_pa: got 60000, expected a pressure above stood_pa, 60000 Pa, or null",
        ),
        ({"run": "a b"}, "run: got 'a b', expected a name"),
        ({"mesh": 3}, "mesh: got 3, expected text"),
    ],
)
def test_a_damaged_run_is_refused_in_one_line(file: Path, change: dict, message: str) -> None:
    content = json.loads(file.read_text())
    content["jumps"][0] |= change
    file.write_text(json.dumps(content))
    with pytest.raises(CalibrationFileError, match=message):
        rodmodel.read_calibration(file)


@pytest.mark.parametrize("value", [[], {}, 3, [3]])
def test_anything_but_a_list_of_runs_is_refused(file: Path, value: object) -> None:
    file.write_text(json.dumps({**json.loads(file.read_text()), "jumps": value}))
    with pytest.raises(
        CalibrationFileError, match=r"jumps: got .*, expected a list|got 3, expected a JSON obj"
    ):
        rodmodel.read_calibration(file)
