"""The compiled rod: solves, derivatives and batches, NumPy in and out."""

from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from itertools import pairwise
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
from rodmodel.core._variants import VARIANTS

if TYPE_CHECKING:
    from rodmodel.control import Inverse, Predictor
    from rodmodel.io import Found

#: Numbers as they come: an array, a list, or one number.
Numbers = ArrayLike | Sequence[float] | float

# Steps of the reference, on to which a rod that turns too sharply is taken, and how far.
_STEPS, _MOST_STEPS = 32, 512


@final
@dataclass(frozen=True)
class CoreJacobian:
    """Derivatives of the pose by inputs, each of three columns, last axis: by name in a mapping.

    Keys are ``pressure`` [1/Pa], ``tip_force`` [1/N], ``tip_moment`` [1/(N m)] and ``gravity`` [s²/m].

    Attributes
    ----------
    tip_position : of the centre of the cap's outer face, (3, 3) [m].
    tip_turn : small turn of the cap in the world frame, δR = (turn × R), (3, 3) [rad].
    bend : of (θ cos γ, θ sin γ), (2, 3) [rad].
    bending_angle, bending_plane : of θ and γ, (3,) [rad]; NaN where θ is below 1e-6 rad, as a straight rod
        has no plane and its angle no derivative.
    positions, turns : of the sections at `arc_lengths` [m], (n, 3, 3).
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

    Unless told otherwise, the base is at the origin, the rod along +z at rest, chamber k at azimuth 120° (k −
    1). The functions may be called from several threads at once and release Python's lock.
    `rodmodel.load_core` makes a rod from a calibration; `rodmodel.load` makes the differentiable one, which
    finds the same.

    Attributes
    ----------
    actuator : lengths and masses.
    domain : the loads within which the section was calibrated.
    angle_error : within which the bending angle of the finite elements is in 90 % of states [rad].
    """

    def __init__(self, handle: Handle, actuator: Actuator, domain: Domain, angle_error: float) -> None:
        self.handle = handle
        self.actuator = actuator
        self.domain = domain
        self.angle_error = angle_error

    @classmethod
    def of(cls, found: "Found", variant: str = VARIANTS[-1]) -> "CoreRod":
        """Rod of a calibration that serves a layout."""
        calibration = found.calibration
        law = law_data(calibration.law, found.turns, found.mirrored, found.psi)
        angle_error = calibration.angle_error
        handle = Handle(law, calibration.actuator, found.domain, angle_error, variant)
        return cls(handle, calibration.actuator, found.domain, angle_error)

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
        """Rod of constant stiffness [N m²], its free curvature linear in the pressures [1/(m Pa)].

        Parameters
        ----------
        stiffness, curvature_by_pressure : K and C of `rodmodel.LinearLaw`, (3, 3).
        actuator, domain, rest_volume, variant : as of other rods; the volume per length at rest [m²].
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
        """Equilibrium under chamber pressures and loads.

        Parameters
        ----------
        pressure : gauge pressures of chambers 1, 2 and 3, zero or positive [Pa].
        tip_force : at the centre of the cap's outer face, world frame, dead [N].
        tip_moment : on the cap, world frame, dead [N m].
        gravity : acceleration, world frame [m/s²].
        throw : raise where an input is bad, pressures are outside the calibration, or the solve fails. If
            false, these are flagged in the solution.
        distributed_force : along the body, world frame, dead [N/m].
        follower_force, follower_moment : at the centre of the cap's outer face; turn with the cap, in whose
            frame they are given [N], [N m].
        base_position, base_rotation : of the clamp, world frame [m], (3, 3).
        start : a solution under nearby pressures and loads, tried first. From one that leads to no stable
            equilibrium the solve begins anew.
        steps : along the rod; the tip's error falls with their fourth power. If not given, 32, and twice as
            many as often as the rod turns too sharply for them, up to 512.

        Raises
        ------
        ValueError
            Where an argument has not the shape it must have.
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
        taken = _checked_steps(steps)
        solution = self._solve(given, taken, start)
        while steps is None and solution.result is Result.unresolved and taken < _MOST_STEPS:
            taken *= 2
            solution = self._solve(given, taken, start)
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
        pressure, tip_force, tip_moment, gravity, loads : as for `solve`, which does not raise here.
        steps : along the rod; 32 if not given.
        arc_lengths : where along the rod to differentiate the pose besides the tip [m].

        Returns
        -------
        solution : flags included: where it has not converged, the derivatives are those of what it reached.
        jacobian : derivatives.
        """
        dead = {"pressure": pressure, "tip_force": tip_force, "tip_moment": tip_moment, "gravity": gravity}
        given = row_of({**dead, **loads})
        s = np.ascontiguousarray(np.ravel(np.asarray(arc_lengths, float)))
        taken = _checked_steps(steps)
        record, nodes = np.zeros(1, SOLUTION), np.zeros(taken + 1, NODE)
        by_input = np.zeros(1, JACOBIAN)
        along = np.zeros((2, s.size, 3, 12))
        self.handle.call.rm_solve_with_jacobian(
            self.handle.rod,
            _pointer("rm_input", given),
            self.options(taken),
            ffi.NULL,
            self.handle.workspace(taken, with_jacobian=True),
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
        """Equilibria of many rows at once.

        Parameters
        ----------
        steps : along the rod.
        tolerance : of Newton's method on u L at the base [rad]; by default 1e-10.
        threads : over which the rows are spread.
        volumes : whether chamber volumes are wanted; NaN if not.
        given : `pressure`, loads and base as for `solve`, one for all rows or one a row, (rows, 3).

        Returns
        -------
        solutions : records, (rows,), with the fields of `rm_solution`; `result` is 0 where all went well.
        """
        inputs = rows_of(given)
        found = np.zeros(inputs.size, SOLUTION)
        options = self.options(_checked_steps(steps), volumes, tolerance)

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
        """Pressures for a wanted bend or tip position: see `rodmodel.control.inverse`."""
        # The control room is built on this one.
        from rodmodel.control import inverse

        return inverse(
            self, bending_angle, bending_plane, tip_position, tip_force, tip_moment, gravity, throw
        )

    def predictor(self, loads: Sequence[str] = (), **options: Any) -> "Predictor":
        """Prepare this rod for a control loop: see `rodmodel.Predictor` for the options."""
        from rodmodel.control import Predictor

        return Predictor(self, loads, **options)

    def raise_where(self, solution: CoreSolution, pressure: np.ndarray) -> None:
        """Raise `RuntimeError` where a solve failed or its pressures are outside the calibration."""
        if solution.result is Result.bad_input:
            raise RuntimeError(
                f"pressure, loads or base: {solution.result.message}; throw=False flags this instead"
            )
        if not self.domain.covers_pressure(pressure):
            first, second, third = self.domain.pressure_max
            raise RuntimeError(
                f"pressure: got {pressure.tolist()} Pa, expected what the calibration covers, "
                f"at most {first:g}, {second:g}, {third:g} Pa in chambers 1, 2, 3 "
                f"and {self.domain.pressure_sum_max:g} Pa in sum; throw=False extrapolates"
            )
        if not solution.converged:
            raise RuntimeError(
                f"solve: {solution.result.message}; throw=False returns the equilibrium at "
                f"{100.0 * solution.load_fraction:.3g} % of the loads"
            )

    def options(self, steps: int, volumes: bool = True, tolerance: float | None = None) -> Any:
        """Options of the core for so many steps."""
        options = ffi.new("rm_options *")
        self.handle.call.rm_default_options(options)
        options.steps = steps
        options.ask = lib.RM_VOLUMES if volumes else 0
        if tolerance is not None:
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


def in_parts(part: Any, count: int, threads: int) -> None:
    """Run a function of a first and a last row over all rows, on so many threads."""
    if threads < 1:
        raise ValueError(f"threads: got {threads}, expected 1 or more")
    if threads == 1 or count < 2 * threads:
        part(0, count)
        return
    edges = [count * k // threads for k in range(threads + 1)]
    with ThreadPoolExecutor(threads) as pool:
        for done in [pool.submit(part, first, last) for first, last in pairwise(edges)]:
            done.result()


def _checked_steps(steps: int | None) -> int:
    if steps is None:
        return _STEPS
    if steps < 1:
        raise ValueError(f"steps: got {steps}, expected 1 or more")
    return int(steps)


def _pointer(name: str, records: np.ndarray) -> Any:
    """Pointer to records of a structure, which it keeps alive."""
    return ffi.from_buffer(f"{name} *", records)


def _by_input(values: np.ndarray) -> dict[str, np.ndarray]:
    names = ("pressure", "tip_force", "tip_moment", "gravity")
    return {name: values[..., 3 * k : 3 * k + 3] for k, name in enumerate(names)}
