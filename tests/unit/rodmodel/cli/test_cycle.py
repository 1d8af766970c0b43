"""`rodmodel cycle` and `predict --branch` on a calibration with a snapped branch."""

import json
from dataclasses import replace
from pathlib import Path

import pytest

import rodmodel
from rodmodel.cli import main
from tests.unit.rodmodel import calibrations


@pytest.fixture(scope="module")
def file(tmp_path_factory: pytest.TempPathFactory) -> str:
    path = tmp_path_factory.mktemp("calibration") / "snapped.json"
    rodmodel.save_calibration(calibrations.with_snapped((2, 1)), path)
    return str(path)


def run(capsys: pytest.CaptureFixture[str], *arguments: str) -> tuple[int, str, str]:
    status = main(list(arguments))
    captured = capsys.readouterr()
    return status, captured.out, captured.err


def test_a_cycle_shows_both_jumps_and_the_loop(file: str, capsys: pytest.CaptureFixture[str]) -> None:
    given = ["cycle", "--calibration", file, "--pressure-kpa", "0", "70", "0", "--steps", "14"]
    status, out, err = run(capsys, *given, "--json")
    assert (status, err) == (0, "")
    states = json.loads(out)["states"]
    assert [state["pressure_kpa"][1] for state in states[:15]] == pytest.approx(range(0, 71, 5))
    assert [state["pressure_kpa"] for state in states] == [state["pressure_kpa"] for state in states[::-1]]
    jumps = [state["pressure_kpa"][1] for state in states if state["jumped"]]
    assert jumps == pytest.approx([65.0, 35.0])
    up, down = states[10], states[-11]
    assert (up["branch"], down["branch"]) == ("loading", "snapped")
    assert up["other_branch_possible"]
    assert abs(up["bending_plane_deg"] - down["bending_plane_deg"]) > 5.0
    _, table, _ = run(capsys, *given)
    assert table.count("jumped") == 2
    assert table.count("snapped, chamber 2+") == sum(state["branch"] == "snapped" for state in states)


def test_a_gap_between_the_branches_is_told_and_does_not_end_the_cycle(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Loading ends at 50 kPa, the snapped branch at 60: between them each goes on past its calibration."""
    made = calibrations.with_snapped((2, 1))
    limited = replace(made.domain, pressure_max=(50e3, 50e3, 50e3))
    (law,) = made.snapped
    ended = replace(law, domain=replace(law.domain, pressure_min=(0.0, 60e3, 0.0)))
    rodmodel.save_calibration(replace(made, domain=limited, snapped=(ended,)), tmp_path / "gap.json")
    given = ["--calibration", str(tmp_path / "gap.json"), "--pressure-kpa", "0", "70", "0", "--steps", "14"]
    status, out, err = run(capsys, "cycle", *given, "--json", "--plot", str(tmp_path / "gap.png"))
    assert (status, err) == (0, "")
    states = json.loads(out)["states"]
    outside = [state["pressure_kpa"][1] for state in states if not state["in_domain"]]
    assert outside == pytest.approx([55.0, 55.0])
    assert [state["pressure_kpa"][1] for state in states if state["jumped"]] == pytest.approx([60.0, 50.0])
    assert run(capsys, "cycle", *given)[1].count("outside the calibration") == 2


def test_a_cycle_is_drawn(file: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    picture = tmp_path / "loop.png"
    given = ["--calibration", file, "--pressure-kpa", "0", "70", "0", "--plot", str(picture)]
    assert run(capsys, "cycle", *given)[0] == 0
    assert picture.stat().st_size > 10_000


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--pressure-kpa", "0", "90", "0"], "expected the top of the cycle inside the calibration"),
        (["--pressure-kpa", "0", "0", "0"], "--pressure-kpa: got '0 0 0', expected one above 0"),
        (["--pressure-kpa", "0", "9", "0", "--steps", "1"], "--steps: got '1', expected a whole number"),
    ],
)
def test_bad_input_is_refused_in_one_line(
    file: str, capsys: pytest.CaptureFixture[str], arguments: list[str], message: str
) -> None:
    status, out, err = run(capsys, "cycle", "--calibration", file, *arguments)
    assert (status, out, err.count("\n")) == (2, "", 1)
    assert message in err


def test_predict_follows_loading_from_rest_unless_asked(
    file: str, capsys: pytest.CaptureFixture[str]
) -> None:
    def predicted(kpa: str, *more: str) -> dict:
        given = ["predict", "--calibration", file, "--pressure-kpa", "0", kpa, "0", "--json", *more]
        status, out, err = run(capsys, *given)
        assert (status, err) == (0, "")
        return json.loads(out)

    assert predicted("55")["branch"] == "loading"
    assert predicted("55")["other_branch_possible"]
    assert predicted("55", "--branch", "snapped")["snapped_by_chamber"] == 2
    assert predicted("65")["branch"] == "snapped"
    assert predicted("65")["snapped_side"] == 1


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (
            ["0", "65", "0", "--branch", "loading"],
            "expected pressures inside the calibration: at most 70, 60, 60",
        ),
        (["0", "30", "0", "--branch", "snapped"], "inside the snapped branch: at most 15, 70, 15 kPa in"),
        (
            ["55", "0", "0", "--branch", "snapped"],
            "--branch: got snapped with the largest pressure in chamber 1",
        ),
    ],
)
def test_a_branch_that_is_not_there_is_refused(
    file: str, capsys: pytest.CaptureFixture[str], arguments: list[str], message: str
) -> None:
    status, out, err = run(capsys, "predict", "--calibration", file, "--pressure-kpa", *arguments)
    assert (status, out, err.count("\n")) == (2, "", 1)
    assert message in err
