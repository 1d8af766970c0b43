"""Comparison of rods with runs of the full actuator, state by state."""

from collections.abc import Collection
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import xarray as xr
from jaxtyping import Bool, Float

from calibration.fit import on_loading_branch
from calibration.truth.cases import layout_of
from calibration.truth.dataset import case_of, truth_level
from calibration.truth.mesh_limits import MeshLimits, load_limits
from calibration.truth.mesh_torsion import on_mesh
from calibration.truth.serving import serving
from fem_reference import level_record
from rodmodel import CoreRod, shipped_calibrations

# Steps along the rod; 64 of them agree with the adaptive solver within 4e-6 of the length in random cases.
_STEPS = 64
# Fields of a solution that are compared, with the shape of each.
_COMPARED: dict[str, tuple[int, ...]] = {
    "tip_position": (3,),
    "bending_angle": (),
    "bending_plane": (),
    "chamber_volume": (3,),
    "angle_error": (),
    "tip_error": (),
    "base_moment": (),
}
# Largest relative difference between the angles of a state and of its image.
_ALIKE = 5e-4
# Tip force that bends a rod by some 0.05° [N].
_SMALL_FORCE = np.array([1e-4, 0.0, 0.0])
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
    rod_angle : θ of the rod [rad].
    tip : distance of the tips relative to the body's length.
    angle_error, plane_error : errors of θ and γ [rad]; the error of γ is NaN for a nearly straight actuator.
        The truth of another mesh than the law's is carried to the limit of fine meshes before.
    response : error of the tip's displacement by a tip force, relative to that displacement; NaN without a
        tip force.
    volume : error of each chamber's volume, likewise carried [m³].
    stated, stated_tip : the rod's own 90 % bounds of θ [rad] and of the tip [m].
    base_moment : norm of the moment on the rod's first section [N m].
    turn_by_moment, way_by_moment : θ [rad/(N m)] and way of the tip [1/N] of the rod at rest under a small
        tip force, by the moment that it puts on the base.
    served_by : layout of the calibration that serves the state; None without one.
    angle_off, tip_off : largest errors of θ [rad] and of the tip [m] against the truth in the limit of fine
        meshes, which is known to an interval: see `calibration.truth.mesh_limits`. NaN where nothing is known
        of the mesh.
    mesh_known : whether that interval is of the state's own winding.
    copied : whether the section's symmetry makes the state an earlier one's image, which tells nothing new.
    """

    case: np.ndarray
    role: np.ndarray
    pressure: Float[np.ndarray, "n 3"]
    loaded: Bool[np.ndarray, " n"]
    judged: Bool[np.ndarray, " n"]
    angle: Float[np.ndarray, " n"]
    rod_angle: Float[np.ndarray, " n"]
    tip: Float[np.ndarray, " n"]
    angle_error: Float[np.ndarray, " n"]
    plane_error: Float[np.ndarray, " n"]
    response: Float[np.ndarray, " n"]
    volume: Float[np.ndarray, "n 3"]
    stated: Float[np.ndarray, " n"]
    stated_tip: Float[np.ndarray, " n"]
    base_moment: Float[np.ndarray, " n"]
    turn_by_moment: Float[np.ndarray, " n"]
    way_by_moment: Float[np.ndarray, " n"]
    served_by: np.ndarray
    angle_off: Float[np.ndarray, " n"]
    tip_off: Float[np.ndarray, " n"]
    mesh_known: Bool[np.ndarray, " n"]
    copied: Bool[np.ndarray, " n"]


def compare_with_truth(truth: xr.Dataset, limits: MeshLimits | None = None) -> Verdict:
    """Solve the rods of the shipped calibrations under the loads of the truth.

    Windings without a calibration have no judged states. A rod whose torsion is that of the limit is given
    that of the run's mesh before, where it is known.

    Parameters
    ----------
    truth : dataset of `gather`.
    limits : what is known of the meshes' limits; by default the table that ships.
    """
    limits = load_limits() if limits is None else limits
    count = truth.sizes["state"]
    names = truth["case"].values
    pressure, force, gravity = (truth[key].values for key in ("pressure", "tip_force", "gravity"))
    loaded = np.asarray(force.any(axis=1) | gravity.any(axis=1))
    found: dict[str, Any] = {
        **{key: np.full((count, *shape), np.nan) for key, shape in _COMPARED.items()},
        "converged": np.zeros(count, dtype=bool),
        "in_domain": np.zeros(count, dtype=bool),
    }
    length, cap = np.full(count, np.nan), np.full(count, np.nan)
    by_moment = np.full((count, 2), np.nan)
    served_by, law_mesh = (np.full(count, None, dtype=object) for _ in range(2))
    meshes = np.array([str(level_record(truth_level(truth, str(name)))) for name in names], dtype=object)
    windings = np.array([repr(case_of(name).winding) for name in names], dtype=object)
    shipped = shipped_calibrations()
    for winding, mesh in dict.fromkeys(zip(windings, meshes, strict=True)):
        rows = (windings == winding) & (meshes == mesh)
        calibrated = serving(names[rows][0], shipped)
        if calibrated is None:
            continue
        rod = CoreRod.of(replace(calibrated, calibration=on_mesh(calibrated.calibration, mesh, limits)))
        length[rows], cap[rows] = rod.actuator.body_length, rod.actuator.cap_length
        served_by[rows], by_moment[rows] = calibrated.calibration.layout, _by_moment(rod)
        law_mesh[rows] = calibrated.calibration.provenance.get("mesh")
        states = rod.solve_many(
            pressure=pressure[rows], tip_force=force[rows], gravity=gravity[rows], steps=_STEPS, volumes=True
        )
        for key in _COMPARED:
            found[key][rows] = states[key]
        found["converged"][rows] = states["result"] == 0
        found["in_domain"][rows] = states["in_domain"] != 0
    angle, tip = truth["bending_angle"].values, truth["tip_position"].values
    intervals = [
        limits.interval(layout_of(case_of(name).winding), mesh, p.tolist())
        for name, mesh, p in zip(names, meshes, pressure, strict=True)
    ]
    middle, half = (np.array([getattr(one, key) for one in intervals]) for key in ("middle", "half_width"))
    way = way_of_tip(angle, truth["bending_plane"].values, length, cap)
    at_limit = tip + ((middle - 1.0) * angle)[:, None] * way
    # A law of another mesh than a run's is not compared with that run's mesh.
    alike = law_mesh == meshes
    change = np.array([one.volume_change for one in intervals])
    at_limit_volume = truth["volume"].values + length[:, None] * change
    its_volume = np.where(alike[:, None], truth["volume"].values, at_limit_volume)
    its_angle, its_tip = np.where(alike, angle, middle * angle), np.where(alike[:, None], tip, at_limit)
    turn = found["bending_plane"] - truth["bending_plane"].values
    sideways = np.linalg.norm(truth["tip_position"].values[:, :2], axis=1) > 0.02 * length
    return Verdict(
        case=names,
        role=truth["role"].values,
        pressure=pressure,
        loaded=loaded,
        judged=found["converged"] & found["in_domain"] & on_loading_branch(truth, names),
        angle=angle,
        rod_angle=found["bending_angle"],
        tip=np.linalg.norm(found["tip_position"] - its_tip, axis=1) / length,
        angle_error=np.abs(found["bending_angle"] - its_angle),
        plane_error=np.where(sideways, np.abs((turn + np.pi) % (2.0 * np.pi) - np.pi), np.nan),
        response=_response(truth, found["tip_position"]),
        volume=found["chamber_volume"] - its_volume,
        stated=found["angle_error"],
        stated_tip=found["tip_error"],
        base_moment=found["base_moment"],
        turn_by_moment=by_moment[:, 0],
        way_by_moment=by_moment[:, 1],
        served_by=served_by,
        angle_off=np.abs(found["bending_angle"] - middle * angle) + half * angle,
        tip_off=np.linalg.norm(found["tip_position"] - at_limit, axis=1)
        + half * angle * np.linalg.norm(way, axis=1),
        mesh_known=np.array([one.known for one in intervals]),
        copied=_copied(served_by, pressure, loaded, angle, tip),
    )


def _by_moment(rod: CoreRod) -> tuple[float, float]:
    """Return θ and the way of the tip under a small tip force, by the moment that it puts on the base."""
    state = rod.solve_many(pressure=np.zeros(3), tip_force=_SMALL_FORCE, steps=_STEPS)[0]
    way = float(np.hypot(*state["tip_position"][:2]))
    return float(state["bending_angle"] / state["base_moment"]), way / float(state["base_moment"])


def way_of_tip(
    angle: Float[np.ndarray, " n"],
    plane: Float[np.ndarray, " n"],
    length: Float[np.ndarray, " n"],
    cap: Float[np.ndarray, " n"],
) -> Float[np.ndarray, "n 3"]:
    """Return the derivative of the tip of an arc with a cap by its angle, in its plane [m].

    With the tangent (sin θ, cos θ) the tip is at L (1 − cos θ, sin θ)/θ + cap (sin θ, cos θ).

    Parameters
    ----------
    angle, plane : θ and γ [rad].
    length, cap : lengths of body and cap [m].
    """
    near = np.abs(angle) < 1e-4
    theta = np.where(near, 1.0, angle)
    aside = np.where(near, 0.5, (theta * np.sin(theta) + np.cos(theta) - 1.0) / theta**2)
    up = np.where(near, 0.0, (theta * np.cos(theta) - np.sin(theta)) / theta**2)
    aside, up = length * aside + cap * np.cos(angle), length * up - cap * np.sin(angle)
    # Chamber 1, at x > 0, bends the tip to x < 0, and γ is 0.
    return np.stack([-aside * np.cos(plane), -aside * np.sin(plane), up], axis=1)


def _copied(
    served_by: np.ndarray,
    pressure: Float[np.ndarray, "n 3"],
    loaded: Bool[np.ndarray, " n"],
    angle: Float[np.ndarray, " n"],
    tip: Float[np.ndarray, "n 3"],
) -> Bool[np.ndarray, " n"]:
    """Return which unloaded states have an earlier one's pressures in another order, and its θ and height.

    The pressures agree to 1e-6 of the largest, θ and the height to 0.05 %.
    """
    ordered = np.sort(pressure, axis=1)
    copied = np.zeros(len(angle), dtype=bool)
    for state in np.flatnonzero(~loaded):
        before = np.flatnonzero(~loaded[:state] & (served_by[:state] == served_by[state]))
        alike = np.isclose(ordered[before], ordered[state], rtol=1e-6, atol=1e-3).all(axis=1)
        alike &= np.isclose(angle[before], angle[state], rtol=_ALIKE)
        alike &= np.isclose(tip[before, 2], tip[state, 2], rtol=_ALIKE, atol=1e-6)
        copied[state] = alike.any()
    return copied


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


def judgement(verdict: Verdict, role: str, cases: Collection[str] | None = None) -> dict[str, Any]:
    """Return median, 95th percentile and worst errors of a role's judged states, for some cases or all.

    ``tip_percent`` is relative to the body's length, and ``angle_deg`` counts up to 150°; both without and
    with loads. ``plane_deg`` is the error of the bending plane, ``response_percent`` that of the tip's
    displacement by a tip force, and ``volume_mm3`` that of the worst chamber.
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
    return result
