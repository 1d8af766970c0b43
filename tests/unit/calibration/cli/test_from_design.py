"""`rodmodel-calibrate design`: refusals before the work, exit statuses, and the whole way on tiny meshes."""

import json
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
import pytest

import calibration.from_design as room
from calibration.cli import main
from calibration.from_design import Meshes, StageError, calibrate, pipeline
from rodmodel import read_calibration
from rodmodel.cli import main as rodmodel_main
from tests.fem_fixtures import TINY

PAPER = Path(__file__).parents[4] / "designs" / "paper.toml"


def design_file(directory: Path, **changed: str) -> Path:
    """The paper's design without pressures, some lines changed."""
    lines = PAPER.read_text().split("[pressures]")[0].splitlines()
    for key, line in changed.items():
        lines = [line if text.startswith(key) else text for text in lines]
    file = directory / "own.toml"
    file.write_text("\n".join(lines) + "\n")
    return file


def line_of(file: Path, key: str) -> int:
    return 1 + next(n for n, text in enumerate(file.read_text().splitlines()) if text.startswith(key))


@pytest.mark.parametrize(
    ("key", "line"),
    [
        ("outer_wall_mm", "outer_wall_mm = 0.001"),
        ("body_length_mm", 'body_length_mm = "60"'),
        ("pitch_mm", "pitch_mm = 100"),
        ("winding_diameter_mm", "winding_diameter_mm = 8"),
        ("young_modulus_mpa", "young_modulus_mpa = -5"),
        ("layout", 'layout = "knot"'),
    ],
)
def test_a_bad_design_is_refused_with_line_and_key(tmp_path, capsys, key, line):
    """Before any work: there is no folder of a run."""
    file = design_file(tmp_path, **{key: line})
    assert main(["design", str(file), "--out", str(tmp_path / "own.json")]) == 2
    (told,) = capsys.readouterr().err.splitlines()
    assert f"{file}, line {line_of(file, key)}:" in told
    assert key in told
    assert list(tmp_path.iterdir()) == [file]


@pytest.mark.parametrize("budget", ["1", "soon", "2s"])
def test_a_budget_that_is_no_time_is_refused(tmp_path, capsys, budget):
    status = main(
        ["design", str(design_file(tmp_path)), "--out", str(tmp_path / "a.json"), "--budget", budget]
    )
    assert status == 2
    assert capsys.readouterr().err.startswith("rodmodel-calibrate: --budget: got ")


def test_an_out_that_cannot_be_written_is_found_before_the_work(tmp_path, capsys):
    assert main(["design", str(design_file(tmp_path)), "--out", str(tmp_path / "no" / "own.json")]) == 2
    assert "--out" in capsys.readouterr().err


def test_a_stage_without_result_exits_3_and_writes_nothing(tmp_path, capsys, monkeypatch):
    def fails(task, say):
        raise StageError("range: chamber 1: the walls lose their stability below 4 kPa")

    monkeypatch.setattr(room, "calibrate", fails)
    out = tmp_path / "own.json"
    assert main(["design", str(design_file(tmp_path)), "--out", str(out), "--json"]) == 3
    printed = capsys.readouterr()
    assert printed.out == ""
    assert "chamber 1" in printed.err
    assert not out.exists()


@pytest.mark.slow
def test_the_whole_way_resumes_and_ends_in_a_calibration(tmp_path, capsys, monkeypatch):
    """On the fewest elements: interrupted at the sweep, it goes on; twice, it does nothing anew."""
    finer = replace(TINY, inner_arc=4, outer_arc=6)
    monkeypatch.setattr(Meshes, "of", classmethod(lambda cls, *_: cls(TINY, TINY, finer, TINY)))
    monkeypatch.setattr(room, "calibrate", partial(calibrate, iterations=5))
    out, folder = tmp_path / "own.json", tmp_path / "own_run"
    command = [
        "design",
        str(design_file(tmp_path)),
        "--out",
        str(out),
        "--budget",
        "1min",
        "--angle-deg",
        "45",
    ]

    def interrupted(*_):
        raise KeyboardInterrupt

    with monkeypatch.context() as patched:
        patched.setattr(pipeline, "sweep", interrupted)
        assert main(command) == 130
    capsys.readouterr()
    before = {file: file.stat().st_mtime_ns for file in folder.rglob("*.json")}
    assert {"range-1.json", "mesh.json", "plan.json"} <= {file.name for file in before}
    assert main([*command, "--json"]) == 0
    (line,) = capsys.readouterr().out.splitlines()
    answer = json.loads(line)
    assert all(end["ends_at"] == "angle" for end in answer["range"])
    assert answer["judge"]["judged"] > 0
    assert {file: file.stat().st_mtime_ns for file in before} == before

    made = read_calibration(out)
    np.testing.assert_array_equal(np.diff(made.bound.angle_by_bend) >= 0.0, True)
    assert made.bound.largest_angle > 0.0
    assert made.provenance["from_design"]["mesh_check"]["one_chamber_percent"] > 0.0
    page = out.with_suffix(".html").read_text()
    assert "data:image/png;base64," in page
    assert "http" not in page
    status = rodmodel_main(["predict", "--calibration", str(out), "--pressure-kpa", "10", "0", "0", "--json"])
    assert status == 0
    assert json.loads(capsys.readouterr().out)["converged"]

    kept = {file: file.stat().st_mtime_ns for file in folder.rglob("law-*.json")}
    assert main(command) == 0
    assert "own.json: the calibration of paper" in capsys.readouterr().out
    assert {file: file.stat().st_mtime_ns for file in folder.rglob("law-*.json")} == kept
