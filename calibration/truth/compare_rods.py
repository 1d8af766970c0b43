"""Comparison of rods with runs of the full actuator, state by state."""

from collections.abc import Collection
from dataclasses import dataclass
from typing import Any

import numpy as np
import xarray as xr
from jaxtyping import Bool, Float

from calibration.fit import on_loading_branch
from calibration.truth.cases import layout_of
from calibration.truth.dataset import case_of
from rodmodel import CalibrationNotFoundError, CoreRod, load_core

# Steps along the rod; 64 of them agree with the adaptive solver within 4e-6 of the length in random cases.
_STEPS = 64
# Fields of a solution that are compared, with the shape of each.
_COMPARED: dict[str, tuple[int, ...]] = {
    "tip_position": (3,),
    "bending_angle": (),
    "bending_plane": (),
    "chamber_volume": (3,),
    "angle_error": (),
}
#: Errors of θ count up to this bending angle [rad].
ANGLE_JUDGED = np.deg2rad(150.0)


@dataclass(frozen=True)
class Verdict:
    """Errors of rods at the states of the truth.

    Parameters
    ----------
    case, role, pressure : case, role and pressures [Pa] of each state.
    loaded : whether the state has a tip force or gravity.
    judged : whether the state is inside the rod's domain and on the loading branch, and so counts.
    angle : θ of the truth [rad].
    tip : distance of the tips relative to the body's length.
    angle_error, plane_error : errors of θ and γ [rad]; the error of γ is NaN for a nearly straight actuator.
    response : error of the tip's displacement by a tip force, relative to that displacement; NaN without a
        tip force.
    volume : error of each chamber's volume [m³].
    stated : the rod's own 90 % bound of θ [rad].
    """

    case: np.ndarray
    role: np.ndarray
    pressure: Float[np.ndarray, "n 3"]
    loaded: Bool[np.ndarray, " n"]
    judged: Bool[np.ndarray, " n"]
    angle: Float[np.ndarray, " n"]
    tip: Float[np.ndarray, " n"]
    angle_error: Float[np.ndarray, " n"]
    plane_error: Float[np.ndarray, " n"]
    response: Float[np.ndarray, " n"]
    volume: Float[np.ndarray, "n 3"]
    stated: Float[np.ndarray, " n"]


def compare_with_truth(truth: xr.Dataset) -> Verdict:
    """Solve the rods of the shipped calibrations under the loads of the truth.

    Windings without a calibration have no judged states.
    """
    count = truth.sizes["state"]
    names = truth["case"].values
    pressure, force, gravity = (truth[key].values for key in ("pressure", "tip_force", "gravity"))
    loaded = np.asarray(force.any(axis=1) | gravity.any(axis=1))
    found: dict[str, Any] = {
        **{key: np.full((count, *shape), np.nan) for key, shape in _COMPARED.items()},
        "converged": np.zeros(count, dtype=bool),
        "in_domain": np.zeros(count, dtype=bool),
    }
    length = np.full(count, np.nan)
    windings = np.array([repr(case_of(name).winding) for name in names], dtype=object)
    for winding in dict.fromkeys(windings):
        rod = _rod_of(names[windings == winding][0])
        if rod is None:
            continue
        length[windings == winding] = rod.actuator.body_length
        rows = windings == winding
        states = rod.solve_many(
            pressure=pressure[rows], tip_force=force[rows], gravity=gravity[rows], steps=_STEPS, volumes=True
        )
        for key in _COMPARED:
            found[key][rows] = states[key]
        found["converged"][rows] = states["result"] == 0
        found["in_domain"][rows] = states["in_domain"] != 0
    turn = found["bending_plane"] - truth["bending_plane"].values
    sideways = np.linalg.norm(truth["tip_position"].values[:, :2], axis=1) > 0.02 * length
    return Verdict(
        case=names,
        role=truth["role"].values,
        pressure=pressure,
        loaded=loaded,
        judged=found["converged"] & found["in_domain"] & on_loading_branch(truth, names),
        angle=truth["bending_angle"].values,
        tip=np.linalg.norm(found["tip_position"] - truth["tip_position"].values, axis=1) / length,
        angle_error=np.abs(found["bending_angle"] - truth["bending_angle"].values),
        plane_error=np.where(sideways, np.abs((turn + np.pi) % (2.0 * np.pi) - np.pi), np.nan),
        response=_response(truth, found["tip_position"]),
        volume=found["chamber_volume"] - truth["volume"].values,
        stated=found["angle_error"],
    )


