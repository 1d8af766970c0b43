"""Stage 2: the mesh of the sweep, and how far its angles are from those of other meshes.

One chamber, and two, bend the cell on the mesh of the sweep, on a finer one, and on that of the actuator. A
cheaper mesh is the sweep's if its angles are within 1.5 % of those on the finer one.
"""

import math
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from calibration.from_design.stage_record import StageError, kept, key_of, on_file
from calibration.from_design.task import Level, Task, level_title
from calibration.processes import Job, JobError, run_jobs
from calibration.progress import progress_bar
from fem_reference import CellError, Design, Load, PeriodCell, design_text, follow, level_record
from rodmodel import Domain

# Share of the range of pressures at which meshes are compared.
_SHARE = 0.75
# Largest error of a cheaper mesh that is taken.
_CLOSE = 0.015
# Loads on the way to it, so that their time is one of a state of the sweep.
_STEPS = 4


@dataclass(frozen=True)
class MeshCheck:
    """Bending angles of a cell on several meshes.

    Parameters
    ----------
    pressures : of the three chambers, of each load: of one chamber, then of two [Pa].
    sweep, finer, actuator : angles at these loads on each mesh [rad]; NaN where a mesh did not converge.
    seconds : time of a state on the mesh of the sweep [s].
    cheaper : whether the sweep has the cheaper mesh.
    """

    pressures: tuple[tuple[float, float, float], ...]
    sweep: tuple[float, ...]
    finer: tuple[float, ...]
    actuator: tuple[float, ...]
    seconds: float
    cheaper: bool = False

    @classmethod
    def of(cls, record: Mapping[str, Any]) -> "MeshCheck":
        """Return the check of a record of JSON, which has null for NaN."""
        angles = {
            key: tuple(math.nan if a is None else a for a in record[key])
            for key in ("sweep", "finer", "actuator")
        }
        first, second = (tuple(p) for p in record["pressures"])
        return cls((first, second), **angles, seconds=record["seconds"], cheaper=record["cheaper"])

    def record(self) -> dict[str, Any]:
        """Return the check for JSON."""
        angles = {
            key: [None if math.isnan(a) else a for a in getattr(self, key)]
            for key in ("sweep", "finer", "actuator")
        }
        return {
            "pressures": [list(p) for p in self.pressures],
            **angles,
            "seconds": self.seconds,
            "cheaper": self.cheaper,
        }

    def error(self, chambers: int) -> float:
        """Return what the sweep's angles are wrong by, relative to the finer mesh's.

        Parameters
        ----------
        chambers : number of chambers with pressure; with three, the larger of both errors.
        """
        return _of(_errors(self.sweep, self.finer), chambers)

    def ratio(self, chambers: int) -> float:
        """Return the sweep's angle relative to that on the actuator's mesh; with three chambers, the mean."""
        ratios = [own / its for own, its in zip(self.sweep, self.actuator, strict=True)]
        return float(np.mean(ratios)) if chambers > 2 else ratios[chambers - 1]


def _errors(angles: Sequence[float], finer: Sequence[float]) -> list[float]:
    return [abs(own / its - 1.0) for own, its in zip(angles, finer, strict=True)]


def _of(errors: Sequence[float], chambers: int) -> float:
    return float(np.max(errors)) if chambers > 2 else errors[chambers - 1]


def check_meshes(task: Task, domain: Domain, compliance: float) -> MeshCheck:
    """Compare the angles of a cell on the meshes of a calibration.

    Each load on each mesh has a file of its own, and is solved once.

    Parameters
    ----------
    task : calibration to make.
    domain : range of pressures.
    compliance : of the ends [m/N].

    Raises
    ------
    StageError
        If a process dies.
    """
    meshes, pressures = task.levels, check_pressures(domain)

    def on(level: Level) -> tuple[tuple[float, ...], float]:
        records = [_solved(task, level, compliance, pressure) for pressure in pressures]
        angles = (math.nan if record["angle"] is None else record["angle"] for record in records)
        seconds = [second for record in records for second in record["seconds"]]
        return tuple(angles), float(np.median(seconds or [math.nan]))

    first = (meshes.finer, meshes.actuator, meshes.cheaper or meshes.sweep)
    with progress_bar(len(first) + 1, "meshes") as advance:
        _solve_all(task, first, compliance, pressures, advance)
        (finer, _), (actuator, _) = on(meshes.finer), on(meshes.actuator)
        level, cheaper = meshes.sweep, False
        if meshes.cheaper is not None and is_close(on(meshes.cheaper)[0], finer):
            level, cheaper = meshes.cheaper, True
        sweep, seconds = on(level)
        advance(1, level_title(level))
    return MeshCheck(pressures, sweep, finer, actuator, seconds, cheaper)


