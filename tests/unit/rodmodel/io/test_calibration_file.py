"""The calibration file: what is written comes back, whole or not at all, and unchanged to the last bit."""

import json
import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from rodmodel import (
    Calibration,
    CalibrationFileError,
    Layout,
    OrientedNetwork,
    RidgeNetwork,
    read_calibration,
    save_calibration,
)
from rodmodel.io import RANGES, RidgeArrays, calibration_record, calibration_text, ranges_table
from rodmodel.io.law_arrays import ARRAYS
from tests.unit.rodmodel import calibrations

ROOT = Path(__file__).parents[4]


@pytest.mark.parametrize(
    "written",
    [
        calibrations.calibration(),
        calibrations.calibration(calibrations.ridge_arrays(symmetry="full")),
        calibrations.of_twelve_degrees(),
        calibrations.oriented_calibration(),
        replace(
            calibrations.calibration(),
            bound=calibrations.BOUND,
            actuator=replace(
                calibrations.ACTUATOR, stiff_tip=2e-3, base_lag=-1e-3, base_turn=-2e-6, tip_offset=-1e-3
            ),
            domain=replace(calibrations.DOMAIN, torque_max=0.6e-3),
        ),
        replace(
            calibrations.calibration(),
            domain=replace(calibrations.DOMAIN, beside_share=4.0 / 7.0, beside_max=79e3),
        ),
    ],
    ids=["mirror", "full", "no symmetry", "all orientations", "bound, ends and torque", "beside"],
)
def test_a_calibration_comes_back_to_the_last_bit(tmp_path: Path, written: Calibration) -> None:
    save_calibration(written, tmp_path / "calibration.json")
    read = read_calibration(tmp_path / "calibration.json")
    assert (read.layout, read.actuator, read.domain) == (written.layout, written.actuator, written.domain)
    assert (read.error, read.provenance) == (written.error, written.provenance)
    assert read.law.symmetry == written.law.symmetry
    for name in (*ARRAYS, "pressure_scale", "curvature_scale", "energy_scale", "rest_volume"):
        np.testing.assert_array_equal(getattr(read.law, name), getattr(written.law, name))
    assert read.error_bound == written.error_bound


def test_shipped_calibrations_are_written_as_they_are_read(tmp_path: Path) -> None:
    for shipped in sorted((ROOT / "rodmodel" / "calibrations").glob("*.json")):
        save_calibration(read_calibration(shipped), tmp_path / "again.json")
        assert (tmp_path / "again.json").read_bytes() == shipped.read_bytes(), shipped.name


def test_a_limit_beside_is_in_the_file_where_there_is_one_and_whole(tmp_path: Path) -> None:
    path = tmp_path / "calibration.json"
    save_calibration(calibrations.calibration(), path)
    assert "beside" not in path.read_text()
    limited = replace(calibrations.DOMAIN, beside_share=0.5, beside_max=79e3)
    save_calibration(replace(calibrations.calibration(), domain=limited), path)
    content = json.loads(path.read_text())
    both = {"pressure_beside_share": 0.5, "pressure_beside_max_pa": 79e3}
    assert content["domain"].items() >= both.items()
    for missing in both:
        half = {key: value for key, value in content["domain"].items() if key != missing}
        path.write_text(json.dumps({**content, "domain": half}))
        with pytest.raises(CalibrationFileError, match=f"domain.{missing}: got nothing, expected a number"):
            read_calibration(path)


def test_the_text_of_a_calibration_tells_its_limit_beside() -> None:
    plain = calibrations.calibration()
    record = calibration_record(plain)
    assert record["pressure_beside_max_kpa"] is None
    assert "100 kPa in sum\n" in calibration_text(record)
    limited = replace(calibrations.DOMAIN, beside_share=0.5, beside_max=79e3)
    record = calibration_record(replace(plain, domain=limited))
    assert (record["pressure_beside_share"], record["pressure_beside_max_kpa"]) == (0.5, 79.0)
    assert "100 kPa in sum, 79 kPa in each with 0.5 of the two others\n" in calibration_text(record)


