"""Stage 7: the rod against the judge runs, and the bound of its errors.

A conformal bound needs runs of many layouts, as those that ship have. Here few runs of one design judge one
rod. So the bound is that of the most similar shipped calibration, scaled to the design, and raised, between
nodes of its bending angle, until it holds at every judge state; it does not fall where the angle grows. The
distance of the sweep's mesh from a finer one counts as an error. No share of future states is promised.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import xarray as xr
from jaxtyping import Bool, Float

from calibration.fit import on_loading_branch
from calibration.from_design.mesh_check import MeshCheck
from calibration.from_design.near_law import NearLaw
from calibration.truth import way_of_tip
from rodmodel import Calibration, CoreRod, ErrorBound
from rodmodel.io import find_among

# Steps along the rod.
_STEPS = 64
# Least bounds before they are raised, of θ [rad] and of the tip relative to the length: so that a small error
# of a nearly straight rod, where shipped bounds are lowest, does not raise the bound at all others.
_LEAST_ANGLE, _LEAST_TIP = math.radians(0.3), 0.003
#: Largest errors of the tip, relative to the body's length, that judge runs are to show: median and worst.
MEDIAN_TIP, WORST_TIP = 0.015, 0.03


@dataclass(frozen=True)
class RodErrors:
    """Errors of a rod at states of the full actuator.

    Parameters
    ----------
    case, role, pressure : of each state [Pa].
    judged : whether the state is on the loading branch, and inside the rod's domain.
    angle, rod_angle : θ of the actuator, carried to the mesh of the sweep, and of the rod [rad].
    angle_error, tip_error : errors of the rod [rad], [m].
    angle_off, tip_off : the same with the error of the sweep's mesh.
    base_moment : moment on the rod's first section [N m].
    """

    case: np.ndarray
    role: np.ndarray
    pressure: Float[np.ndarray, "n 3"]
    judged: Bool[np.ndarray, " n"]
    angle: Float[np.ndarray, " n"]
    rod_angle: Float[np.ndarray, " n"]
    angle_error: Float[np.ndarray, " n"]
    tip_error: Float[np.ndarray, " n"]
    angle_off: Float[np.ndarray, " n"]
    tip_off: Float[np.ndarray, " n"]
    base_moment: Float[np.ndarray, " n"]

    def of(self, role: str) -> Bool[np.ndarray, " n"]:
        """Return which judged states have a role."""
        chosen: np.ndarray = self.judged & (self.role == role)
        return chosen


def rod_errors(calibration: Calibration, runs: xr.Dataset, mesh: MeshCheck) -> RodErrors:
    """Solve the rod under the pressures of runs.

    Parameters
    ----------
    calibration : law with ends.
    runs : of the full actuator.
    mesh : angles of the cell on the meshes of the sweep and of the runs.
    """
    own = calibration.layout
    rod = CoreRod.of(find_among([calibration], own.name, own.psi or 0.0, own.pitch))
    pressure = runs["pressure"].values
    solved = rod.solve_many(pressure=pressure, steps=_STEPS)
    angle, plane = runs["bending_angle"].values, runs["bending_plane"].values
    lengths = (np.full(len(angle), value) for value in (rod.actuator.body_length, rod.actuator.cap_length))
    way = way_of_tip(angle, plane, *lengths)
    driven = (pressure > 0.0).sum(axis=1).clip(1)
    ratio, wrong = (np.array([one(int(n)) for n in driven]) for one in (mesh.ratio, mesh.error))
    ratio, wrong = np.where(np.isfinite(ratio), ratio, 1.0), np.where(np.isfinite(wrong), wrong, 0.0)
    tip = runs["tip_position"].values + ((ratio - 1.0) * angle)[:, None] * way
    angle_error = np.abs(solved["bending_angle"] - ratio * angle)
    tip_error = np.linalg.norm(solved["tip_position"] - tip, axis=1)
    names = runs["case"].values.astype(str)
    return RodErrors(
        case=names,
        role=runs["role"].values.astype(str),
        pressure=pressure,
        judged=(solved["result"] == 0) & (solved["in_domain"] != 0) & on_loading_branch(runs, names),
        angle=ratio * angle,
        rod_angle=solved["bending_angle"],
        angle_error=angle_error,
        tip_error=tip_error,
        angle_off=angle_error + wrong * angle,
        tip_off=tip_error + wrong * angle * np.linalg.norm(way, axis=1),
        base_moment=solved["base_moment"],
    )


def summary(errors: RodErrors, length: float) -> dict[str, Any]:
    """Return median and worst errors of the judge runs: tip in % of the length, θ in degrees."""
    chosen = errors.of("judge")
    result: dict[str, Any] = {"states": int((errors.role == "judge").sum()), "judged": int(chosen.sum())}
    if chosen.any():
        for name, values in (
            ("tip_percent", 100.0 * errors.tip_error[chosen] / length),
            ("angle_deg", np.rad2deg(errors.angle_error[chosen])),
        ):
            result[name] = {"median": float(np.median(values)), "worst": float(values.max())}
    return result


def bound_of(
    errors: RodErrors, calibration: Calibration, near: Sequence[NearLaw]
) -> tuple[ErrorBound | None, dict[str, Any]]:
    """Return the bound of a calibration and its provenance; None if no shipped one has a bound to start from.

    Parameters
    ----------
    errors : rod against the runs.
    calibration : law with ends.
    near : shipped calibrations, the most similar first.
    """
    begun = next((one for one in near if one.calibration.bound is not None), None)
    if begun is None or begun.calibration.bound is None:
        return None, {"method": "none: no shipped calibration has a bound"}
    its = begun.calibration.bound
    shape = its.at_least(_LEAST_ANGLE, _LEAST_TIP * float(calibration.actuator.body_length))
    chosen = errors.of("judge")
    bent = errors.rod_angle[chosen]
    straight = shape.without_bend.at(errors.pressure[chosen].sum(axis=1), errors.base_moment[chosen])
    angle, tip = (
        _raised(shape.bending_angle, growth, bent, off[chosen] - np.asarray(known))
        for growth, off, known in (
            (shape.angle_by_bend, errors.angle_off, straight[0]),
            (shape.tip_by_bend, errors.tip_off, straight[1]),
        )
    )
    bound = replace(shape, angle_by_bend=angle, tip_by_bend=tip)
    ends = float(calibration.domain.pressure_sum_max), 0.0
    before, after = (
        np.array([one.at(*ends, bending_angle=node) for node in shape.bending_angle])
        for one in (shape, bound)
    )
    note = {
        "method": "shape of a shipped bound, raised to hold at every judge state; no coverage is promised",
        "shape_from": begun.title,
        "raised_by": dict(
            zip(("angle", "tip"), np.nan_to_num((after / before).max(axis=0), nan=1.0).tolist(), strict=True)
        ),
        "judge_states": int(chosen.sum()),
        "judge_runs": sorted(set(errors.case[chosen])),
    }
    return bound, note


def _raised(
    nodes: Sequence[float],
    values: Sequence[float],
    angle: Float[np.ndarray, " n"],
    needed: Float[np.ndarray, " n"],
) -> tuple[float, ...]:
    """Return values at nodes, none lower and not decreasing, that hold between these at every state.

    Parameters
    ----------
    nodes, values : terms that are linear between nodes, and constant outside them.
    angle : bending angle of each state [rad].
    needed : what the term is to be there at least; NaN if the bound is not known.
    """
    reach = [-math.inf, *nodes, math.inf]
    raised, before = [], 0.0
    for value, low, high in zip(values, reach, reach[2:], strict=False):
        # States between a node and its neighbours.
        near = needed[(angle > low) & (angle < high)]
        before = max(value, before, float(np.max(near, initial=0.0, where=~np.isnan(near))))
        raised.append(before)
    return tuple(raised)


def bars(calibration: Calibration, judged: Mapping[str, Any]) -> list[dict[str, Any]]:
    """Return what a calibration is to reach, what it has reached, and whether that is enough.

    Held out, 95 % of free bending are within 1 % of the range, or 1°. The tips of judge runs are within
    1.5 % of the length by the median, and 3 % at worst.
    """
    rows = []
    free = calibration.error.get("free_bending_angle_rad")
    if isinstance(free, Mapping):
        bar = max(0.01 * free["range"], math.radians(1.0))
        rows.append(_row("held-out free bending, 95 %", math.degrees(free["p95"]), math.degrees(bar), "deg"))
    if "tip_percent" in judged:
        tip = judged["tip_percent"]
        rows.append(_row("tip of judge runs, median", tip["median"], 100.0 * MEDIAN_TIP, "% of length"))
        rows.append(_row("tip of judge runs, worst", tip["worst"], 100.0 * WORST_TIP, "% of length"))
    return rows


def _row(name: str, value: float, bar: float, unit: str) -> dict[str, Any]:
    return {"name": name, "value": value, "bar": bar, "unit": unit, "met": value <= bar}