def is_close(angles: Sequence[float], finer: Sequence[float]) -> bool:
    """Return whether a mesh is near enough to a finer one for a sweep; not if one of them is NaN."""
    return all(error <= _CLOSE for error in _errors(angles, finer))


def check_pressures(domain: Domain) -> tuple[tuple[float, float, float], ...]:
    """Return the pressures of one chamber, and of two alike, at which meshes are compared [Pa]."""
    one = _SHARE * domain.pressure_max[0]
    each = min(domain.pressure_max[1], domain.pressure_max[2], domain.pressure_sum_max / 2.0)
    two = _SHARE * min(each, domain.beside_max / (1.0 + domain.beside_share))
    return (one, 0.0, 0.0), (0.0, two, two)


def _solve_all(
    task: Task,
    levels: Sequence[Level],
    compliance: float,
    pressures: Sequence[tuple[float, float, float]],
    advance: Callable[[int, str], None],
) -> None:
    """Solve loads on meshes in processes, where there are several; their results are on file."""
    jobs = {}
    for level in levels:
        for number, pressure in enumerate(pressures):
            stage, inputs = _stage(task, level, compliance, pressure)
            if on_file(task.directory, stage, inputs) is None:
                title = f"{level_title(level)}, load {number + 1}"
                jobs[stage] = Job(title, _solve, (task, level, compliance, pressure))
    if task.workers > 1 and len(jobs) > 1:
        try:
            run_jobs(list(jobs.values()), task.workers, lambda names: advance(0, "; ".join(names)))
        except JobError as error:
            raise StageError(f"mesh: {error}; run again to resume") from error
    advance(len(levels), "")


def _solve(task: Task, level: Level, compliance: float, pressure: tuple[float, float, float]) -> None:
    _solved(task, level, compliance, pressure)


def _solved(
    task: Task, level: Level, compliance: float, pressure: tuple[float, float, float]
) -> dict[str, Any]:
    """Return the angle at a load, null where the cell does not converge, and the times of states."""
    stage, inputs = _stage(task, level, compliance, pressure)
    return kept(task.directory, stage, inputs, lambda: _angle_at(task.design, level, compliance, pressure))


def _stage(
    task: Task, level: Level, compliance: float, pressure: tuple[float, float, float]
) -> tuple[str, dict[str, Any]]:
    """Return the name of a load's file, and what its angle depends on."""
    inputs = {
        "design": design_text(task.design),
        "mesh": level_record(level),
        "end_compliance": compliance,
        "pressure": list(pressure),
    }
    return f"mesh-{key_of(inputs)}", inputs


def _angle_at(
    design: Design, level: Level, compliance: float, pressure: tuple[float, float, float]
) -> dict[str, Any]:
    seconds: list[float] = []
    bend: float | None = None
    try:
        cell = PeriodCell.of(design, level, compliance)
        clock = time.monotonic()
        for state in follow(cell, [_part(pressure, n / _STEPS) for n in range(1, _STEPS + 1)]):
            seconds.append(time.monotonic() - clock)
            clock, bend = time.monotonic(), state.bending(design.geometry.body_length)[0]
    except (ValueError, CellError):
        # There is no mesh of these counts, or the cell gives way.
        bend = None
    return {"angle": bend, "seconds": seconds}


def _part(pressure: tuple[float, float, float], share: float) -> Load:
    first, second, third = (share * p for p in pressure)
    return Load((first, second, third))
