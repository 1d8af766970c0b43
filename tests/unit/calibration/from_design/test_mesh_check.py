"""Angles on several meshes: what they say of the sweep's errors."""

import json
import math
from dataclasses import replace

import numpy as np
import pytest

from calibration.from_design import Budget, Meshes, Task
from calibration.from_design import mesh_check as stage
from calibration.from_design.mesh_check import MeshCheck, check_meshes, check_pressures, is_close
from calibration.sweep import inside
from fem_reference import Design
from rodmodel import Domain
from tests.fem_fixtures import TINY

CHECK = MeshCheck(((30e3, 0.0, 0.0), (0.0, 20e3, 20e3)), (1.01, 1.98), (1.0, 2.0), (1.0, 1.8), 0.5)


def test_the_error_is_that_to_the_finer_mesh():
    """Of one chamber, and of two; of three the larger of both."""
    assert [CHECK.error(n) for n in (1, 2, 3)] == pytest.approx([0.01, 0.01, 0.01])
    assert replace(CHECK, sweep=(1.01, 2.06)).error(3) == pytest.approx(0.03)


def test_the_ratio_carries_an_actuators_angle_to_the_sweeps_mesh():
    assert [CHECK.ratio(n) for n in (1, 2)] == pytest.approx([1.01, 1.1])
    assert CHECK.ratio(3) == pytest.approx(1.055)


def test_a_mesh_that_did_not_converge_is_unknown_in_a_file_too():
    """JSON has no NaN."""
    open_ = replace(CHECK, finer=(1.0, math.nan))
    again = MeshCheck.of(json.loads(json.dumps(open_.record(), allow_nan=False)))
    assert again.error(1) == open_.error(1)
    assert math.isnan(again.error(2))
    assert math.isnan(again.error(3))
    assert MeshCheck.of(CHECK.record()) == CHECK


@pytest.mark.parametrize(
    ("angles", "close"),
    [((1.0, 2.0), True), ((0.986, 2.029), True), ((1.0, 2.04), False), ((1.0, math.nan), False)],
)
def test_a_mesh_is_close_if_both_its_angles_are(angles, close):
    """Within 1.5 %, at both loads."""
    assert is_close(angles, (1.0, 2.0)) is close


@pytest.mark.parametrize(("of_cheaper", "chosen"), [(1.01, True), (1.04, False)])
@pytest.mark.parametrize("workers", [1, 2])
def test_the_cheaper_mesh_is_the_sweeps_if_it_is_close_to_the_finer(
    of_cheaper, chosen, workers, tmp_path, monkeypatch
):
    """Then the sweep's own is not computed at all. No load is solved twice on a mesh."""
    angles = {"coarse": of_cheaper, "fine": 0.998, "finer": 1.0}
    asked = []

    def found(_design, level, _compliance, pressure):
        asked.append((level, pressure))
        seconds = {"coarse": 2.0, "fine": 10.0, "finer": 60.0}[level]
        return {"angle": (1.0 if pressure[0] > 0.0 else 1.5) * angles[level], "seconds": [seconds] * 4}

    def run_jobs(jobs, workers, watch):
        for job in jobs:
            job.target(*job.args)

    monkeypatch.setattr(stage, "_angle_at", found)
    monkeypatch.setattr(stage, "run_jobs", run_jobs)
    meshes = Meshes("coarse", "fine", "finer", "coarse", cheaper="coarse")
    task = Task(Design(), Budget(3600.0), tmp_path, "the command", workers=workers, meshes=meshes)
    check = check_meshes(task, Domain((60e3,) * 3, 110e3, 1.0), 0.0)
    assert check.cheaper is chosen
    assert check.sweep == pytest.approx([of_cheaper if chosen else 0.998, 1.5 * check.sweep[0]])
    assert check.seconds == (2.0 if chosen else 10.0)
    assert len(asked) == len(set(asked)) == (4 if chosen else 6)
    assert MeshCheck.of(check.record()) == check


def test_a_cell_that_gives_way_has_no_angle(tmp_path, monkeypatch):
    """Nor one without a mesh; the other meshes' angles stand."""

    def found(_design, level, _compliance, _pressure):
        return {"angle": None if level == "finer" else 1.0, "seconds": [1.0]}

    monkeypatch.setattr(stage, "_angle_at", found)
    meshes = Meshes("coarse", "coarse", "finer", "coarse")
    task = Task(Design(), Budget(600.0), tmp_path, "the command", workers=1, meshes=meshes)
    check = check_meshes(task, Domain((60e3,) * 3, 110e3, 1.0), 0.0)
    assert np.isnan(check.finer).all()
    assert check.sweep == (1.0, 1.0)


@pytest.mark.slow
def test_meshes_are_solved_in_processes(tmp_path):
    """On the fewest elements, one of them with thinner ones."""
    meshes = Meshes(TINY, TINY, replace(TINY, axial_size=0.5), TINY)
    task = Task(Design(), Budget(600.0), tmp_path, "the command", meshes=meshes)
    check = check_meshes(task, Domain((4e3,) * 3, 8e3, 1.0), 0.0)
    assert np.isfinite((*check.sweep, *check.finer)).all()
    assert 0.0 < check.error(1) < 0.2


@pytest.mark.parametrize(
    "domain", [Domain((60e3,) * 3, 110e3, 1.0), Domain((60e3, 50e3, 50e3), 80e3, 1.0, 1.0, 0.5, 60e3)]
)
def test_meshes_are_compared_inside_the_domain(domain):
    pressures = check_pressures(domain)
    assert inside(domain, np.array(pressures), np.zeros((2, 3))).all()
    assert pressures[0][0] == 0.75 * domain.pressure_max[0]
