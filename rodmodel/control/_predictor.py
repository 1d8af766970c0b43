"""The rod for a control loop: NumPy in and out, warm starts, microseconds."""

import warnings
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from rodmodel.control._of_rod import core_of
from rodmodel.core import INPUT, JACOBIAN, SOLUTION, Numbers, ffi, lib

from_buffer, NULL = ffi.from_buffer, ffi.NULL
_SOLUTION_SIZE, _JACOBIAN_SIZE = SOLUTION.itemsize // 8, JACOBIAN.itemsize // 8
_LOADS = ("tip_force", "tip_moment", "gravity", "distributed_force")


class Prediction(NamedTuple):
    """Pose in the frame of the base, as NumPy arrays; with a leading axis where the inputs had one."""

    tip_position: np.ndarray
    """Centre of the cap's outer face [m]."""
    tip_rotation: np.ndarray
    """Frame of the cap, directors as columns."""
    bending_angle: Any
    """θ [rad]."""
    bending_plane: Any
    """γ [rad]; 0 of a straight rod, which has none."""
    converged: Any
    stable: Any
    in_domain: Any
    """Whether the pressures, and the moments everywhere on the body, are those of the calibration."""


class TipJacobian(NamedTuple):
    """Derivatives of the tip in the frame of the base; (3, 3) arrays, (2, 3) of the bend."""

    position_by_pressure: np.ndarray
    """[m/Pa]"""
    turn_by_pressure: np.ndarray
    """Small turn of the cap, δR = (turn × R) [rad/Pa]."""
    position_by_force: np.ndarray
    """[m/N]"""
    turn_by_force: np.ndarray
    """[rad/N]"""
    bend_by_pressure: np.ndarray
    """Of (θ cos γ, θ sin γ), which is smooth where the rod is straight [rad/Pa]."""
    bend_by_force: np.ndarray
    """[rad/N]"""


