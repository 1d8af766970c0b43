"""Solution of the compiled rod: pose, shape, flags and error estimate."""

from collections.abc import Sequence
from enum import IntEnum
from typing import Any, final

import numpy as np
from numpy.typing import ArrayLike

from rodmodel.core._handle import Handle
from rodmodel.core._native import ffi


class Result(IntEnum):
    """Result of a solve; `message` explains it and names a remedy."""

    successful = 0
    bad_input = 1
    unstable = 2
    not_converged = 3
    unresolved = 4
    too_many_shots = 5

    @property
    def message(self) -> str:
        """Reason for the end of the solve, and a remedy."""
        return _MESSAGES[self]


_MESSAGES = {
    Result.successful: "the equilibrium under the full load was found",
    Result.bad_input: (
        "a pressure is negative, an input is not finite, base_rotation is no rotation, or steps or tolerance "
        "are out of range; correct it"
    ),
    Result.unstable: (
        "the rod would snap, or buckle to an undetermined side, before it carries the full load; "
        "take less load, or one that leans to a side"
    ),
    Result.not_converged: (
        "Newton's method found no equilibrium on the branch that the rod follows from rest; "
        "take less load, or more steps"
    ),
    Result.unresolved: "the rod bends too sharply for so few steps; take more steps, or less load",
    Result.too_many_shots: "the limit on iterations was met; take less load, or raise the limit",
}


@final
class CoreSolution:
    """Equilibrium of a rod, in the world frame; NumPy arrays.

    For a bad input every number is NaN and both flags are false.

    Attributes
    ----------
    tip_position : centre of the cap's outer face [m], (3,).
    tip_rotation : frame of the cap, directors as columns, (3, 3).
    bending_angle : angle θ of the tip's tangent from the base's, continued past 180° [rad].
    bending_plane : azimuth γ in [0, 2π) [rad]; 0 for a straight rod, where it is undefined.
    bend : (θ cos γ, θ sin γ) [rad], smooth where the rod is straight.
    chamber_volume : volume of each chamber over the body [m³], (3,).
    converged : whether the full load was reached.
    result : result of the solve.
    stable : whether the second variation of the energy is positive; under moments and follower forces,
        whether the loads have passed no bifurcation.
    in_domain : whether pressures, and the moment everywhere on the body, are in the calibrated domain, and
        the forces shear no section by more than 0.2 rad, and the base turns by no more than 0.5 rad.
    error_estimate : bound of the error of θ that 90 % of states keep, at these pressures and loads [rad];
        NaN outside the domain.
    tip_error_estimate : likewise of the tip's distance from where it is [m]; NaN also where none is known.
    load_fraction : fraction of the loads at which this is the equilibrium.
    load_steps, shots : numbers of load steps, and of shots, integrations from base to end.
    unknown : solution of the shooting, a start for the next solve: u L at the base, then the follower force,
        if there is one, in the frame of the base [N].
    """

    def __init__(self, handle: Handle, given: Any, record: np.void, nodes: Any) -> None:
        self._handle, self._given, self._record, self._nodes = handle, given, record, nodes
        self.tip_position: np.ndarray = record["tip_position"]
        self.tip_rotation: np.ndarray = record["tip_rotation"]
        self.bend: np.ndarray = record["bend"]
        self.bending_angle = float(record["bending_angle"])
        self.bending_plane = float(record["bending_plane"])
        self.chamber_volume: np.ndarray = record["chamber_volume"]
        self.result = Result(int(record["result"]))
        self.converged = self.result is Result.successful
        self.stable = bool(record["stable"])
        self.in_domain = bool(record["in_domain"])
        self.error_estimate = float(record["angle_error"])
        self.tip_error_estimate = float(record["tip_error"])
        self.load_fraction = float(record["load_fraction"])
        self.load_steps, self.shots = int(record["load_steps"]), int(record["shots"])
        self.unknown: np.ndarray = record["unknown"]

    @property
    def stats(self) -> dict[str, float]:
        """Mapping with `load_fraction`, `load_steps` and `shots`."""
        return {
            "load_fraction": self.load_fraction,
            "load_steps": self.load_steps,
            "shots": self.shots,
        }

    def centreline(self, arc_length: ArrayLike | Sequence[float] | float) -> np.ndarray:
        """Return the position r(s) of the axis, world frame [m], (..., 3).

        Parameters
        ----------
        arc_length : s [m], any shape, from 0 at the base to the cap's outer face; others give NaN.
        """
        return self._stations(arc_length, 0, (3,))

    def frames(self, arc_length: ArrayLike | Sequence[float] | float) -> np.ndarray:
        """Return the frame R(s), directors as columns, world frame, (..., 3, 3); constant in the cap.

        Parameters
        ----------
        arc_length : s [m], any shape, from 0 at the base to the cap's outer face; others give NaN.
        """
        return self._stations(arc_length, 1, (3, 3))

    def curvature(self, arc_length: ArrayLike | Sequence[float] | float) -> np.ndarray:
        """Return curvature and twist u(s), body frame [1/m], (..., 3); zero in the cap, which is rigid.

        Parameters
        ----------
        arc_length : s [m], any shape, from 0 at the base to the cap's outer face; others give NaN.
        """
        return self._stations(arc_length, 2, (3,))

    def _stations(
        self, arc_length: ArrayLike | Sequence[float] | float, which: int, shape: tuple[int, ...]
    ) -> np.ndarray:
        s = np.asarray(arc_length, np.float64, order="C")
        found = np.full(s.shape + shape, np.nan)
        if self.result is Result.bad_input or not np.isfinite(self.tip_position[0]):
            return found
        into: list[Any] = [ffi.NULL] * 3
        into[which] = ffi.from_buffer("rm_real *", found)
        solution = ffi.from_buffer("rm_solution *", np.atleast_1d(self._record))
        self._handle.call.rm_stations(
            self._handle.rod,
            self._given,
            solution,
            self._nodes,
            s.size,
            ffi.from_buffer("rm_real *", s),
            *into,
        )
        return found
