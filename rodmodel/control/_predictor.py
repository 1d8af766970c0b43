"""Predictor of a rod for control loops: NumPy arrays in and out, warm starts, microseconds a call."""

import warnings
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from rodmodel.control._of_rod import core_of
from rodmodel.core import INPUT, JACOBIAN, SOLUTION, CoreRod, Numbers, checked_steps, ffi, lib

# Attribute look-ups would count beside a call of microseconds.
from_buffer, NULL, asarray, make = ffi.from_buffer, ffi.NULL, np.asarray, tuple.__new__
_DOUBLE, _THREE, _TRUTH = np.dtype(np.float64), (3,), (np.False_, np.True_)
# Columns of the Jacobian by the pressures, and by the tip force.
_INPUTS = slice(3), slice(3, 6)
_LOADS = ("tip_force", "tip_moment", "gravity", "distributed_force")


class Prediction(NamedTuple):
    """Pose in the frame of the base, as NumPy arrays; inputs with a leading axis give arrays with one."""

    tip_position: np.ndarray
    """Centre of the cap's outer face [m]."""
    tip_rotation: np.ndarray
    """Frame of the cap, directors as columns."""
    bending_angle: Any
    """θ [rad]."""
    bending_plane: Any
    """γ [rad]; 0 for a straight rod, where it is undefined."""
    converged: Any
    stable: Any
    in_domain: Any
    """Whether the pressures, and the moments everywhere on the body, are in the calibrated domain."""
    error_estimate: Any
    """Bound of the error of θ that 90 % of states keep, at these inputs [rad]; NaN outside the domain."""
    tip_error_estimate: Any
    """Likewise of the tip's distance from where it is [m]; NaN also where none is known."""


class TipJacobian(NamedTuple):
    """Derivatives of the tip in the frame of the base: (3, 3) arrays, (2, 3) for the bend."""

    position_by_pressure: np.ndarray
    """[m/Pa]"""
    turn_by_pressure: np.ndarray
    """Small turn of the cap, δR = (turn × R) [rad/Pa]."""
    position_by_force: np.ndarray
    """[m/N]"""
    turn_by_force: np.ndarray
    """[rad/N]"""
    bend_by_pressure: np.ndarray
    """Derivative of (θ cos γ, θ sin γ), which is smooth where the rod is straight [rad/Pa]."""
    bend_by_force: np.ndarray
    """[rad/N]"""