class Predictor:
    """Solve of one rod for a control loop: what does not change from call to call is prepared once.

    Made by `rodmodel.Rod.predictor`, or of a rod from `rodmodel.load_core`. Calls may come from several
    threads; a single call starts from the solution of the last one to end, whichever thread that was.

    Parameters
    ----------
    rod : to be solved, compiled or differentiable.
    loads : which loads the calls give, of `tip_force`, `tip_moment`, `gravity`, `distributed_force`.
    solver : `rodmodel.FixedStep`, whose steps and tolerance are taken in place of the next two.
    steps : along the rod; the tip's error falls with their fourth power.
    tolerance : of Newton's method on u L at the base [rad].
    threads : over which batches are spread.
    """

    def __init__(
        self,
        rod: Any,
        loads: Sequence[str] = (),
        solver: Any = None,
        *,
        steps: int = 8,
        tolerance: float = 1e-7,
        threads: int = 1,
        **old: Any,
    ) -> None:
        unknown = [name for name in loads if name not in _LOADS]
        if unknown:
            raise ValueError(f"loads: got {unknown[0]!r}, expected any of {', '.join(_LOADS)}")
        if set(old) - {"batch", "devices"}:
            raise TypeError(f"Predictor: got {', '.join(old)}, expected solver, steps, tolerance or threads")
        if old:
            warnings.warn(
                f"{', '.join(old)}: nothing is compiled any more, and threads says how batches are spread",
                DeprecationWarning,
                stacklevel=2,
            )
        if solver is not None:
            steps, tolerance = solver.steps, tolerance if solver.tolerance is None else solver.tolerance
        if steps < 1:
            raise ValueError(f"steps: got {steps}, expected 1 or more")
        self.rod = rod
        self.loads = tuple(loads)
        self._core = core_of(rod)
        self._threads = threads
        self._steps, self._tolerance = steps, tolerance
        self._options = self._core.options(steps, volumes=False, tolerance=tolerance)
        handle = self._core.handle
        self._solve, self._differentiate, self._rod = (
            handle.call.rm_solve,
            handle.call.rm_solve_with_jacobian,
            handle.rod,
        )
        self._room = [handle.call.rm_workspace_size(handle.rod, steps, jacobian) for jacobian in (0, 1)]
        template = np.zeros(1, INPUT)
        template["given"] = lib.RM_LOADS if loads else 0
        self._template = template.view(np.float64)
        self._places = [(name, _first_of(INPUT, name)) for name in self.loads]
        self._names = set(self.loads)
        self._warm: Any = None

    def reset(self) -> None:
        """Forget the last solution: the next single call starts cold."""
        self._warm = None

    def __call__(self, pressure: Numbers, **loads: Numbers) -> Prediction:
        """Predict.

        A single call starts from the last one's solution; where that leads to none that is stable, and in
        batches, the start is cold.

        Parameters
        ----------
        pressure : gauge pressures [Pa], (3,) or (rows, 3).
        loads : those named at construction, (3,) or (rows, 3), in the frame of the base: force [N], moment
            [N m], acceleration [m/s²], force per length [N/m].

        Returns
        -------
        prediction : rows that cannot be solved are not converged; NaN goes in, NaN comes out.
        """
        row = self._row(pressure, loads)
        if row is None:
            return self._batch(pressure, loads)
        found = np.empty(_SOLUTION_SIZE)
        at = from_buffer("rm_solution *", found)
        self._solve(
            self._rod,
            from_buffer("rm_input *", row),
            self._options,
            NULL if self._warm is None else self._warm[1],
            from_buffer("rm_real *", np.empty(self._room[0])),
            NULL,
            at,
        )
        return self._prediction(found, at)

    def jacobian(self, pressure: Numbers, **loads: Numbers) -> tuple[Prediction, TipJacobian]:
        """Predict, and differentiate the tip by pressures and tip force; single calls only."""
        row = self._row(pressure, loads)
        if row is None:
            raise ValueError("pressure, loads: got rows, expected (3,) each")
        found, derivatives = np.empty(_SOLUTION_SIZE), np.empty(_JACOBIAN_SIZE)
        at = from_buffer("rm_solution *", found)
        self._differentiate(
            self._rod,
            from_buffer("rm_input *", row),
            self._options,
            NULL if self._warm is None else self._warm[1],
            from_buffer("rm_real *", np.empty(self._room[1])),
            NULL,
            at,
            from_buffer("rm_jacobian *", derivatives),
            0,
            NULL,
            NULL,
            NULL,
        )
        position, turn = derivatives[:36].reshape(3, 12), derivatives[36:72].reshape(3, 12)
        bend = derivatives[72:96].reshape(2, 12)
        jacobian = TipJacobian(
            position[:, :3], turn[:, :3], position[:, 3:6], turn[:, 3:6], bend[:, :3], bend[:, 3:6]
        )
        return self._prediction(found, at), jacobian

    def _row(self, pressure: Numbers, loads: dict[str, Numbers]) -> np.ndarray | None:
        """Input of a single call; None where an argument has rows."""
        if loads.keys() != self._names:
            raise ValueError(f"loads: got {sorted(loads)}, expected {sorted(self.loads)}")
        row = self._template.copy()
        given = np.asarray(pressure, np.float64)
        if given.shape != (3,):
            return self._checked("pressure", given)
        row[:3] = given
        for name, first in self._places:
            given = np.asarray(loads[name], np.float64)
            if given.shape != (3,):
                return self._checked(name, given)
            row[first : first + 3] = given
        return row

    def _checked(self, name: str, given: np.ndarray) -> None:
        if given.ndim != 2 or given.shape[1] != 3:
            raise ValueError(f"{name}: got shape {given.shape}, expected (3,) or (rows, 3)")

    def _prediction(self, found: np.ndarray, at: Any) -> Prediction:
        good = at.result == 0
        # The solution's numbers live as long as this start of the next solve.
        self._warm = (at, at.unknown) if good else None
        return Prediction(
            found[0:3],
            found[3:12].reshape(3, 3),
            found[14],
            found[15],
            np.bool_(good),
            np.bool_(at.stable),
            np.bool_(at.in_domain),
        )

    def _batch(self, pressure: Numbers, loads: dict[str, Numbers]) -> Prediction:
        found = self._core.solve_many(
            steps=self._steps, tolerance=self._tolerance, threads=self._threads, pressure=pressure, **loads
        )
        return Prediction(
            found["tip_position"],
            found["tip_rotation"],
            found["bending_angle"],
            found["bending_plane"],
            found["result"] == 0,
            found["stable"] != 0,
            found["in_domain"] != 0,
        )


def _first_of(record: np.dtype, name: str) -> int:
    """Place of a field in a record, in numbers."""
    assert record.fields is not None
    return int(record.fields[name][1]) // 8
