"""A run that was restored from its dataset holds the same states, and goes on with more paths."""

import json
from dataclasses import replace

import pytest
import xarray as xr

from calibration.sweep import RunError, RunPlan, build_dataset, open_run, run_sweep
from calibration.sweep.path_file import path_file, read_path
from calibration.sweep.restore_run import restore_run
from fem_reference import Design
from rodmodel import Domain

PLAN = RunPlan(
    Design(), "coarse", Domain((70e3, 50e3, 50e3), 100e3, 2e-3), 40, seed=0, end_compliance=0.23e-3
)
MATERIAL = {"bulk_modulus": 1e8}


def test_its_dataset_is_the_one_that_it_was_restored_from(dataset, tmp_path):
    restore_run(dataset, tmp_path, PLAN, MATERIAL)
    description = open_run(tmp_path, PLAN, "rodmodel-calibrate run", MATERIAL)
    paths = PLAN.design()
    records = {path.name: read_path(path_file(tmp_path, path.name)) for path in paths}
    xr.testing.assert_identical(build_dataset(paths, records, description), dataset)


def test_it_goes_on_with_the_paths_that_are_not_in_the_dataset(dataset, tmp_path):
    from manufactured_cell import ManufacturedTracer

    restore_run(dataset, tmp_path, PLAN, MATERIAL)
    before = {file.name: file.read_text() for file in (tmp_path / "paths").iterdir()}
    more = replace(PLAN, paths=42)
    found = open_run(tmp_path, more, "rodmodel-calibrate run --paths 42", MATERIAL)
    assert found["command"] == "rodmodel-calibrate run; rodmodel-calibrate run --paths 42"
    records = run_sweep(ManufacturedTracer(), more.design(), tmp_path, workers=1)
    assert len(records) == 42
    assert all(record.end is not None for record in records.values())
    assert before.items() <= {file.name: file.read_text() for file in (tmp_path / "paths").iterdir()}.items()


def test_paths_that_ended_early_are_tried_again_where_that_is_asked_for(dataset, tmp_path):
    lost, failed, *others = (path.name for path in PLAN.design())
    ended = dataset.assign_attrs(
        unstable=json.dumps({lost: {"unstable": None, "attempts": 1}}),
        failures=json.dumps({failed: {"failure": "no convergence", "reached": None, "attempts": 2}}),
    )
    restore_run(ended, tmp_path, PLAN, MATERIAL, retry=True)
    assert {file.stem for file in (tmp_path / "paths").iterdir()} == set(others)


def test_a_directory_that_holds_a_run_is_left_alone(dataset, tmp_path):
    """The same command, after a kill, finds more paths and commands than the dataset has."""
    restore_run(dataset, tmp_path, PLAN, MATERIAL)
    open_run(tmp_path, replace(PLAN, paths=42), "rodmodel-calibrate run --paths 42", MATERIAL)
    path_file(tmp_path, "040-train-mixed").write_text("{}\n")
    before = {file: file.read_text() for file in tmp_path.rglob("*.json*")}
    restore_run(dataset, tmp_path, PLAN, MATERIAL)
    assert {file: file.read_text() for file in tmp_path.rglob("*.json*")} == before


def test_a_dataset_of_another_run_is_refused_before_anything_is_written(dataset, tmp_path):
    with pytest.raises(RunError, match="--extend: the dataset holds a run with seed 0, this one has 1"):
        restore_run(dataset, tmp_path, replace(PLAN, seed=1), MATERIAL)
    assert not any(tmp_path.iterdir())


def test_paths_that_another_version_drew_are_refused(dataset, tmp_path):
    """As if the design had changed: one state is off its path by a tenth of a kilopascal."""
    other = dataset.copy(deep=True)
    other["pressure"][7, 1] += 100.0
    name = str(dataset["path"].values[7])
    with pytest.raises(RunError, match=f"states off the path {name} that this version draws from seed 0"):
        restore_run(other, tmp_path, PLAN, MATERIAL)
    assert not any(tmp_path.iterdir())
