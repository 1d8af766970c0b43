"""The calibration file: what is written comes back, and what is wrong is told in one line."""

import copy
import json
import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import jax
import numpy as np
import pytest

from rodmodel import Calibration, CalibrationFileError, read_calibration, save_calibration
from tests.unit.rodmodel import synthetic


@pytest.fixture
def file(tmp_path: Path) -> Path:
    path = tmp_path / "calibration.json"
    save_calibration(synthetic.calibration(), path)
    return path


@pytest.fixture
def content(file: Path) -> dict[str, Any]:
    return json.loads(file.read_text())


@pytest.mark.parametrize(
    "law",
    [
        synthetic.bending_law(),
        synthetic.bending_law(pressure_warp=4e3, mirror=False, hidden=(8,)),
        synthetic.linear_law(),
        synthetic.ridge_law(symmetry="full"),
    ],
    ids=["two hidden layers", "warped", "no hidden layer", "ridges"],
)
def test_a_calibration_comes_back_to_the_last_bit(tmp_path: Path, law: Any) -> None:
    written = synthetic.calibration(law)
    save_calibration(written, tmp_path / "calibration.json")
    read = read_calibration(tmp_path / "calibration.json")
    assert (read.layout, read.actuator, read.domain) == (written.layout, written.actuator, written.domain)
    assert (read.error, read.provenance) == (written.error, written.provenance)
    assert jax.tree.structure(read.section_law) == jax.tree.structure(law)
    for one, other in zip(jax.tree.leaves(read.section_law), jax.tree.leaves(law), strict=True):
        np.testing.assert_array_equal(one, other)
    assert read.angle_error == 0.016


def test_the_file_is_one_json_object_of_the_schema(content: dict[str, Any]) -> None:
    assert list(content) == [
        "schema",
        "version",
        "layout",
        "actuator",
        "section_law",
        "domain",
        "error",
        "provenance",
    ]
    assert content["schema"] == "rodmodel-calibration"
    assert content["version"] == 1


def told(path: Path) -> str:
    """What reading a bad file says, without the file's name, which it must begin with."""
    with pytest.raises(CalibrationFileError) as caught:
        read_calibration(path)
    message = str(caught.value)
    assert "\n" not in message
    assert message.startswith(f"{path}: ")
    assert "expected" in message
    return message.removeprefix(f"{path}: ")


def changed(content: dict[str, Any], keys: str, value: Any) -> dict[str, Any]:
    """Content with one value replaced, or removed where the new one is None."""
    result = copy.deepcopy(content)
    *path, last = keys.split(".")
    place = result
    for key in path:
        place = place[key]
    if value is None:
        del place[last]
    else:
        place[last] = value
    return result


@pytest.mark.parametrize(
    ("keys", "value", "came", "expected"),
    [
        ("schema", "something-else", "'something-else'", '"rodmodel-calibration"'),
        ("schema", None, "nothing", '"rodmodel-calibration"'),
        ("version", 2, "2", "version 1"),
        ("layout", [1], "[1]", "a JSON object"),
        ("layout.name", "", "''", "a name"),
        ("layout.pitch_m", 0.0, "0.0", "a positive number"),
        ("layout.psi_rad", "zero", "'zero'", "a finite number"),
        ("actuator.body_length_m", -0.06, "-0.06", "a positive number"),
        ("actuator.cap_mass_kg", True, "True", "zero or a positive number"),
        (
            "section_law.kind",
            "spline",
            "'spline'",
            '"ridge-network" or "oriented-ridge-network" or "free-state-expansion"',
        ),
        ("section_law.mirror", 1, "1", "true or false"),
        ("section_law.pressure_warp_pa", -1.0, "-1.0", "a positive number or null"),
        ("section_law.weights", None, "nothing", "a list of matrices of finite numbers"),
        ("section_law.weights", [[1.0, 2.0]], "[1.0, 2.0] of shape (2,)", "a list of matrices"),
        ("section_law.biases", [[1.0, "two"]], "[1.0, 'two']", "a list of vectors"),
        ("domain.pressure_max_pa", [1.0, 2.0], "[1.0, 2.0]", "three positive numbers"),
        ("error.free_bending_angle_rad.p95", None, "nothing", "zero or a positive number"),
        ("provenance", None, "nothing", "an object"),
    ],
)
def test_a_wrong_value_is_named(
    file: Path, content: dict[str, Any], keys: str, value: Any, came: str, expected: str
) -> None:
    file.write_text(json.dumps(changed(content, keys, value)))
    message = told(file)
    assert message.startswith(f"{keys}: got {came}")
    assert f"expected {expected}" in message


def test_layers_of_wrong_shapes_are_named(file: Path, content: dict[str, Any]) -> None:
    law = content["section_law"]
    content = changed(content, "section_law.weights", law["weights"][:-1])
    file.write_text(json.dumps(changed(content, "section_law.biases", law["biases"][:-1])))
    assert told(file).startswith("section_law: weights, biases: got shapes")


def test_a_nan_in_a_weight_is_named(file: Path, content: dict[str, Any]) -> None:
    content["section_law"]["weights"][1][0][0] = math.nan
    file.write_text(json.dumps(content))
    assert told(file).startswith("section_law.weights: got")


def test_an_overflowing_number_is_named(file: Path) -> None:
    file.write_text(file.read_text().replace('"pitch_m": 0.003', '"pitch_m": 1e999'))
    assert told(file) == "layout.pitch_m: got inf, expected a positive number"


@pytest.mark.parametrize("kept", [0, 1, 200, 20_000])
def test_a_truncated_file_is_told(file: Path, kept: int) -> None:
    file.write_text(file.read_text()[:kept])
    assert f"of {kept} " in told(file)


def test_other_text_is_told(file: Path) -> None:
    file.write_text("[1, 2]")
    assert told(file) == "the file: got [1, 2], expected a JSON object"
    file.write_bytes(b"\xff\xfe\x00")
    assert "readable" in told(file)
    file.unlink()
    assert "readable" in told(file)


def test_nothing_is_written_that_could_not_be_read(tmp_path: Path) -> None:
    good = synthetic.calibration()
    bad: Calibration = replace(good, error={**good.error, "worst": math.nan})
    with pytest.raises(ValueError, match="not JSON compliant"):
        save_calibration(bad, tmp_path / "calibration.json")
    assert not (tmp_path / "calibration.json").exists()


def test_a_bad_array_of_ridges_is_named(tmp_path: Path) -> None:
    file = tmp_path / "calibration.json"
    save_calibration(synthetic.calibration(synthetic.ridge_law()), file)
    content = json.loads(file.read_text())
    for value, came in (([1.0, "two"], "[1.0, 'two']"), ([[1.0]], "[[1.0]] of shape (1, 1)")):
        file.write_text(json.dumps(changed(content, "section_law.offsets", value)))
        assert told(file) == f"section_law.offsets: got {came}, expected a vector of finite numbers"
    file.write_text(json.dumps(changed(content, "section_law.symmetry", "some")))
    assert told(file) == "section_law: symmetry: got 'some', expected one of none, mirror, full"


def test_ridges_of_another_profile_are_refused(tmp_path: Path) -> None:
    """Files from before the profile was changed do not name it."""
    file = tmp_path / "calibration.json"
    save_calibration(synthetic.calibration(synthetic.ridge_law()), file)
    content = json.loads(file.read_text())
    del content["section_law"]["ridge_slope"]
    file.write_text(json.dumps(content))
    assert told(file) == 'section_law.ridge_slope: got nothing, expected "(1 + z^2)^-2"'
