"""Files that are no calibration: each is refused in one line that names file, key and what is expected."""

import copy
import json
import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rodmodel import CalibrationFileError, read_calibration, save_calibration
from tests.unit.rodmodel import calibrations

REMOVED = object()


@pytest.fixture(scope="module")
def text(tmp_path_factory: pytest.TempPathFactory) -> str:
    path = tmp_path_factory.mktemp("good") / "calibration.json"
    save_calibration(replace(calibrations.calibration(), bound=calibrations.BOUND), path)
    return path.read_text()


@pytest.fixture(scope="module")
def place(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("changed") / "calibration.json"


def told(path: Path) -> str:
    """What reading a bad file says, without the file's name, which it must begin with."""
    with pytest.raises(CalibrationFileError) as caught:
        read_calibration(path)
    message = str(caught.value)
    assert message.isprintable()
    assert message.startswith(f"{path}: ")
    assert "expected" in message
    assert len(message) < 500 + len(str(path))
    return message.removeprefix(f"{path}: ")


def changed(content: dict[str, Any], keys: str, value: Any) -> dict[str, Any]:
    """Content with one value replaced, added or removed."""
    result = copy.deepcopy(content)
    *path, last = keys.split(".")
    place = result
    for key in path:
        place = place[key]
    if value is REMOVED:
        del place[last]
    else:
        place[last] = value
    return result


LENGTH = "expected a number from 0.0001 to 10 m"
ERROR = "expected a number from 0 to 10 rad"
NODES = "expected 1 to 8 numbers, each a number from 0 to 3e+08 Pa"
VECTOR, MATRIX = "expected a vector of finite numbers", "expected a matrix of finite numbers"
P90 = "error.actuator_angle_rad.p90"

# Key, the value put there, what came, what is expected.
WRONG_VALUES = [
    ("schema", "something-else", "'something-else'", 'expected "rodmodel-calibration"'),
    ("schema", REMOVED, "nothing", 'expected "rodmodel-calibration"'),
    ("version", 2, "2", "expected version 1"),
    ("version", True, "True", "expected version 1"),
    ("version", 1.0, "1.0", "expected version 1"),
    ("layout", [1], "[1]", "expected a JSON object"),
    ("layout.name", "", "''", "expected a name of letters, digits"),
    ("layout.name", "ring\x00", r"'ring\x00'", "expected a name of letters, digits"),
    ("layout.name", "r\nng", r"'r\nng'", "expected a name of letters, digits"),
    ("layout.name", "\ud800", r"'\ud800'", "expected a name of letters, digits"),
    ("layout.name", "r" * 65, "'rrrrrrrrrrrr...rrrrrrrrrrrrr'", "expected a name of letters, digits"),
    ("layout.name", 3, "3", "expected a name of letters, digits"),
    ("layout.pitch_m", 0.0, "0.0", "expected a number from 1e-06 to 1 m"),
    ("layout.pitch_m", "3e-3", "'3e-3'", "expected a number from 1e-06 to 1 m"),
    ("layout.psi_rad", "zero", "'zero'", "expected a number from -100 to 100 rad or null"),
    ("layout.psi_rad", 1e300, "1e+300", "expected a number from -100 to 100 rad or null"),
    ("layout.psi_rad", None, "None with a law of one orientation", "expected null with a law of all"),
    ("layout.psi_rad", REMOVED, "nothing", "expected a number from -100 to 100 rad or null"),
    ("actuator.body_length_m", -0.06, "-0.06", LENGTH),
    ("actuator.body_length_m", 10.1, "10.1", LENGTH),
    ("actuator.body_length_m", 0.99e-4, "9.9e-05", LENGTH),
    ("actuator.cap_mass_kg", True, "True", "expected a number from 0 to 10000 kg"),
    ("actuator.stiff_tip_m", 0.06, "0.06", "expected less than the body's length, 0.06 m"),
    ("actuator.stiff_tip_m", -1e-3, "-0.001", "expected a number from 0 to 10 m"),
    ("actuator.held_length_m", 0.0601, "0.0601", "expected at most the body's length, 0.06 m"),
    ("actuator.held_length_m", -1e-3, "-0.001", "expected a number from 0 to 10 m"),
    ("actuator.base_stiffness_n_m2", -1e-4, "-0.0001", "expected a number from 0 to"),
    ("actuator.base_growth", -0.1, "-0.1", "expected a number from 0 to 10"),
    ("actuator.base_turn_rad_per_pa", 1.0, "1.0", "expected a number from -0.01 to 0.01 rad/Pa"),
    ("actuator.base_lag_m", 11.0, "11.0", "expected a number from -10 to 10 m"),
    ("actuator.base_lag_m", 0.07, "0.07", "expected at most the body's length, 0.06 m"),
    ("actuator.tip_offset_m", -2.0, "-2.0", "expected a number from -1 to 1 m"),
    ("actuator.tip_offset_m", -0.07, "-0.07", "expected at most the body's length, 0.06 m"),
    ("actuator.tip_draw_m3", 700.0, "700.0", "expected a number from -10 to 10 m3"),
    (
        "actuator.tip_draw_m3",
        2.2e-4,
        "0.00022",
        "expected at most the cube of the body's length, 0.000216 m3",
    ),
    ("actuator.tip_offset_curvature_per_m", 0.0, "0.0", "expected a number from 1e-06 to 1e+06 1/m"),
    ("actuator.shear_compliance_per_n", -0.1, "-0.1", "expected a number from 0 to 10000 1/N"),
    ("section_law.kind", "spline", "'spline'", '"ridge-network", "oriented-ridge-network" or'),
    ("section_law.kind", ["ridge-network"], "['ridge-network']", '"ridge-network", "oriented'),
    ("section_law.kind", "free-state-expansion", "'free-state-expansion', a kind that is no longer", "anew"),
    # Files from before the profile was changed do not name it.
    ("section_law.ridge_slope", REMOVED, "nothing", 'expected "(1 + z^2)^-2"'),
    ("section_law.energy_scale_n", 0, "0", "expected a number from 1e-12 to 1e+09 N"),
    ("section_law.offsets", REMOVED, "nothing", VECTOR),
    ("section_law.offsets", {}, "{}", VECTOR),
    ("section_law.offsets", [1.0, "2.0", 3.0], "'2.0' among its numbers", VECTOR),
    ("section_law.offsets", [1.0, True, 3.0], "True among its numbers", VECTOR),
    ("section_law.offsets", [1.0, None, 3.0], "None among its numbers", VECTOR),
    ("section_law.offsets", [1.0, [2.0], 3.0], "[2.0] among its numbers", VECTOR),
    (
        "section_law.offsets",
        [1.0, 2.0, 1e10],
        "1e+10 among its numbers",
        "each a number from -1e+09 to 1e+09",
    ),
    ("section_law.directions", [1.0, 2.0], "[1.0, 2.0]", MATRIX),
    ("section_law.directions", [[1.0, 2.0], [3.0]], "[[1.0, 2.0], [3.0]]", MATRIX),
    ("section_law.directions", [], "[]", MATRIX),
    ("domain.pressure_max_pa", [1.0, 2.0], "[1.0, 2.0]", "expected three numbers, each a number from 0.001"),
    ("domain.pressure_max_pa", [1.0, 2.0, -3.0], "[1.0, 2.0, -3.0]", "expected three numbers"),
    ("domain.torque_max_nm", 0.0, "0.0", "expected a number from 1e-12 to 1e+06 N m or null"),
    ("bound", [], "[]", "expected a JSON object"),
    ("bound.pressure_sum_pa", REMOVED, "nothing", NODES),
    ("bound.pressure_sum_pa", [], "[]", NODES),
    ("bound.pressure_sum_pa", [1e3 * k for k in range(9)], "[0.0, 1000.0, ", NODES),
    ("bound.pressure_sum_pa", [0.0, 2e4, 2e4], "20000 after 20000", "expected numbers that are increasing"),
    ("bound.pressure_sum_pa", [0.0, 2e4, 4e8], "[0.0, 20000.0, 400000000.0]", NODES),
    ("bound.angle_rad", [0.1, 0.1], "2 numbers", "expected 3, one at each of pressure_sum_pa"),
    (
        "bound.bending_angle_rad",
        REMOVED,
        "nothing",
        "expected 1 to 8 numbers, each a number from 0 to 1000 rad",
    ),
    ("bound.bending_angle_rad", [0.0, 0.5, 0.5], "0.5 after 0.5", "expected numbers that are increasing"),
    ("bound.tip_by_bend_m", [0.0], "1 numbers", "expected 3, one at each of bending_angle_rad"),
    ("bound.angle_by_bend_rad", [0.0, 0.2, 0.1], "0.1 after 0.2", "expected numbers that are not decreasing"),
    ("bound.angle_rad", [0.1, 0.2, 0.1], "0.1 after 0.2", "expected numbers that are not decreasing"),
    (
        "bound.angle_rad",
        [-0.1, 0.2, 0.2],
        "[-0.1, 0.2, 0.2]",
        "expected 1 to 8 numbers, each a number from 0",
    ),
    ("bound.angle_rad", 0.1, "0.1", "expected 1 to 8 numbers"),
    ("bound.tip_m", [1e-3, None, 1e-3], "[0.001, None, 0.001]", "expected 1 to 8 numbers"),
    ("bound.tip_m", [2e-3, 1e-3, 1e-3], "0.001 after 0.002", "expected numbers that are not decreasing"),
    ("bound.angle_rad_per_nm", -1.0, "-1.0", "expected a number from 0 to 1e+09 rad/(N m)"),
    ("bound.tip_per_n", REMOVED, "nothing", "expected a number from 0 to 1e+09 1/N"),
    ("error.free_bending_angle_rad.p95", REMOVED, "nothing", ERROR),
    ("error.free_bending_angle_rad.p90", "p90", "'p90'", ERROR),
    ("error.actuator_angle_rad", None, "None", "expected a JSON object"),
    ("error.actuator_angle_rad", {}, "nothing", ERROR),
    ("error.actuator_angle_rad", {"p90": None}, "None", ERROR),
    ("error.actuator_angle_rad", {"p90": "0.02"}, "'0.02'", ERROR),
    ("error.actuator_angle_rad", {"p90": [0.02]}, "[0.02]", ERROR),
    ("error.actuator_angle_rad", {"p90": {"p90": 0.02}}, "{'p90': 0.02}", ERROR),
    ("error.actuator_angle_rad", {"p90": 1e6}, "1000000.0", ERROR),
    ("error.actuator_angle_rad", {"p90": -0.02}, "-0.02", ERROR),
    ("provenance", REMOVED, "nothing", "expected an object"),
    ("provenance", [], "[]", "expected a JSON object"),
]


@pytest.mark.parametrize(("keys", "value", "came", "expected"), WRONG_VALUES)
def test_a_wrong_value_is_named(
    text: str, tmp_path: Path, keys: str, value: Any, came: str, expected: str
) -> None:
    file = tmp_path / "bad.json"
    file.write_text(json.dumps(changed(json.loads(text), keys, value)))
    message = told(file)
    assert message.startswith(keys)
    assert f": got {came}" in message
    assert expected in message


# Arrays and the size that one of them gets.
WRONG_SIZES = [
    ("feature_weights", [[1.0, 2.0]], "section_law.feature_weights: got shape (1, 2), expected (1, 3)"),
    ("feature_biases", [], "section_law.feature_biases: got [], expected a vector of finite numbers"),
    ("directions", [[1.0] * 3] * 2, "section_law.directions: got shape (2, 3), expected (3, 3)"),
    ("mixing", [[1.0] * 3] * 3, "section_law.mixing: got shape (3, 3), expected (3, 4)"),
    ("weights", [1.0] * 4, "section_law.weights: got shape (4,), expected (3,)"),
    ("factor", [1.0] * 5, "section_law.factor: got shape (5,), expected (6,)"),
    ("slopes", [1.0] * 3, "section_law.slopes: got shape (3,), expected (4,)"),
    ("guess", [[1.0] * 4] * 2, "section_law.guess: got shape (2, 4), expected (3, 4)"),
    ("symmetry", "some", "section_law.symmetry: got 'some', expected one of none, mirror, full"),
]


@pytest.mark.parametrize(("name", "value", "said"), WRONG_SIZES)
def test_arrays_that_do_not_fit_together_are_named(
    text: str, tmp_path: Path, name: str, value: Any, said: str
) -> None:
    file = tmp_path / "bad.json"
    file.write_text(json.dumps(changed(json.loads(text), f"section_law.{name}", value)))
    assert told(file).startswith(said)


@pytest.mark.parametrize(
    ("ridges", "features", "said"),
    [
        (2049, 1, "section_law.offsets: got 2049 ridges of 2 images, expected 1 to 4096 altogether"),
        (1, 1025, "section_law.feature_biases: got 1025 features, expected 1 to 1024"),
    ],
)
def test_a_law_larger_than_the_largest_is_refused(
    text: str, tmp_path: Path, ridges: int, features: int, said: str
) -> None:
    content = json.loads(text)
    content["section_law"] |= {
        "feature_weights": [[0.0] * 3] * features,
        "feature_biases": [0.0] * features,
        "directions": [[0.0] * 3] * ridges,
        "mixing": [[0.0] * (3 + features)] * ridges,
        "offsets": [0.0] * ridges,
        "weights": [0.0] * ridges,
        "slopes": [0.0] * (3 + features),
        "guess": [[0.0] * (3 + features)] * 3,
    }
    file = tmp_path / "bad.json"
    file.write_text(json.dumps(content))
    assert told(file) == said


# Text put in the place of a key's value: what JSON cannot be written with.
WRONG_TEXT = [
    ("pitch_m", "1e999", "layout.pitch_m: got inf, expected a number from 1e-06 to 1 m"),
    ("pitch_m", "NaN", "layout.pitch_m: got NaN, expected a finite number"),
    ("worst", "NaN", "error.free_bending_angle_rad.worst: got NaN, expected a finite number"),
    ("psi_rad", "-Infinity", "layout.psi_rad: got -Infinity, expected a finite number"),
    ("psi_rad", "9" * 5000, "layout.psi_rad: got an integer of 5000 digits, expected a finite number"),
    ("psi_rad", "9" * 400, "layout.psi_rad: got an integer of 400 digits, expected a finite number"),
    ("psi_rad", "9" * 200, "layout.psi_rad: got 999999999999999999...9999999999999999999, expected a number"),
    ("states", "9" * 5000, "error.states: got an integer of 5000 digits, expected a finite number"),
    ("pitch_m", '3e-3, "pitch_m": 3e-3', "layout.pitch_m: got this key twice, expected it once"),
    ("command", '{"a": [{"b": 1, "b": 1}]}', "provenance.command.a.b: got this key twice, expected it once"),
    ("command", "[" * 40 + "]" * 40, "provenance.command: got too many brackets within one another"),
]


@pytest.mark.parametrize(("key", "value", "said"), WRONG_TEXT, ids=range(len(WRONG_TEXT)))
def test_what_json_lets_through_is_named(text: str, tmp_path: Path, key: str, value: str, said: str) -> None:
    file = tmp_path / "bad.json"
    replaced, count = re.subn(rf'"{key}": (?:"[^"]*"|[^,}}]+)', f'"{key}": {value}', text)
    assert count == 1
    file.write_text(replaced)
    assert told(file).startswith(said)


def test_a_number_that_is_none_among_an_arrays_is_named(text: str, tmp_path: Path) -> None:
    file = tmp_path / "bad.json"
    content = json.loads(text)
    content["section_law"]["directions"][1][0] = float("nan")
    file.write_text(json.dumps(content))
    assert told(file) == "section_law.directions: got NaN, expected a finite number"


@pytest.mark.parametrize("brackets", ["[" * 100_000, "[" * 100_000 + "]" * 100_000, '{"a":' * 100_000])
def test_nesting_without_end_is_told(tmp_path: Path, brackets: str) -> None:
    file = tmp_path / "bad.json"
    file.write_text(brackets)
    assert told(file) == "got too many brackets within one another, expected at most 32"


@pytest.mark.parametrize("kept", [0, 1, 200, 1000])
def test_a_truncated_file_is_told(text: str, tmp_path: Path, kept: int) -> None:
    file = tmp_path / "bad.json"
    file.write_text(text[:kept])
    assert f"of {kept} " in told(file)


def test_other_text_is_told(tmp_path: Path) -> None:
    file = tmp_path / "bad.json"
    file.write_text("[1, 2]")
    assert told(file) == "the file: got [1, 2], expected a JSON object"
    file.write_text("NaN")
    assert told(file) == "the file: got NaN, expected a finite number"
    file.write_bytes(b"\xff\xfe\x00")
    assert "readable" in told(file)
    file.unlink()
    assert "readable" in told(file)
    assert "readable" in told(tmp_path)


def test_a_key_of_any_text_is_told_in_one_line(tmp_path: Path) -> None:
    file = tmp_path / "bad.json"
    file.write_text(json.dumps({"a\nb\x00": {"c" * 10_000: "x"}}).replace('"x"', "NaN"))
    assert "got NaN" in told(file)


def test_a_name_that_no_file_can_have_is_told_in_one_line() -> None:
    with pytest.raises(CalibrationFileError) as caught:
        read_calibration("a\x00\nb.json")
    assert str(caught.value) == (
        r"'a\x00\nb.json': got embedded null byte, expected a readable calibration file"
    )


# Written over a piece of a good file: from here, so many characters, this.
PIECES = [
    '"',
    "{",
    "}",
    "[",
    "]",
    ",",
    ":",
    "null",
    "true",
    "1e999",
    "-1",
    "NaN",
    "9" * 400,
    "\\u0000",
    "\\ud800",
]
PIECES += ['""', "[]", "{}", "1e308", "-0.0", "\x00", "é", "0x1", "1.0", "1e-320", ""]


@settings(max_examples=400)
@given(start=st.floats(0.0, 1.0), length=st.integers(0, 40), piece=st.sampled_from(PIECES))
def test_whatever_is_written_over_a_file_it_is_read_or_refused(
    text: str, place: Path, start: float, length: int, piece: str
) -> None:
    first = int(start * len(text))
    place.write_text(text[:first] + piece + text[first + length :], encoding="utf-8")
    said = ""
    try:
        assert read_calibration(place).error_bound.angle[0] >= 0.0
    except CalibrationFileError as error:
        said = str(error)
    assert said == "" or (said.isprintable() and said.startswith(f"{place}: "))
