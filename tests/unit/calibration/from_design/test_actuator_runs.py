"""Runs of the full actuator of a design: which ones, and that they resume."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from calibration.from_design import Budget, Meshes, StageError, Task
from calibration.from_design import actuator_runs as stage
from calibration.sweep import inside
from calibration.truth import TruthCase
from fem_reference import ActuatorLoad, Design, DoubleHelix, Ring
from rodmodel import Domain
from tests.fem_fixtures import TINY

DOMAIN = Domain((60e3, 50e3, 50e3), 80e3, 1.0, 1.0, 0.5, 60e3)


def task_in(directory: Path, budget: float = 600.0, **changed) -> Task:
    design = replace(Design(), **changed)
    return Task(design, Budget(budget), directory, "the command", workers=2, meshes=Meshes(*[TINY] * 4))


@pytest.mark.parametrize("winding", [DoubleHelix(), Ring(), DoubleHelix(psi=0.4)])
@pytest.mark.parametrize("budget", [600.0, 8 * 3600.0])
def test_runs_lie_in_the_domain_and_no_load_has_both_roles(tmp_path, budget, winding):
    cases = stage.cases_for(task_in(tmp_path, budget, winding=winding), DOMAIN)
    loads = {
        role: [load.pressure for c in cases if c.role == role for load in c.loads]
        for role in ("fit", "judge")
    }
    assert not set(loads["fit"]) & set(loads["judge"])
    for role in loads.values():
        assert inside(DOMAIN, np.array(role), np.zeros((len(role), 3))).all()
    for role in ("fit", "judge"):
        assert {(np.array(c.loads[-1].pressure) > 0.0).sum() for c in cases if c.role == role} >= {1, 2}
    assert len({case.name for case in cases}) == len(cases)


def test_a_run_keeps_its_plane_where_winding_and_loads_have_one(tmp_path):
    plane = [c.name for c in stage.cases_for(task_in(tmp_path), DOMAIN) if c.symmetric]
    assert plane == ["fit-chamber1", "judge-chambers23"]
    turned = task_in(tmp_path, winding=DoubleHelix(psi=0.4))
    assert not any(c.symmetric for c in stage.cases_for(turned, DOMAIN))
    # Where chambers are alike, nothing is lost by staying in it.
    rings = stage.cases_for(task_in(tmp_path, winding=Ring()), DOMAIN)
    assert [c.name for c in rings] == ["fit-chambers23", "fit-chamber1", "judge-chambers23", "judge-chamber1"]
    assert all(c.symmetric for c in rings)


def test_what_is_on_file_is_not_run_again(tmp_path, monkeypatch):
    """Neither a finished run nor one that ended early; and without any state the stage has no result."""
    task = task_in(tmp_path)
    cases = [
        TruthCase(name, "fit", DoubleHelix(), (ActuatorLoad((1e3, 0.0, 0.0)),)) for name in ("one", "two")
    ]
    begun = []

    def trace_all(task, pending, directory, level, limit):
        begun.extend(case.name for case in pending)
        for case in pending:
            directory.mkdir(parents=True, exist_ok=True)
            stage._failure(directory, case).write_text("no step")

    monkeypatch.setattr(stage, "_trace_all", trace_all)
    for _ in range(2):
        with pytest.raises(StageError, match="one: no step; two: no step"):
            stage.run_actuators(task, cases)
    assert begun == ["one", "two"]


def test_a_run_out_of_time_goes_on_with_a_longer_budget_alone(tmp_path, monkeypatch):
    """With the time of the first one it is over, and told."""
    cases = [TruthCase("one", "fit", DoubleHelix(), (ActuatorLoad((1e3, 0.0, 0.0)),))]
    limits = []

    def trace_all(task, pending, directory, level, limit):
        limits.append(limit)
        directory.mkdir(parents=True, exist_ok=True)
        stage._out_of_time(directory, pending[0]).write_text(f"{limit}")

    monkeypatch.setattr(stage, "_trace_all", trace_all)
    for budget in (1200.0, 1200.0, 3600.0):
        with pytest.raises(StageError, match="one: there was no more time after"):
            stage.run_actuators(task_in(tmp_path, budget), cases)
    assert limits == [0.4 * 1200.0, 0.4 * 3600.0]


@pytest.mark.slow
def test_runs_end_with_their_time(tmp_path):
    """A load that no process reaches in a second ends early, within the time that ends a process."""
    task = task_in(tmp_path)
    case = TruthCase("one", "fit", DoubleHelix(), (ActuatorLoad((50e3, 0.0, 0.0)),))
    stage._trace_all(task, [case], tmp_path / "runs", TINY, 1.0)
    assert (tmp_path / "runs" / "one.time.txt").read_text() == "1.0"


@pytest.mark.slow
def test_runs_in_processes_are_gathered_and_resumed(tmp_path):
    """Of a body twice as large, on the fewest elements: stations along its own length, its own design."""
    task = task_in(tmp_path)
    cases = [
        TruthCase(f"{role}-one", role, DoubleHelix(), (ActuatorLoad((p, 0.0, 0.0)),), True)
        for role, p in (("fit", 1e3), ("judge", 1.5e3))
    ]
    runs, failed = stage.run_actuators(task, cases)
    assert not failed
    assert runs.sizes["state"] == 2
    assert runs["station"].values[-1] == pytest.approx(task.design.geometry.body_length)
    assert "design" in runs.attrs
    again, _ = stage.run_actuators(task, cases)
    assert again.equals(runs)