def test_the_file_is_one_json_object_of_the_schema(tmp_path: Path) -> None:
    save_calibration(calibrations.calibration(), tmp_path / "calibration.json")
    content = json.loads((tmp_path / "calibration.json").read_text())
    sections = ["layout", "actuator", "section_law", "domain", "error", "provenance"]
    assert list(content) == ["schema", "version", *sections]
    assert content["schema"] == "rodmodel-calibration"
    assert content["version"] == 1


def test_the_error_of_the_full_actuator_adds_in_squares() -> None:
    error = {
        "free_bending_angle_rad": {"median": 0.1, "p90": 0.3, "p95": 0.5, "worst": 1.0},
        "actuator_angle_rad": {"p90": 0.4},
    }
    assert replace(calibrations.calibration(), error=error).error_bound.angle == (0.5,)


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"error": {"free_bending_angle_rad": {"median": 0, "p95": 0, "worst": math.nan}}}, "JSON compliant"),
        (
            {"actuator": replace(calibrations.ACTUATOR, stiff_tip=0.06)},
            "stiff_tip_m: got 0.06, expected less",
        ),
        ({"layout": Layout("double\nhelix", 0.0, 3e-3)}, "layout.name: got"),
        ({"layout": Layout("double-helix", None, 3e-3)}, "layout.psi_rad: got None with a law of one"),
    ],
)
def test_nothing_is_written_that_could_not_be_read(
    tmp_path: Path, changes: dict[str, Any], said: str
) -> None:
    bad = replace(calibrations.calibration(), **changes)
    with pytest.raises(ValueError, match=said):
        save_calibration(bad, tmp_path / "calibration.json")
    assert list(tmp_path.iterdir()) == []


def test_a_file_that_cannot_be_replaced_stays_whole(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "calibration.json"
    save_calibration(calibrations.calibration(), path)
    before = path.read_bytes()

    def full(self: Path, target: Path) -> Path:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(Path, "replace", full)
    with pytest.raises(OSError, match="No space left"):
        save_calibration(calibrations.of_twelve_degrees(), path)
    assert path.read_bytes() == before
    assert list(tmp_path.iterdir()) == [path]


@pytest.mark.parametrize("oriented", [False, True])
def test_a_calibration_is_made_of_a_differentiable_law_and_gives_it_back(oriented: bool) -> None:
    arrays = calibrations.ridge_arrays(oriented=oriented)
    given = calibrations.calibration(arrays)
    again = Calibration(
        layout=given.layout,
        actuator=given.actuator,
        domain=given.domain,
        error=given.error,
        provenance=given.provenance,
        section_law=given.section_law,
    )
    assert isinstance(given.section_law, OrientedNetwork if oriented else RidgeNetwork)
    assert given.section_law is given.section_law
    assert again.law.symmetry == arrays.symmetry
    for name in ARRAYS:
        np.testing.assert_array_equal(getattr(again.law, name), getattr(arrays, name))


@pytest.mark.parametrize(("law", "section_law"), [(None, None), (calibrations.ridge_arrays(), object())])
def test_a_calibration_has_one_law(unchecked: None, law: RidgeArrays | None, section_law: Any) -> None:
    made = calibrations.calibration()
    with pytest.raises(ValueError, match=r"law, section_law: got (neither|both), expected one of the two"):
        Calibration(
            layout=made.layout,
            actuator=made.actuator,
            domain=made.domain,
            error=made.error,
            provenance=made.provenance,
            law=law,
            section_law=section_law,
        )


def test_the_manual_has_the_ranges_that_the_reader_has() -> None:
    assert ranges_table() in (ROOT / "docs" / "reference" / "calibration_file.md").read_text()


def test_the_ranges_hold_all_numbers_that_ship() -> None:
    for file in sorted((ROOT / "rodmodel" / "calibrations").glob("*.json")):
        content = json.loads(file.read_text())
        for key, allowed in RANGES.items():
            value: Any = content
            for part in key.split("."):
                value = value.get(part, {})
            if value == {}:
                assert allowed.optional
                continue
            if value is None:
                assert allowed.null
                continue
            for number in value if isinstance(value, list) else [value]:
                assert allowed.holds(number), (file.name, key, number)


def test_no_error_of_a_file_is_another_kind_of_error() -> None:
    assert issubclass(CalibrationFileError, ValueError)
