"""Stage 2: the mesh of the sweep, and how far its angles are from those of other meshes.

One chamber, and two, bend the cell on the mesh of the sweep, on a finer one, and on that of the actuator. A
cheaper mesh is the sweep's if its angles are within 1.5 % of those on the finer one.
"""

import math
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from calibration.from_design.task import Level, Meshes, level_title
from calibration.progress import progress_bar
from fem_reference import CellError, Design, Load, PeriodCell, follow, level_record
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


def check_meshes(design: Design, domain: Domain, meshes: Meshes, compliance: float) -> MeshCheck:
    """Compare the angles of a cell on the meshes of a calibration.

    Parameters
    ----------
    design, domain : actuator and its range of pressures.
    meshes : mesh levels.
    compliance : of the ends [m/N].
    """
    pressures = check_pressures(domain)
    known: dict[str, tuple[tuple[float, ...], float]] = {}

    def on(level: Level) -> tuple[tuple[float, ...], float]:
        name = str(level_record(level))
        if name not in known:
            known[name] = _angles(design, level, compliance, pressures)
        return known[name]

    with progress_bar(3, "meshes") as advance:

        def shown(level: Level) -> tuple[tuple[float, ...], float]:
            advance(0, level_title(level))
            found = on(level)
            advance(1, level_title(level))
            return found

        actuator, _ = shown(meshes.actuator)
        finer, _ = shown(meshes.finer)
        level, cheaper = meshes.sweep, False
        if meshes.cheaper is not None and is_close(on(meshes.cheaper)[0], finer):
            level, cheaper = meshes.cheaper, True
        sweep, seconds = shown(level)
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


def _angles(
    design: Design, level: Level, compliance: float, pressures: Sequence[tuple[float, float, float]]
) -> tuple[tuple[float, ...], float]:
    """Return the angles at some pressures, and the median time of a state."""
    angles, seconds = [], []
    try:
        cell = PeriodCell.of(design, level, compliance)
    except ValueError:
        # No mesh of these counts.
        return (math.nan,) * len(pressures), math.nan
    for pressure in pressures:
        bend, clock = math.nan, time.monotonic()
        try:
            for state in follow(cell, [_part(pressure, n / _STEPS) for n in range(1, _STEPS + 1)]):
                seconds.append(time.monotonic() - clock)
                clock, bend = time.monotonic(), float(np.hypot(*state.curvature[:2]))
        except CellError:
            bend = math.nan
        angles.append(design.geometry.body_length * bend)
    return tuple(angles), float(np.median(seconds or [math.nan]))


def _part(pressure: tuple[float, float, float], share: float) -> Load:
    first, second, third = (share * p for p in pressure)
    return Load((first, second, third))
