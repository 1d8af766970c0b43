"""The sweep of a design: as many paths as there is time for, on file, and what it is expected to give."""

from dataclasses import replace
from pathlib import Path

import pytest

from calibration.from_design import Budget, Meshes, Task
from calibration.from_design.sweep_stage import expected_errors, paths_within, plan_of, sweep
from calibration.sweep import load_dataset
from fem_reference import Design
from rodmodel import Domain, shipped_calibrations
from tests.fem_fixtures import TINY
from tests.unit.calibration.manufactured_cell import ManufacturedTracer

DOMAIN = Domain((40e3,) * 3, 70e3, 6.6e-3, 3.3e-3)


def task_in(directory: Path) -> Task:
    return Task(Design(), Budget(600.0), directory, "the command", workers=1, meshes=Meshes(*[TINY] * 4))


def test_paths_fill_the_time(tmp_path):
    """One more would not fit, with the overhead of 1.4; twice the workers have time for twice the states."""
    plan = plan_of(task_in(tmp_path), DOMAIN, 0.2e-3, 1)

    def seconds(paths: int, workers: int) -> float:
        states = sum(len(path.loads) for path in replace(plan, paths=paths).design())
        return 1.4 * 0.5 * states / workers

    for workers in (1, 2):
        paths = paths_within(plan, 0.5, 200.0, workers)
        assert seconds(paths, workers) <= 200.0 < seconds(paths + 1, workers)


@pytest.mark.parametrize(("seconds", "paths"), [(0.0, 10), (1e9, 240)])
def test_there_are_paths_enough_to_fit_and_no_more_than_help(tmp_path, seconds, paths):
    assert paths_within(plan_of(task_in(tmp_path), DOMAIN, 0.2e-3, 1), 0.5, seconds, 2) == paths


def test_a_sweep_goes_on_with_its_files(tmp_path):
    """More paths are added to those on file, whose files stay as they were."""
    task = task_in(tmp_path)
    first, file, failed = sweep(task, plan_of(task, DOMAIN, 0.2e-3, 2), ManufacturedTracer())
    before = {path: path.read_text() for path in file.parent.glob("paths/*")}
    checksum = file.read_bytes()
    assert not failed
    assert len(before) == 2
    # A cell that fails would not be asked for what is on file.
    other = replace(task, command="another command")
    again, _, _ = sweep(other, plan_of(task, DOMAIN, 0.2e-3, 2), ManufacturedTracer(fails_beyond=0.0))
    assert again.equals(first)
    assert file.read_bytes() == checksum
    file.write_bytes(checksum[:1000])
    sweep(task, plan_of(task, DOMAIN, 0.2e-3, 2), ManufacturedTracer(fails_beyond=0.0))
    assert load_dataset(file).equals(first)
    more, _, _ = sweep(task, plan_of(task, DOMAIN, 0.2e-3, 3), ManufacturedTracer())
    assert more.sizes["state"] > first.sizes["state"]
    assert {path: path.read_text() for path in before} == before


def test_another_domain_has_a_sweep_of_its_own(tmp_path):
    task = task_in(tmp_path)
    one, other = (
        sweep(task, plan_of(task, domain, 0.2e-3, 1), ManufacturedTracer())[1]
        for domain in (DOMAIN, replace(DOMAIN, pressure_sum_max=60e3))
    )
    assert one.parent != other.parent


def test_failed_paths_are_told(tmp_path):
    task = task_in(tmp_path)
    _, _, failed = sweep(task, plan_of(task, DOMAIN, 0.2e-3, 1), ManufacturedTracer(fails_beyond=20e3))
    assert list(failed) == ["000-train-named"]
    assert "no step to" in failed["000-train-named"]


def test_expected_errors_are_those_of_shipped_laws():
    """Each with the states that it was fitted to; a law of all orientations has more to learn."""
    rows = expected_errors(shipped_calibrations())
    assert [row["states"] for row in rows] == sorted(row["states"] for row in rows)
    assert len(rows) == sum(c.layout.psi is not None for c in shipped_calibrations())
    assert all(0.0 < row["free_bending_percent"] < 2.0 for row in rows)