def _response(truth: xr.Dataset, tip: Float[np.ndarray, "n 3"]) -> Float[np.ndarray, " n"]:
    """Return the relative error of the tip's displacement from the state without the tip force."""
    names, force, theirs = (truth[key].values for key in ("case", "tip_force", "tip_position"))
    rest = np.concatenate([truth[key].values for key in ("pressure", "gravity")], axis=1)
    response = np.full(len(names), np.nan)
    for state in np.flatnonzero(force.any(axis=1)):
        without = np.flatnonzero(
            (names == names[state]) & ~force.any(axis=1) & (rest == rest[state]).all(axis=1)
        )
        if without.size:
            ours, way = (place[state] - place[without[0]] for place in (tip, theirs))
            response[state] = np.linalg.norm(ours - way) / np.linalg.norm(way)
    return response


def _rod_of(case: str) -> CoreRod | None:
    layout = layout_of(case_of(case).winding)
    try:
        return load_core(layout.name, layout.psi or 0.0, layout.pitch)
    except CalibrationNotFoundError:
        return None


def judgement(verdict: Verdict, role: str, cases: Collection[str] | None = None) -> dict[str, Any]:
    """Return median, 95th percentile and worst errors of a role's judged states, for some cases or all.

    ``tip_percent`` is relative to the body's length, and ``angle_deg`` counts up to 150°; both without and
    with loads. ``plane_deg`` is the error of the bending plane, ``response_percent`` that of the tip's
    displacement by a tip force, ``volume_mm3`` that of the worst chamber, and ``stated_bound_share`` the
    fraction of states whose θ is within the rod's own bound.
    """
    selected = verdict.role == role
    if cases is not None:
        selected &= np.isin(verdict.case.astype(str), list(cases))
    chosen = verdict.judged & selected
    upright = verdict.angle <= ANGLE_JUDGED
    volume = np.abs(verdict.volume).max(axis=1)
    result: dict[str, Any] = {
        "states": int(selected.sum()),
        "judged": int(chosen.sum()),
        "cases": sorted(set(verdict.case[chosen])),
    }
    for name, values, among in (
        ("tip_percent", 100.0 * verdict.tip, ~verdict.loaded),
        ("loaded_tip_percent", 100.0 * verdict.tip, verdict.loaded),
        ("angle_deg", np.rad2deg(verdict.angle_error), upright & ~verdict.loaded),
        ("loaded_angle_deg", np.rad2deg(verdict.angle_error), upright & verdict.loaded),
        ("plane_deg", np.rad2deg(verdict.plane_error), np.isfinite(verdict.plane_error)),
        ("response_percent", 100.0 * verdict.response, np.isfinite(verdict.response)),
        ("volume_mm3", 1e9 * volume, np.ones_like(upright)),
    ):
        rows = np.flatnonzero(chosen & among)
        if rows.size:
            worst = rows[np.argmax(values[rows])]
            result[name] = {
                "median": float(np.median(values[rows])),
                "p95": float(np.percentile(values[rows], 95, method="higher")),
                "worst": float(values[worst]),
                "worst_at": {
                    "case": str(verdict.case[worst]),
                    "pressure_kpa": (1e-3 * verdict.pressure[worst]).tolist(),
                },
            }
    if chosen.any():
        inside = verdict.angle_error[chosen] <= verdict.stated[chosen]
        result["stated_bound_share"] = float(inside.mean())
    return result
