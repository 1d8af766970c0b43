"""A run directory remembers every command that it was run by."""

import json
from dataclasses import replace

import pytest

from calibration.run import RunError, RunPlan, open_run
from fem_reference import ActuatorGeometry, DoubleHelix
from rodmodel import Domain

PLAN = RunPlan(ActuatorGeometry(), DoubleHelix(), "coarse", Domain((6e4, 5e4, 5e4), 9e4, 2e-3), 10, seed=0)


def test_a_run_with_more_paths_adds_its_command_and_one_that_is_taken_up_does_not(tmp_path):
    for paths, command in ((10, "run --paths 10"), (10, "run --paths 10"), (20, "run --paths 20")):
        found = open_run(tmp_path, replace(PLAN, paths=paths), command, {})
    assert found["command"] == "run --paths 10; run --paths 20"
    assert json.loads((tmp_path / "run.json").read_text()) == found


def test_a_run_that_is_taken_up_by_other_code_says_so(tmp_path, monkeypatch):
    for version in ("one", "one", "two"):
        monkeypatch.setattr("calibration.run.code_version", lambda version=version: version)
        found = open_run(tmp_path, PLAN, "run --paths 10", {})
    assert found["code_version"] == "one; two"
    assert found["command"] == "run --paths 10"


def test_a_section_without_symmetry_has_no_plan():
    with pytest.raises(ValueError, match=r"^geometry: got an outer_wall_variation of \(0.1, 0.0, 0.0\)"):
        replace(PLAN, geometry=ActuatorGeometry(outer_wall_variation=(0.1, 0.0, 0.0)))


def test_a_run_of_another_plan_is_refused(tmp_path):
    open_run(tmp_path, PLAN, "run", {})
    with pytest.raises(RunError, match="holds a run with seed 0, this one has 1"):
        open_run(tmp_path, replace(PLAN, seed=1), "run --seed 1", {})
