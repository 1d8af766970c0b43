"""Inverse: pressures for a target bend or tip position, with the least co-contraction that reaches it."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, final

import numpy as np

from rodmodel.control._of_rod import core_of
from rodmodel.core import (
    INVERSE,
    TARGET,
    CoreRod,
    CoreSolution,
    Numbers,
    Result,
    ffi,
    in_parts,
    numbers_of,
    rows_of,
    shape_of,
)

# Integration steps along the rod.
_STEPS = 8


@final
@dataclass(frozen=True)
class Inverse:
    """Pressures for a target, and the rod at these pressures.

    For a bad input every number is NaN and every flag false.

    Attributes
    ----------
    pressure : pressures of chambers 1, 2 and 3, within the calibrated domain [Pa], (3,). For a target out of
        reach, the nearest ones.
    reached : whether the target is met, to 0.15 % of the length of body and cap or 1e-3 rad.
    distance : remaining distance to the target, of the tip [m] or of the bend (θ cos γ, θ sin γ) [rad].
    converged : whether the search ended at a local minimum of the distance, where the rod has an equilibrium.
    nearest : whether no pressures of the domain come nearer by more than the tolerance: the target is
        reached, or searches from every local minimum of a grid over the domain found nothing better.
    steps : number of solves that the search took.
    solution : solution of the rod at these pressures.
    """

    pressure: np.ndarray
    reached: bool
    distance: float
    converged: bool
    nearest: bool
    steps: int
    solution: CoreSolution


def inverse(
    rod: CoreRod,
    bending_angle: float | None = None,
    bending_plane: float | None = None,
    tip_position: Numbers | None = None,
    tip_force: Numbers | None = None,
    tip_moment: Numbers | None = None,
    gravity: Numbers | None = None,
    throw: bool = True,
) -> Inverse:
    """Return pressures for a target bend, or for a target position of the tip.

    Pressures stay within the calibrated domain. One chamber has no pressure wherever the target can be met
    so. For a target out of reach the result holds the nearest pressures.

    Parameters
    ----------
    rod : compiled rod.
    bending_angle, bending_plane : target θ, zero or positive, and γ [rad]; both, or else `tip_position`.
    tip_position : target of the centre of the cap's outer face, world frame [m].
    tip_force, tip_moment, gravity : dead loads, as in `CoreRod.solve`.
    throw : raise an error for a bad input, or if the rod has no equilibrium under its loads. If false, both
        are flagged in the result. A target out of reach is no error.

    Raises
    ------
    ValueError
        For an argument of a wrong shape, or a target that is neither a bend nor a position.
    RuntimeError
        See `throw`.
    """
    points, is_bend = _points(bending_angle, bending_plane, tip_position)
    if points.shape[0] != 1 or points.ndim != 2:
        raise ValueError("target: got rows, expected one; inverse_many takes rows")
    loads = {"tip_force": tip_force, "tip_moment": tip_moment, "gravity": gravity}
    answer = _answer(rod, _search(rod, points, is_bend, loads, 1)[0], loads)
    if throw and not answer.solution.converged:
        raise RuntimeError(
            "inverse: got a target that is not finite, a negative angle or beyond 10 rod lengths or 10 rad "
            "(is it in millimetres, or degrees?), or a load that is not finite; expected others; throw=False "
            "flags this instead"
            if answer.solution.result is Result.bad_input
            else f"inverse: {answer.solution.result.message}; throw=False flags this instead"
        )
    return answer


def inverse_many(
    rod: CoreRod,
    bending_angle: Numbers | None = None,
    bending_plane: Numbers | None = None,
    tip_position: Numbers | None = None,
    threads: int = 1,
    **loads: Numbers | None,
) -> np.ndarray:
    """Return pressures for many targets.

    Parameters
    ----------
    rod : compiled rod.
    bending_angle, bending_plane, tip_position : targets as for `inverse`, (rows,) or (rows, 3).
    threads : number of threads that share the rows.
    loads : `tip_force`, `tip_moment`, `gravity`, `distributed_force`, `follower_force`, `follower_moment`,
        `base_position` and `base_rotation` as in `CoreRod.solve`, for all rows, or with a first axis of rows.

    Returns
    -------
    found : records, (rows,), with the fields of `rm_inverse_result`.
    """
    if "pressure" in loads:
        raise ValueError("pressure: got one, expected targets and loads: the pressures are what is found")
    points, is_bend = _points(bending_angle, bending_plane, tip_position)
    return _search(rod, points, is_bend, loads, threads)


def inverse_of_rod(
    rod: Any,
    bending_angle: Any,
    bending_plane: Any,
    tip_position: Any,
    tip_force: Any,
    tip_moment: Any,
    gravity: Any,
    throw: bool,
) -> Inverse:
    """Return the inverse of a rod, compiled or differentiable; see `inverse`."""
    return inverse(
        core_of(rod), bending_angle, bending_plane, tip_position, tip_force, tip_moment, gravity, throw
    )


def _points(angle: Any, plane: Any, position: Any) -> tuple[np.ndarray, bool]:
    """Return targets, (rows, 3), and whether they are bends."""
    given = {"bending_angle": angle, "bending_plane": plane, "tip_position": position}
    names = [name for name, value in given.items() if value is not None]
    if names == ["tip_position"]:
        points = np.atleast_2d(_as_floats("tip_position", position, "three coordinates [m]"))
        if points.ndim != 2 or points.shape[1] != 3:
            raise ValueError(
                f"tip_position: got shape {np.shape(position)}, expected (3,): three coordinates [m]"
            )
        return points, False
    if names != ["bending_angle", "bending_plane"]:
        raise ValueError(
            f"bending_angle, bending_plane, tip_position: got {' and '.join(names) or 'none'}, "
            "expected bending_angle and bending_plane, or tip_position alone"
        )
    theta, gamma = (_as_floats(name, given[name], "one angle [rad]") for name in names)
    for name, value in zip(names, (theta, gamma), strict=True):
        if value.ndim > 1:
            raise ValueError(f"{name}: got shape {value.shape}, expected (): one angle [rad]")
    if theta.ndim and gamma.ndim and theta.shape != gamma.shape:
        raise ValueError(
            f"bending_angle, bending_plane: got {theta.size} and {gamma.size} numbers, expected as many"
        )
    theta, gamma = np.broadcast_arrays(np.atleast_1d(theta), np.atleast_1d(gamma))
    theta = np.where(theta >= 0.0, theta, math.nan)
    with np.errstate(invalid="ignore"):
        return np.stack([theta * np.cos(gamma), theta * np.sin(gamma), 0.0 * theta], axis=1), True


def _as_floats(name: str, value: Any, what: str) -> np.ndarray:
    """Return an array of floats, finite or not, or raise a ValueError that names the argument."""
    try:
        return np.asarray(value, np.float64)
    except (TypeError, ValueError) as error:
        raise ValueError(f"{name}: got {value!r}, expected {what}") from error


def _search(
    rod: CoreRod, points: np.ndarray, is_bend: bool, loads: Mapping[str, Any], threads: int
) -> np.ndarray:
    """Search for the pressures of every target; return records of `rm_inverse_result`."""
    count = len(points)
    if any(rod.domain.pressure_min):
        raise ValueError(
            "rod: got one of a snapped branch, expected the loading branch's: no inverse crosses a limit"
        )
    for name, value in loads.items():
        if value is not None:
            one = shape_of(name)
            numbers_of(name, value, (one, (count, *one)) if count > 1 else (one,))
    inputs = rows_of({"pressure": np.zeros(3), **loads})
    targets, found = np.zeros(count, TARGET), np.zeros(count, INVERSE)
    targets["point"], targets["is_bend"] = points, is_bend
    each = inputs.size > 1
    handle, options = rod.handle, rod.options(_STEPS)

    def part(first: int, last: int) -> None:
        rows = inputs[first:last] if each else inputs
        handle.call.rm_inverse_batch(
            handle.rod,
            ffi.from_buffer("rm_target *", targets[first:last]),
            ffi.from_buffer("rm_input *", rows),
            each,
            max(last - first, 0),
            options,
            handle.workspace(_STEPS, with_jacobian=True),
            ffi.from_buffer("rm_inverse_result *", found[first:last]),
        )

    in_parts(part, count, threads)
    return found


def _answer(rod: CoreRod, found: np.void, loads: Mapping[str, Any]) -> Inverse:
    """Return the inverse of one record, with the rod solved once more for its nodes."""
    bad = int(found["solution"]["result"]) == Result.bad_input
    pressure = np.full(3, math.nan) if bad else np.array(found["pressure"])
    solution = rod.solve(pressure, throw=False, steps=_STEPS, **({} if bad else loads))
    return Inverse(
        pressure=pressure,
        reached=bool(found["reached"]),
        distance=float(found["distance"]),
        converged=bool(found["converged"]),
        nearest=bool(found["nearest"]),
        steps=int(found["evaluations"]),
        solution=solution,
    )
