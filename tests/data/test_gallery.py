"""The gallery's calibrations are of the designs beside them, by the one command, and say what they reach."""

from pathlib import Path

import pytest

from fem_reference import parse_design, read_design
from rodmodel import read_calibration
from rodmodel.cli import main

DESIGNS = Path(__file__).parents[2] / "designs"
MADE = sorted(file.stem for file in DESIGNS.glob("*.json"))


def test_four_other_actuators_are_there() -> None:
    assert MADE == ["dragon12", "ecoflex12", "ecoflex20", "slim8"]


@pytest.mark.parametrize("name", MADE)
def test_a_calibration_is_of_its_design_by_the_command_in_its_provenance(name: str) -> None:
    known = read_calibration(DESIGNS / f"{name}.json").provenance
    expected = read_design(DESIGNS / f"{name}.toml")
    made = parse_design(known["design"], name)
    for part in ("geometry", "core", "thread", "winding", "material"):
        assert getattr(made, part) == getattr(expected, part)
    assert known["from_design"]["command"].startswith(f"rodmodel-calibrate design designs/{name}.toml --out ")


@pytest.mark.parametrize("name", MADE)
def test_bars_are_met_or_the_shortfall_is_stated(name: str) -> None:
    """A bound that is stated holds at every judge state of its own."""
    made = read_calibration(DESIGNS / f"{name}.json")
    bars = {bar["name"]: bar for bar in made.provenance["from_design"]["bars"]}
    assert len(bars) == 3
    for bar in bars.values():
        assert bar["met"] is (bar["value"] <= bar["bar"])
    assert bars["tip of judge runs, median"]["met"]
    assert made.bound is not None
    assert 0.0 < made.bound.angle[0] <= made.bound.angle[-1] < 0.3
    assert made.provenance["bound"]["judge_states"] >= 4


@pytest.mark.parametrize("name", MADE)
def test_the_command_line_predicts_with_it(name: str, capsys: pytest.CaptureFixture[str]) -> None:
    file = DESIGNS / f"{name}.json"
    largest = 1e-3 * read_calibration(file).domain.pressure_max[0]
    given = ["predict", "--calibration", str(file), "--pressure-kpa", f"{0.9 * largest:.3g}", "0", "0"]
    assert main(given) == 0
    assert "the rod is stable" in capsys.readouterr().out
