"""Stage 3: runs of the full actuator in parallel processes, some for its ends and others to judge the rod."""

from collections.abc import Collection, Sequence
from pathlib import Path
from typing import Literal

import numpy as np
import xarray as xr
from jaxtyping import Float

from calibration.from_design.stage_record import StageError, key_of
from calibration.from_design.task import Level, Task
from calibration.processes import Job, JobError, run_jobs
from calibration.progress import progress_bar
from calibration.sweep import edge
from calibration.truth import TruthCase, TruthError, gather, trace
from fem_reference import (
    ActuatorError,
    ActuatorLoad,
    Design,
    RunError,
    design_text,
    level_record,
)
from rodmodel import Domain
from rodmodel.io import write_atomically

# Pressures of fit and judge runs, as shares of the domain's. No load has both roles.
_FIT, _JUDGE = (0.25, 0.5, 0.75, 0.95), (0.2, 0.45, 0.7, 0.92)
_Run = tuple[str, Literal["fit", "judge"], tuple[float, float, float]]
# Names, roles and directions of runs: of chambers that are alike, of others, and more of them.
_IN_PLANE: tuple[_Run, ...] = (
    ("chambers23", "fit", (0.0, 1.0, 1.0)),
    ("chamber1", "fit", (1.0, 0.0, 0.0)),
    ("chambers23", "judge", (0.0, 1.0, 1.0)),
    ("chamber1", "judge", (1.0, 0.0, 0.0)),
)
_DIFFERENT: tuple[_Run, ...] = (
    ("chambers12", "fit", (1.0, 1.0, 0.0)),
    ("chamber1", "fit", (1.0, 0.0, 0.0)),
    ("chambers23", "judge", (0.0, 1.0, 1.0)),
    ("chamber2", "judge", (0.0, 1.0, 0.0)),
)
_FURTHER: tuple[_Run, ...] = (
    ("chamber2", "fit", (0.0, 1.0, 0.0)),
    ("chambers31", "judge", (1.0, 0.0, 1.0)),
)
_MIXTURES: tuple[_Run, ...] = (
    ("mixture", "fit", (1.0, 0.5, 0.2)),
    ("mixture", "judge", (0.3, 1.0, 0.6)),
)
# Largest share of the budget that the runs take, and a time that they have in any case [s]. Those that are
# not done by then end early.
_SHARE, _ALWAYS = 0.4, 480.0


def cases_for(task: Task, domain: Domain) -> tuple[TruthCase, ...]:
    """Return the runs: one chamber and two for the ends, and others of both kinds that judge the rod.

    Runs in the plane of symmetry keep it, where the body has one: they have half the unknowns. Where all
    chambers are alike, all runs lie in it, and fit and judge runs differ by their loads.
    """
    design = task.design
    # The ends first: without them a judge tells little.
    if design.symmetry == "full":
        runs = [*_IN_PLANE, *(_MIXTURES if task.budget.converged else ())]
    else:
        runs = [*_DIFFERENT, *((*_FURTHER, *_MIXTURES) if task.budget.converged else ())]
    cases = []
    for name, role, way in runs:
        largest = edge(domain, np.array(way))
        shares = _FIT if role == "fit" else _JUDGE
        loads = tuple(_load(share * largest) for share in shares)
        symmetric = design.mirror_in_place and way[1] == way[2]
        cases.append(TruthCase(f"{role}-{name}", role, design.winding, loads, symmetric))
    return tuple(cases)


def _load(pressure: Float[np.ndarray, "3"]) -> ActuatorLoad:
    first, second, third = pressure.tolist()
    return ActuatorLoad((first, second, third))


def time_limit(task: Task) -> float:
    """Return the time after which the runs end [s]."""
    return max(_SHARE * task.budget.seconds, _ALWAYS)


def run_actuators(task: Task, cases: Sequence[TruthCase]) -> tuple[xr.Dataset, dict[str, str]]:
    """Run or resume the cases, and gather their states.

    Parameters
    ----------
    task : calibration to make.
    cases : runs of its actuator.

    Returns
    -------
    runs : as `calibration.truth.gather` gives them.
    failed : by case, why its path ended early.

    Raises
    ------
    StageError
        If no run has a state, or a process dies.
    """
    level = task.levels.actuator
    loads = [[list(load.pressure) for load in case.loads] for case in cases]
    inputs = {"design": design_text(task.design), "mesh": level_record(level), "loads": loads}
    directory = task.directory / f"actuator-{key_of(inputs)}"
    limit = time_limit(task)
    pending = [case for case in cases if not _is_over(directory, case, limit)]
    if pending:
        _trace_all(task, pending, directory, level, limit)
    failed = {case.name: file.read_text() for case in cases if (file := _failure(directory, case)).exists()}
    for case in cases:
        if case.name not in failed and _states(directory, [case]) < len(case.loads):
            failed[case.name] = f"there was no more time after {limit:.0f} s"
    try:
        return gather(directory, cases, task.design), failed
    except TruthError as error:
        why = "; ".join(f"{name}: {reason}" for name, reason in failed.items())
        raise StageError(f"actuator runs: {why or error}") from error


def _trace_all(task: Task, pending: Sequence[TruthCase], directory: Path, level: Level, limit: float) -> None:
    """Trace cases in processes until they are done, or a time is over [s]."""
    directory.mkdir(parents=True, exist_ok=True)
    jobs = [Job(case.name, _trace, (case, directory, level, task.command, task.design)) for case in pending]
    counted = _states(directory, pending)
    with progress_bar(sum(len(case.loads) for case in pending), "states") as advance:
        advance(counted, "actuator")

        def watch(names: Collection[str]) -> None:
            nonlocal counted
            now = _states(directory, pending)
            advance(now - counted, ", ".join(names))
            counted = now

        try:
            late = run_jobs(jobs, task.workers, watch, limit)
        except JobError as error:
            raise StageError(
                f"actuator runs: {error}; its states are in {directory}, run again to resume"
            ) from error
    for case in pending:
        if case.name in late:
            write_atomically(_out_of_time(directory, case), f"{limit}")


def _trace(case: TruthCase, directory: Path, level: Level, command: str, design: Design) -> None:
    """Trace one case in a process; its states are on file, and why it ended early."""
    try:
        for _ in trace(case, directory, level, command, design):
            pass
    except ActuatorError as error:
        write_atomically(_failure(directory, case), f"{error}")
    except RunError as error:
        raise SystemExit(f"actuator runs: {error}") from error


def _failure(directory: Path, case: TruthCase) -> Path:
    return directory / f"{case.name}.failed.txt"


def _out_of_time(directory: Path, case: TruthCase) -> Path:
    """File with the time after which a run was ended [s]: only a longer one goes on with it."""
    return directory / f"{case.name}.time.txt"


def _states(directory: Path, cases: Sequence[TruthCase]) -> int:
    return sum(len(list((directory / case.name).glob("step_*.json"))) for case in cases)


def _is_over(directory: Path, case: TruthCase, limit: float) -> bool:
    """Whether a run has all its states, or ended early: by itself, or after that much time [s] or more."""
    late = _out_of_time(directory, case)
    if late.exists() and float(late.read_text()) >= limit:
        return True
    return _failure(directory, case).exists() or _states(directory, [case]) >= len(case.loads)
