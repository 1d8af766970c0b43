"""One hard case: solving it, and comparing its outcome with the recorded one."""

import math
import time
from collections.abc import Callable, Iterator
from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np

from fem_reference import (
    Actuator,
    ActuatorError,
    ActuatorLoad,
    ActuatorState,
    CellError,
    CellState,
    Load,
    PeriodCell,
    follow,
)
from fem_reference.algebra import SymmetricSolver, default_solver
from fem_reference.solver import SolverOptions

#: Changes that are marked: of counts, as a share, and of the angle, relative.
COUNTS, ANGLE = 0.2, 1e-6


class CountingSolver:
    """A linear solver that counts its factorisations, those of steps in vain included."""

    def __init__(self, solver: SymmetricSolver) -> None:
        self._solver = solver
        self.factors = solver.factors
        self.factorisations = 0

    def factorise(self, upper: Any, revision: int) -> int | None:
        """See `SymmetricSolver`."""
        self.factorisations += 1
        negative = self._solver.factorise(upper, revision)
        self.factors = self._solver.factors
        return negative

    def solve(self, right: np.ndarray) -> np.ndarray:
        """See `SymmetricSolver`."""
        return self._solver.solve(right)


@dataclass(frozen=True)
class Outcome:
    """What became of a case.

    Parameters
    ----------
    outcome : ``reached``; ``unstable`` if the last load was reached at a saddle, or a path that was to end
        at an instability did; ``gave up``.
    angle_deg : of the last state, over 60 mm for a cell.
    jumps : loads on whose way the body jumped.
    iterations : of Newton's method, those of steps in vain left out.
    factorisations : all of them.
    seconds : of processor time.
    """

    outcome: str
    angle_deg: float
    jumps: int
    iterations: int
    factorisations: int
    seconds: float

    def changes(self, recorded: "Outcome") -> list[str]:
        """Names of what differs from the ``recorded`` outcome; seconds are never compared."""
        changed = [name for name in ("outcome", "jumps") if getattr(self, name) != getattr(recorded, name)]
        for name in ("iterations", "factorisations"):
            before = getattr(recorded, name)
            if abs(getattr(self, name) - before) > COUNTS * before:
                changed.append(name)
        if abs(self.angle_deg - recorded.angle_deg) > ANGLE * abs(recorded.angle_deg):
            changed.append("angle_deg")
        return changed

    def record(self) -> dict[str, Any]:
        """For JSON, with the seconds rounded."""
        return asdict(replace(self, seconds=round(self.seconds, 1)))


@dataclass(frozen=True)
class Case:
    """A body on a path of loads.

    Parameters
    ----------
    why : what makes the path hard.
    build : the body, from a linear solver and the options of the solvers.
    loads : in order.
    jumps : whether a cell's path goes on where walls lose their balance.
    single : whether factors are of single precision, as the cell's are.
    """

    why: str
    build: Callable[[SymmetricSolver, SolverOptions], PeriodCell | Actuator]
    loads: tuple[Load | ActuatorLoad, ...]
    jumps: bool = True
    single: bool = True

    def solve(self, options: SolverOptions) -> Outcome:
        """Follow the path as far as it goes."""
        begun = time.process_time()
        solver = CountingSolver(default_solver(definite=True, single=self.single))
        body = self.build(solver, options)
        states: list[CellState | ActuatorState] = []
        last, outcome = None, "reached"
        try:
            for last in self._states(body):
                states.append(last)
            if not _stable(last):
                outcome = "unstable"
        except (CellError, ActuatorError) as error:
            last = error.last_good
            outcome = "unstable" if getattr(error, "unstable", False) else "gave up"
        return Outcome(
            outcome=outcome,
            angle_deg=0.0 if last is None else _angle_deg(last),
            jumps=sum(_jumped(state) for state in states),
            iterations=sum(_iterations(state) for state in states),
            factorisations=solver.factorisations,
            seconds=time.process_time() - begun,
        )

    def _states(self, body: PeriodCell | Actuator) -> Iterator[CellState | ActuatorState]:
        if isinstance(body, Actuator):
            return body.follow([load for load in self.loads if isinstance(load, ActuatorLoad)])
        return follow(body, [load for load in self.loads if isinstance(load, Load)], jumps=self.jumps)


def _stable(state: CellState | ActuatorState | None) -> bool:
    if isinstance(state, ActuatorState):
        return state.settled.stable is not False
    return state is not None and state.stable is not False


def _jumped(state: CellState | ActuatorState) -> bool:
    return state.settled.jumped if isinstance(state, ActuatorState) else state.jumped


def _iterations(state: CellState | ActuatorState) -> int:
    return state.settled.iterations if isinstance(state, ActuatorState) else state.iterations


def _angle_deg(state: CellState | ActuatorState) -> float:
    if isinstance(state, ActuatorState):
        return math.degrees(state.bending_angle)
    return math.degrees(state.bending(60e-3)[0])
