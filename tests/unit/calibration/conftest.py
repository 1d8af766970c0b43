"""A run of the manufactured cell, and the import path that worker processes need to find that cell."""

import json
import sys
from pathlib import Path

import pytest

# Worker processes inherit the path.
sys.path.insert(0, str(Path(__file__).parent))

PATHS = 40


@pytest.fixture(scope="session")
def run_directory(tmp_path_factory):
    """A finished run, its dataset beside the paths' files."""
    from manufactured_cell import ManufacturedTracer

    from calibration.sweep import RunPlan, build_dataset, open_run, save_dataset
    from calibration.sweep.path_file import PathWriter, read_path
    from calibration.sweep.tracing import trace_path
    from fem_reference import Design
    from rodmodel import Domain

    directory = tmp_path_factory.mktemp("run")
    domain = Domain((70e3, 50e3, 50e3), 100e3, 2e-3)
    plan = RunPlan(Design(), "coarse", domain, PATHS, seed=0, end_compliance=0.23e-3)
    description = open_run(directory, plan, "rodmodel-calibrate run", {"bulk_modulus": 1e8})
    trace = ManufacturedTracer()()
    paths = plan.design()
    for path in paths:
        PathWriter(directory / f"{path.name}.jsonl").add(trace_path(trace, path))
    records = {path.name: read_path(directory / f"{path.name}.jsonl") for path in paths}
    save_dataset(build_dataset(paths, records, description), directory / "dataset.nc")
    assert json.loads((directory / "run.json").read_text())["seed"] == 0
    return directory


@pytest.fixture(scope="session")
def dataset(run_directory):
    from calibration.sweep import load_dataset

    return load_dataset(run_directory / "dataset.nc")


@pytest.fixture(scope="session")
def samples(dataset):
    from calibration.fit import loading_samples

    return loading_samples(dataset)