class Predictor:
    """Solver of one rod for a control loop, with everything prepared that stays the same between calls.

    `rodmodel.Rod.predictor` makes one, or `Predictor(rodmodel.load_core(...))`. Calls may come from several
    threads; a single call starts from the solution of the last call that ended, on whichever thread.

    Parameters
    ----------
    rod : rod to solve, compiled or differentiable.
    loads : names of the loads that every call gives, among `tip_force`, `tip_moment`, `gravity`,
        `distributed_force`.
    solver : `rodmodel.FixedStep` with steps and tolerance, which replace the next two.
    steps : number of steps along the rod; the tip's error falls with their fourth power.
    tolerance : tolerance of Newton's method on u L at the base [rad].
    threads : number of threads that share a batch.
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
                f"{', '.join(old)}: nothing is compiled any more; threads sets how many share a batch",
                DeprecationWarning,
                stacklevel=2,
            )
        if solver is not None:
            steps, tolerance = solver.steps, tolerance if solver.tolerance is None else solver.tolerance
        steps = checked_steps(steps)
        self.rod = rod
        self.loads = tuple(loads)
        self._core = core_of(rod)
        self._threads = threads
        self._steps, self._tolerance = steps, tolerance
        self._options = self._core.options(steps, volumes=False, tolerance=tolerance)
        handle = self._core.handle
        self._call, self._call_with_jacobian = handle.call.rm_solve, handle.call.rm_solve_with_jacobian
        self._handle = handle.rod
        self._names = set(self.loads)
        self._free_buffers = [_Buffers(self._core, self.loads, self._steps)]

    def reset(self) -> None:
        """Forget the last solution: the next single call starts cold."""
        for buffers in self._free_buffers:
            buffers.start = NULL

    def __call__(self, pressure: Numbers, **loads: Numbers) -> Prediction:
        """Predict the pose.

        A single call starts from the solution of the last one, and cold if that leads to no stable
        equilibrium. Batches start cold.

        Parameters
        ----------
        pressure : gauge pressures [Pa], (3,) or (rows, 3).
        loads : loads named at construction, (3,) or (rows, 3), in the frame of the base: force [N], moment
            [N m], acceleration [m/s²], force per length [N/m].

        Returns
        -------
        prediction : pose and flags. Rows without a solution have `converged` false; a NaN among the inputs
            gives NaN.
        """
        free = self._free_buffers
        buffers = free.pop() if free else _Buffers(self._core, self.loads, self._steps)
        try:
            if not self._fill(buffers, pressure, loads):
                return self._batch(pressure, loads)
            self._call(
                self._handle,
                buffers.input,
                self._options,
                buffers.start,
                buffers.workspace,
                NULL,
                buffers.solution,
            )
            return buffers.prediction()
        finally:
            free.append(buffers)

    def jacobian(self, pressure: Numbers, **loads: Numbers) -> tuple[Prediction, TipJacobian]:
        """Predict, and differentiate the tip by pressures and tip force; single calls only."""
        free = self._free_buffers
        buffers = free.pop() if free else _Buffers(self._core, self.loads, self._steps)
        try:
            if not self._fill(buffers, pressure, loads):
                raise ValueError("pressure, loads: got rows, expected (3,) each")
            self._call_with_jacobian(
                self._handle,
                buffers.input,
                self._options,
                buffers.start,
                buffers.workspace,
                NULL,
                buffers.solution,
                buffers.jacobian,
                0,
                NULL,
                NULL,
                NULL,
            )
            return buffers.prediction(), buffers.derivatives()
        finally:
            free.append(buffers)

    def _fill(self, buffers: "_Buffers", pressure: Numbers, loads: dict[str, Numbers]) -> bool:
        """Copy the input of a single call into the buffers; return false if an argument has rows."""
        if loads.keys() != self._names:
            raise ValueError(f"loads: got {sorted(loads)}, expected {sorted(self.loads)}")
        given = asarray(pressure, _DOUBLE)
        if given.shape != _THREE:
            return _refuse_other_than_rows("pressure", given)
        buffers.pressure[...] = given
        for name, field in buffers.load_fields:
            given = asarray(loads[name], _DOUBLE)
            if given.shape != _THREE:
                return _refuse_other_than_rows(name, given)
            field[...] = given
        return True

    def _batch(self, pressure: Numbers, loads: dict[str, Any]) -> Prediction:
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
            found["angle_error"],
            found["tip_error"],
        )


class _Buffers:
    """Input, solution and workspace of one call at a time, and the warm start that the last one left."""

    def __init__(self, core: CoreRod, loads: Sequence[str], steps: int) -> None:
        row, found = np.zeros(1, INPUT), np.zeros(1, SOLUTION)
        row["given"] = lib.RM_LOADS if loads else 0
        self.pressure = row["pressure"][0]
        self.load_fields = [(name, row[name][0]) for name in loads]
        self.input, self.solution = from_buffer("rm_input *", row), from_buffer("rm_solution *", found)
        self.workspace = core.handle.workspace(steps, with_jacobian=True)
        self.start: Any = NULL
        self._unknown = self.solution.unknown
        self._position, self._rotation = found["tip_position"][0], found["tip_rotation"][0]
        self._numbers = found.view(np.float64)
        self._angle, self._plane = (_index_of(SOLUTION, name) for name in ("bending_angle", "bending_plane"))
        self._bound, self._tip_bound = (_index_of(SOLUTION, name) for name in ("angle_error", "tip_error"))
        changes = np.zeros(1, JACOBIAN)
        self.jacobian = from_buffer("rm_jacobian *", changes)
        position, turn, bend = (changes[name].reshape(-1, 12) for name in ("position", "turn", "bend"))
        parts = [rows[:, part] for part in _INPUTS for rows in (position, turn)]
        parts += [bend[:, part] for part in _INPUTS]
        self._copies = [rows.copy for rows in parts]

    def prediction(self) -> Prediction:
        """Return the prediction of the core's last solution."""
        solution = self.solution
        good = solution.result == 0
        # The start points into the solution: the core reads it before it writes there.
        self.start = self._unknown if good else NULL
        numbers = self._numbers
        return make(
            Prediction,
            (
                self._position.copy(),
                self._rotation.copy(),
                numbers[self._angle],
                numbers[self._plane],
                _TRUTH[good],
                _TRUTH[solution.stable],
                _TRUTH[solution.in_domain],
                numbers[self._bound],
                numbers[self._tip_bound],
            ),
        )

    def derivatives(self) -> TipJacobian:
        """Return the tip's derivatives of the core's last solution with a Jacobian."""
        return make(TipJacobian, [copy() for copy in self._copies])


def _refuse_other_than_rows(name: str, given: np.ndarray) -> bool:
    """Return false for an argument that has rows; raise a ValueError for another shape."""
    if given.ndim != 2 or given.shape[1] != 3:
        raise ValueError(f"{name}: got shape {given.shape}, expected (3,) or (rows, 3)")
    return False


def _index_of(record: np.dtype, name: str) -> int:
    """Return the index of a field in a record seen as an array of doubles."""
    assert record.fields is not None
    return int(record.fields[name][1]) // 8
