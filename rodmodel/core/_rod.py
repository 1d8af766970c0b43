"""The compiled rod: solves, derivatives and batches, NumPy arrays in and out."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, final

import numpy as np
from numpy.typing import ArrayLike

from rodmodel.actuator import Actuator, Domain
from rodmodel.core._handle import Handle
from rodmodel.core._inputs import row_of, rows_of
from rodmodel.core._law_data import law_data, linear_law_data
from rodmodel.core._native import ffi, lib
from rodmodel.core._solution import CoreSolution, Result
from rodmodel.core._structs import JACOBIAN, NODE, SOLUTION
from rodmodel.core._threads import in_parts
from rodmodel.core._variants import VARIANTS
from rodmodel.error_bound import ErrorBound

if TYPE_CHECKING:
    from rodmodel.control import Inverse, Predictor
    from rodmodel.io import Found, SnappedSheet

#: Input of numbers: an array, a list, or a single number.
Numbers = ArrayLike | Sequence[float] | float

# Loosest tolerance that the core takes [rad].
_LOOSEST = 0.01
# Default number of steps along the rod.
_STEPS = 32
# Largest number to which the steps are doubled for a rod that bends too sharply.
_MOST_STEPS = 512


@final
@dataclass(frozen=True)
class CoreJacobian:
    """Derivatives of the pose by each input, whose three components are the last axis.

    Each attribute but the last is a mapping with the keys ``pressure`` [1/Pa], ``tip_force`` [1/N],
    ``tip_moment`` [1/(N m)] and ``gravity`` [s²/m].

    Attributes
    ----------
    tip_position : derivatives of the centre of the cap's outer face, (3, 3) [m].
    tip_turn : small turns of the cap in the world frame, δR = (turn × R), (3, 3) [rad].
    bend : derivatives of (θ cos γ, θ sin γ), (2, 3) [rad].
    bending_angle, bending_plane : derivatives of θ and γ, (3,) [rad]; NaN for θ below 1e-6 rad: a straight
        rod has no plane, and its angle no derivative.
    positions, turns : derivatives of the sections at `arc_lengths` [m], (n, 3, 3).
    arc_lengths : arc lengths of these sections [m], (n,).
    """

    tip_position: Mapping[str, np.ndarray]
    tip_turn: Mapping[str, np.ndarray]
    bend: Mapping[str, np.ndarray]
    bending_angle: Mapping[str, np.ndarray]
    bending_plane: Mapping[str, np.ndarray]
    positions: Mapping[str, np.ndarray]
    turns: Mapping[str, np.ndarray]
    arc_lengths: np.ndarray


@final
class CoreRod:
    """Soft actuator as an inextensible Cosserat rod with a clamped base and a rigid cap, in C.

    By default the base is at the origin, the rod along +z at rest, chamber k at azimuth 120° (k − 1). Several
    threads may call the methods at once; the core releases Python's global lock. `rodmodel.load_core` makes a
    rod from a calibration; `rodmodel.load` makes the differentiable one, with the same solutions.

    Attributes
    ----------
    actuator : dimensions and masses.
    domain : loads inside which the section was calibrated.
    error_bound : bound that the errors of 90 % of states keep.
    """

    def __init__(
        self, handle: Handle, actuator: Actuator, domain: Domain, error_bound: ErrorBound | float
    ) -> None:
        self.handle = handle
        self.actuator = actuator
        self.domain = domain
        self.error_bound = ErrorBound.of(error_bound)

    @classmethod
    def of(cls, found: "Found", variant: str = VARIANTS[-1]) -> "CoreRod":
        """Return the rod of a calibration that serves a layout."""
        calibration = found.calibration
        law = law_data(calibration.law, found.turns, found.mirrored, found.psi)
        bound = calibration.error_bound
        handle = Handle(law, calibration.actuator, found.domain, bound, variant)
        return cls(handle, calibration.actuator, found.domain, bound)

    @classmethod
    def of_sheet(cls, sheet: "SnappedSheet", variant: str = VARIANTS[-1]) -> "CoreRod":
        """Return the rod of a snapped branch."""
        law = law_data(sheet.law.law, sheet.turns, sheet.mirrored)
        handle = Handle(law, sheet.actuator, sheet.domain, sheet.bound, variant)
        return cls(handle, sheet.actuator, sheet.domain, sheet.bound)

    @classmethod
    def linear(
        cls,
        stiffness: np.ndarray,
        curvature_by_pressure: np.ndarray,
        actuator: Actuator,
        domain: Domain,
        rest_volume: float = 0.0,
        variant: str = VARIANTS[-1],
    ) -> "CoreRod":
        """Return a rod of constant stiffness whose free curvature is linear in the pressures.

        Parameters
        ----------
        stiffness, curvature_by_pressure : K [N m²] and C [1/(m Pa)] of `rodmodel.LinearLaw`, (3, 3).
        actuator : dimensions and masses.
        domain : loads inside which the law holds.
        rest_volume : chamber volume per length at rest [m²].
        variant : instruction set, one of `VARIANTS`.
        """
        law = linear_law_data(
            np.asarray(stiffness, float), np.asarray(curvature_by_pressure, float), rest_volume
        )
        return cls(Handle(law, actuator, domain, 0.0, variant), actuator, domain, 0.0)

    def solve(
        self,
        pressure: Numbers,
        tip_force: Numbers | None = None,
        tip_moment: Numbers | None = None,
        gravity: Numbers | None = None,
        throw: bool = True,
        *,
        distributed_force: Numbers | None = None,
        follower_force: Numbers | None = None,
        follower_moment: Numbers | None = None,
        base_position: Numbers | None = None,
        base_rotation: Numbers | None = None,
        start: CoreSolution | None = None,
        steps: int | None = None,
    ) -> CoreSolution:
        """Solve for the equilibrium under chamber pressures and loads.

        Parameters
        ----------
        pressure : gauge pressures of chambers 1, 2 and 3, zero or positive [Pa].
        tip_force : dead force at the centre of the cap's outer face, world frame [N].
        tip_moment : dead moment on the cap, world frame [N m].
        gravity : acceleration, world frame [m/s²].
        throw : raise an error for a bad input, pressures outside the calibration, or a solve that fails. If
            false, these are flagged in the solution.
        distributed_force : dead force along the body, per length, world frame [N/m].
        follower_force, follower_moment : force at the centre of the cap's outer face [N] and moment on the
            cap [N m], in the frame of the cap, with which they turn.
        base_position, base_rotation : position [m] and rotation matrix of the clamp, world frame.
        start : solution under nearby pressures and loads, from which Newton's method starts. If it finds no
            stable equilibrium, the solve restarts cold.
        steps : number of steps along the rod; the tip's error falls with its fourth power. By default 32,
            doubled up to 512 while the rod bends too sharply for them.

        Raises
        ------
        ValueError
            For an argument of a wrong shape.
        RuntimeError
            See `throw`.
        """
        given = row_of(
            {
                "pressure": pressure,
                "tip_force": tip_force,
                "tip_moment": tip_moment,
                "gravity": gravity,
                "distributed_force": distributed_force,
                "follower_force": follower_force,
                "follower_moment": follower_moment,
                "base_position": base_position,
                "base_rotation": base_rotation,
            }
        )
        count = checked_steps(steps)
        solution = self._solve(given, count, start)
        while steps is None and solution.result is Result.unresolved and count < _MOST_STEPS:
            count *= 2
            solution = self._solve(given, count, start)
        if throw:
            self.raise_where(solution, given["pressure"][0])
        return solution

    def jacobian(
        self,
        pressure: Numbers,
        tip_force: Numbers | None = None,
        tip_moment: Numbers | None = None,
        gravity: Numbers | None = None,
        *,
        arc_lengths: Numbers = (),
        steps: int | None = None,
        **loads: Any,
    ) -> tuple[CoreSolution, CoreJacobian]:
        """Solve, and differentiate the pose by pressures, tip force, tip moment and gravity.

        Parameters
        ----------
        pressure, tip_force, tip_moment, gravity, loads : as for `solve` with `throw` false.
        steps : number of steps along the rod; by default 32.
        arc_lengths : arc lengths of the sections whose poses to differentiate besides the tip's [m].

        Returns
        -------
        solution : solution with its flags.
        jacobian : derivatives; if the solve has not converged, those of the equilibrium that it reached.
        """
        dead = {"pressure": pressure, "tip_force": tip_force, "tip_moment": tip_moment, "gravity": gravity}
        given = row_of({**dead, **loads})
        s = np.ascontiguousarray(np.ravel(np.asarray(arc_lengths, float)))
        count = checked_steps(steps)
        record, nodes = np.zeros(1, SOLUTION), np.zeros(count + 1, NODE)
        by_input = np.zeros(1, JACOBIAN)
        along = np.zeros((2, s.size, 3, 12))
        self.handle.call.rm_solve_with_jacobian(
            self.handle.rod,
            _pointer("rm_input", given),
            self.options(count),
            ffi.NULL,
            self.handle.workspace(count, with_jacobian=True),
            _pointer("rm_node", nodes),
            _pointer("rm_solution", record),
            _pointer("rm_jacobian", by_input),
            s.size,
            ffi.from_buffer("rm_real *", s),
            ffi.from_buffer("rm_real *", along[0]),
            ffi.from_buffer("rm_real *", along[1]),
        )
        solution = CoreSolution(
            self.handle, _pointer("rm_input", given), record[0], _pointer("rm_node", nodes)
        )
        found = by_input[0]
        jacobian = CoreJacobian(
            tip_position=_by_input(found["position"]),
            tip_turn=_by_input(found["turn"]),
            bend=_by_input(found["bend"]),
            bending_angle=_by_input(found["bending_angle"]),
            bending_plane=_by_input(found["bending_plane"]),
            positions=_by_input(along[0]),
            turns=_by_input(along[1]),
            arc_lengths=s,
        )
        return solution, jacobian

    def solve_many(
        self,
        *,
        steps: int = _STEPS,
        tolerance: float | None = None,
        threads: int = 1,
        volumes: bool = False,
        **given: Any,
    ) -> np.ndarray:
        """Solve for the equilibria of many rows of inputs.

        Parameters
        ----------
        steps : number of steps along the rod.
        tolerance : tolerance of Newton's method on u L at the base [rad]; by default 1e-10.
        threads : number of threads that share the rows.
        volumes : compute chamber volumes; NaN otherwise.
        given : `pressure`, loads and base as for `solve`, one for all rows or one per row, (rows, 3).

        Returns
        -------
        solutions : records, (rows,), with the fields of `rm_solution`; `result` is 0 after success.
        """
        inputs = rows_of(given)
        found = np.zeros(inputs.size, SOLUTION)
        options = self.options(checked_steps(steps), volumes, tolerance)

        def part(first: int, last: int) -> None:
            rows = max(last - first, 0)
            self.handle.call.rm_solve_batch(
                self.handle.rod,
                _pointer("rm_input", inputs[first:last]),
                rows,
                options,
                self.handle.workspace(steps),
                _pointer("rm_solution", found[first:last]),
            )

        in_parts(part, inputs.size, threads)
        return found

    def inverse(
        self,
        bending_angle: float | None = None,
        bending_plane: float | None = None,
        tip_position: Numbers | None = None,
        tip_force: Numbers | None = None,
        tip_moment: Numbers | None = None,
        gravity: Numbers | None = None,
        throw: bool = True,
    ) -> "Inverse":
        """Return pressures for a target bend or tip position; see `rodmodel.control.inverse`."""
        # Imported late: rodmodel.control imports this package.
        from rodmodel.control import inverse

        return inverse(
            self, bending_angle, bending_plane, tip_position, tip_force, tip_moment, gravity, throw
        )

    def predictor(self, loads: Sequence[str] = (), **options: Any) -> "Predictor":
        """Prepare this rod for a control loop: see `rodmodel.Predictor` for the options."""
        from rodmodel.control import Predictor

        return Predictor(self, loads, **options)

    def raise_where(self, solution: CoreSolution, pressure: np.ndarray) -> None:
        """Raise a RuntimeError if a solve failed or its pressures are outside the calibration."""
        if solution.result is Result.bad_input:
            raise RuntimeError(
                f"pressure, loads or base: {solution.result.message}; throw=False flags this instead"
            )
        if not self.domain.covers_pressure(pressure):
            raise RuntimeError(
                f"pressure: got {pressure.tolist()} Pa, expected what the calibration covers, "
                f"at most {self.domain.largest_pressures('Pa')}; throw=False extrapolates"
            )
        if not solution.converged:
            raise RuntimeError(
                f"solve: {solution.result.message}; throw=False returns the equilibrium at "
                f"{100.0 * solution.load_fraction:.3g} % of the loads"
            )

    def options(self, steps: int, volumes: bool = True, tolerance: float | None = None) -> Any:
        """Return the core's options for so many steps."""
        options = ffi.new("rm_options *")
        self.handle.call.rm_default_options(options)
        options.steps = steps
        options.ask = lib.RM_VOLUMES if volumes else 0
        if tolerance is not None:
            if not 0.0 <= tolerance <= _LOOSEST:
                raise ValueError(f"tolerance: got {tolerance}, expected 0 to {_LOOSEST:g} rad")
            options.tolerance = tolerance
        return options

    def _solve(self, given: np.ndarray, steps: int, start: CoreSolution | None) -> CoreSolution:
        record, nodes = np.zeros(1, SOLUTION), np.zeros(steps + 1, NODE)
        unknown = ffi.NULL if start is None else ffi.from_buffer("rm_real *", np.array(start.unknown))
        pointers = _pointer("rm_input", given), _pointer("rm_node", nodes)
        self.handle.call.rm_solve(
            self.handle.rod,
            pointers[0],
            self.options(steps),
            unknown,
            self.handle.workspace(steps),
            pointers[1],
            _pointer("rm_solution", record),
        )
        return CoreSolution(self.handle, pointers[0], record[0], pointers[1])


def checked_steps(steps: int | None) -> int:
    """Return the steps along the rod, or refuse a number that is none."""
    if steps is None:
        return _STEPS
    if not isinstance(steps, int | np.integer) or steps < 1:
        raise ValueError(f"steps: got {steps!r}, expected a whole number of 1 or more")
    return int(steps)


def _pointer(name: str, records: np.ndarray) -> Any:
    """Return a pointer to records of a structure, which it keeps alive."""
    return ffi.from_buffer(f"{name} *", records)


def _by_input(values: np.ndarray) -> dict[str, np.ndarray]:
    names = ("pressure", "tip_force", "tip_moment", "gravity")
    return {name: values[..., 3 * k : 3 * k + 3] for k, name in enumerate(names)}
