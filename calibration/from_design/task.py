"""What a calibration is made of: a design, a budget of time, and the meshes that it allows."""

import re
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from fem_reference import Design, MeshLevel, converged_level, mesh_level

Level = str | MeshLevel


def level_title(level: Level) -> str:
    """Return the name of a mesh level, or that it has counts of its own."""
    return level if isinstance(level, str) else "a mesh of its own counts"


_UNITS = {"s": 1.0, "min": 60.0, "h": 3600.0}
# From these budgets on, the cell may have the mesh near its limit and the actuator has more runs, and these
# have thinner layers [s].
_CONVERGED, _THOROUGH = 3600.0, 4 * 3600.0
# Shortest budget: the runs of the actuator take longer than any shorter one [s].
_LEAST = 60.0


@dataclass(frozen=True)
class Budget:
    """Time for a calibration on this machine [s], which chooses meshes, paths and runs.

    Raises
    ------
    ValueError
        For less than a minute.
    """

    seconds: float

    def __post_init__(self) -> None:
        if not _LEAST <= self.seconds < float("inf"):
            raise ValueError(f"budget: got {self.seconds:g} s, expected at least {_LEAST:g} s")

    @classmethod
    def parse(cls, text: str) -> "Budget":
        """Return the budget of a text such as 20min, 1h or 8h."""
        found = re.fullmatch(r"(\d+(?:\.\d+)?)(s|min|h)", text)
        if found is None:
            raise ValueError(f"budget: got {text!r}, expected a time such as 20min, 1h or 8h")
        return cls(float(found.group(1)) * _UNITS[found.group(2)])

    @property
    def converged(self) -> bool:
        """Whether there is time for the mesh on which the cell is near its limit, and for more runs."""
        return self.seconds >= _CONVERGED

    @property
    def thorough(self) -> bool:
        """Whether there is time for runs of the full actuator on a finer mesh."""
        return self.seconds >= _THOROUGH


@dataclass(frozen=True)
class Meshes:
    """Mesh levels of a calibration.

    Parameters
    ----------
    first : of the cells that find the range of pressures.
    sweep : of the cells that the law is fitted to.
    finer : of those that tell the sweep's discretisation error.
    actuator : of the full actuator.
    cheaper : of the sweep, in the place of its own, if angles on it are close enough to those on the finer
        one; None if it is not to be tried.
    """

    first: Level
    sweep: Level
    finer: Level
    actuator: Level
    cheaper: Level | None = None

    @classmethod
    def of(cls, budget: Budget, design: Design) -> "Meshes":
        """Return the levels that a budget allows."""
        best = converged_level(design.winding)
        if not budget.converged:
            return cls("coarse", "coarse", best if best != "coarse" else "fine", "coarse")
        level = mesh_level(best)
        finer: Level = "finer" if best == "fine" else replace(level, axial_size=0.75 * level.axial_size)
        if budget.thorough:
            return cls("coarse", best, finer, "layered")
        # Five times as many states are worth more to a law than a percent of the angle.
        return cls("coarse", best, finer, "coarse", None if best == "coarse" else "coarse")


@dataclass(frozen=True)
class Task:
    """A calibration to make.

    Parameters
    ----------
    design : actuator.
    budget : time for it.
    directory : of its files.
    command : command that repeats it, for the provenance.
    angle : bending angle over the body's length at which the range of pressures ends [rad].
    workers : processes on this machine, of one thread each.
    scheduler : address of a dask scheduler for the sweep, or None.
    meshes : by default those of the budget.
    """

    design: Design
    budget: Budget
    directory: Path
    command: str
    angle: float = np.pi
    workers: int = 2
    scheduler: str | None = None
    meshes: Meshes | None = None

    @property
    def levels(self) -> Meshes:
        """Mesh levels."""
        return self.meshes or Meshes.of(self.budget, self.design)
