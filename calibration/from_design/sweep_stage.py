"""Stage 4: the sweep of the cell, with as many paths as the budget has time for."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from calibration.from_design.stage_record import StageError, key_of
from calibration.from_design.task import Task
from calibration.sweep import (
    CellTracer,
    DatasetError,
    RunPlan,
    SweepError,
    build_dataset,
    load_dataset,
    open_run,
    run_sweep,
    save_dataset,
)
from rodmodel import Calibration, Domain

# Fewest and most paths of a sweep: every fifth is held out, and laws of ours have no more.
_FEWEST, _MOST = 10, 240
# Time of a path relative to its states': moments, bisections and second attempts.
_OVERHEAD = 1.4
_SEED = 0


def plan_of(task: Task, domain: Domain, compliance: float, paths: int) -> RunPlan:
    """Return the plan of the sweep."""
    actuator = replace(task.design, end_compliance=compliance)
    return RunPlan(
        actuator=actuator,
        level=task.levels.sweep,
        domain=domain,
        paths=paths,
        seed=_SEED,
        end_compliance=compliance,
    )


def paths_within(plan: RunPlan, seconds_per_state: float, seconds: float, workers: int) -> int:
    """Return the number of paths of a sweep that takes so long.

    Parameters
    ----------
    plan : of any number of paths.
    seconds_per_state : time of one state [s].
    seconds : time of the sweep [s].
    workers : processes.
    """
    loads = np.cumsum([len(path.loads) for path in replace(plan, paths=_MOST).design()])
    states = seconds * workers / (_OVERHEAD * seconds_per_state)
    return int(np.clip(np.searchsorted(loads, states, side="right"), _FEWEST, _MOST))


def sweep(
    task: Task, plan: RunPlan, make_trace: Callable[[], Any] | None = None
) -> tuple[xr.Dataset, Path, dict[str, str]]:
    """Run or resume the sweep.

    Parameters
    ----------
    task, plan : of the calibration, and of its sweep.
    make_trace : picklable factory of the cell's continuation; by default the finite-element cell.

    Returns
    -------
    dataset, its file, and the paths that failed with the reason.

    Raises
    ------
    StageError
        If it ends without states.
    """
    directory = task.directory / f"sweep-{key_of(plan.description())}"
    description = open_run(directory, plan, task.command, plan.material)
    paths = plan.design()
    tracer = make_trace or CellTracer(plan.actuator, plan.level, plan.end_compliance)
    try:
        records = run_sweep(tracer, paths, directory, task.workers, task.scheduler)
        dataset = build_dataset(paths, records, description)
    except (SweepError, DatasetError) as error:
        raise StageError(f"sweep: {error}") from error
    file = directory / "dataset.nc"
    # Its attributes name each command that went on with the run; the law is that of a file's checksum.
    if not _holds(file, dataset):
        save_dataset(dataset, file)
    failed = {
        name: str(record.end["failure"]) for name, record in records.items() if record.end and record.failed
    }
    return dataset, file, failed


def _holds(file: Path, dataset: xr.Dataset) -> bool:
    """Whether a file has these states."""
    if not file.exists():
        return False
    try:
        return bool(load_dataset(file).equals(dataset))
    except DatasetError:
        return False


def expected_errors(known: list[Calibration]) -> list[dict[str, Any]]:
    """Return what laws of ours err by, by the number of states that they were fitted to.

    Returns
    -------
    rows of ``states``, ``free_bending_percent`` (95 % of held-out states, of the range) and ``near``, whether
    the fit began near another law; sorted by states.
    """
    rows = []
    for calibration in known:
        row, training = (
            calibration.error.get("free_bending_angle_rad"),
            calibration.provenance.get("training"),
        )
        if isinstance(row, dict) and isinstance(training, dict) and calibration.layout.psi is not None:
            rows.append(
                {
                    "states": training["states"],
                    "free_bending_percent": round(100.0 * row["p95"] / row["range"], 2),
                    "near": "near_sha256" in calibration.provenance,
                }
            )
    return sorted(rows, key=lambda row: int(row["states"]))
