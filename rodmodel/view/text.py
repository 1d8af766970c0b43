"""Results as text and JSON, in the units that their names say: mm, kPa, degrees."""

import math
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    import rodmodel.control
    import rodmodel.core

#: Bending angle below which a rod is straight [rad]: roundings decide its plane.
STRAIGHT = 1e-6
# Width of the sectors of bending planes whose farthest bends are listed.
_PLANE_STEP_DEG = 15
_BUCKLED = "a partition wall has buckled, the rod bends aside"
_BRANCHES = {
    None: "unknown",
    "loading": "loading: pressures have only risen, no wall has snapped",
    "snapped": f"snapped: {_BUCKLED}",
}


def prediction_record(
    solution: "rodmodel.core.CoreSolution", on: "rodmodel.control.BranchSolution | None" = None
) -> dict[str, Any]:
    """Return a prediction as a JSON object; numbers that are unknown or undefined are null.

    ``on`` tells of its branch, if the prediction is of one of several.
    """
    of_branch: dict[str, Any] = {}
    if on is not None:
        of_branch = {
            "snapped_by_chamber": on.branch.chamber or None,
            "snapped_side": on.branch.side or None,
            "other_branch_possible": on.other_possible,
            "pressure_factor_to_end_of_branch": _number(on.reach),
        }
    branch = "loading" if on is None else on.branch.name
    return {
        "bending_angle_deg": _degrees(solution.bending_angle),
        "bending_plane_deg": None if _is_straight(solution) else _degrees(solution.bending_plane),
        "tip_position_mm": [_number(x) for x in 1e3 * np.asarray(solution.tip_position)],
        "chamber_volume_mm3": [_number(x) for x in 1e9 * np.asarray(solution.chamber_volume)],
        "converged": bool(solution.converged),
        "in_domain": bool(solution.in_domain),
        "error_estimate": {
            "bending_angle_deg": _degrees(solution.error_estimate),
            "tip_mm": _number(1e3 * float(solution.tip_error_estimate)),
        },
        "branch": branch if solution.in_domain else None,
        "stable": bool(solution.stable),
        "result": solution.result.name,
        "load_fraction": _number(float(solution.load_fraction)),
        **of_branch,
    }


def prediction_text(record: dict[str, Any]) -> str:
    """Return the text of a prediction's record."""
    angle, plane = _row([record["bending_angle_deg"]]), _row([record["bending_plane_deg"]])
    if record["bending_angle_deg"] is not None and record["bending_plane_deg"] is None:
        plane = f"{'–':>10s}"  # the rod is straight
    error, tip = (record["error_estimate"][name] for name in ("bending_angle_deg", "tip_mm"))
    if error is None:
        trust = "the moment or the force in the rod is beyond the calibration: an extrapolation"
    else:
        snapped = record["branch"] == "snapped"
        known = "in the few states that are known" if snapped else "in 90 % of states"
        trust = f"within {error:.2g} deg {known}"
    where = "centre of the cap's outer face" + ("" if tip is None else f", within {tip:.2g} mm")
    branch = _BRANCHES[record["branch"]]
    if record.get("snapped_by_chamber"):
        from rodmodel.control import Branch

        branch = f"{Branch(record['snapped_by_chamber'], record['snapped_side'])}: {_BUCKLED}"
    if record.get("other_branch_possible"):
        branch += "; with another past, another branch is possible"
    return "\n".join(
        [
            f"bending angle    {angle} deg   ({trust})",
            f"bending plane    {plane} deg",
            f"tip position     {_row(record['tip_position_mm'])} mm    ({where})",
            f"chamber volumes  {_row(record['chamber_volume_mm3'])} mm3",
            f"branch              {branch}; the rod is {'stable' if record['stable'] else 'not stable'}",
        ]
    )


def inverse_record(found: "rodmodel.control.Inverse", is_bend: bool) -> dict[str, Any]:
    """Return the pressures, the remaining distance and the prediction of an inverse as a JSON object."""
    distance = float(found.distance)
    remaining = {"distance_deg": math.degrees(distance)} if is_bend else {"distance_mm": 1e3 * distance}
    return {
        "pressure_kpa": [_number(p) for p in 1e-3 * np.asarray(found.pressure)],
        "reached": bool(found.reached),
        **{name: _number(value) for name, value in remaining.items()},
        "nearest": bool(found.nearest),
        **prediction_record(found.solution),
        "converged": bool(found.converged),
    }


def inverse_text(record: dict[str, Any]) -> str:
    """Return the text of an inverse's record: pressures and the prediction for them."""
    return "\n".join(
        [f"pressures        {_row(record['pressure_kpa'])} kPa", prediction_text(record)],
    )


def workspace_record(space: "rodmodel.control.Workspace") -> dict[str, Any]:
    """Return a workspace as a JSON object; samples without an equilibrium are left out."""
    good = space.converged
    angle = np.degrees(space.bending_angle[good])
    plane = np.degrees(space.bending_plane[good])
    tip = 1e3 * space.tip_position[good]
    pressure = 1e-3 * space.pressure[good]
    bent = space.bending_angle[good] >= STRAIGHT
    farthest = []
    for towards in range(0, 360, _PLANE_STEP_DEG):
        near = bent & (np.abs(np.mod(plane - towards + 180.0, 360.0) - 180.0) <= 0.5 * _PLANE_STEP_DEG)
        if near.any():
            row = np.argmax(np.where(near, angle, -1.0))
            farthest.append(
                {
                    "bending_plane_deg": float(plane[row]),
                    "bending_angle_deg": float(angle[row]),
                    "pressure_kpa": pressure[row].tolist(),
                }
            )
    return {
        "samples": int(good.sum()),
        "not_converged": int((~good).sum()),
        "in_domain": int(space.in_domain[good].sum()),
        "tip_min_mm": tip.min(axis=0).tolist() if good.any() else None,
        "tip_max_mm": tip.max(axis=0).tolist() if good.any() else None,
        "farthest_bends": farthest,
        "pressure_kpa": pressure.tolist(),
        "tip_position_mm": tip.tolist(),
        "bending_angle_deg": angle.tolist(),
        "bending_plane_deg": [
            p if has_plane else None for p, has_plane in zip(plane.tolist(), bent, strict=True)
        ],
    }


def workspace_text(record: dict[str, Any]) -> str:
    """Return the text of a workspace's record."""
    lines = [
        f"samples          {record['samples']:10d}   "
        f"({record['in_domain']} with moments inside the calibration)",
        f"tip, least       {_row(record['tip_min_mm'])} mm",
        f"tip, most        {_row(record['tip_max_mm'])} mm",
        f"farthest bends, every {_PLANE_STEP_DEG} deg of the plane:",
        "   plane [deg]  angle [deg]   pressures [kPa]",
    ]
    lines += [
        f"  {bend['bending_plane_deg']:12.1f} {bend['bending_angle_deg']:12.1f}   "
        + " ".join(f"{p:5.1f}" for p in bend["pressure_kpa"])
        for bend in record["farthest_bends"]
    ]
    return "\n".join(lines)


def _is_straight(solution: "rodmodel.core.CoreSolution") -> bool:
    return abs(float(solution.bending_angle)) < STRAIGHT


def _number(value: float) -> float | None:
    return float(value) if math.isfinite(value) else None


def _degrees(angle: Any) -> float | None:
    return _number(math.degrees(float(angle)))


def _row(values: list[float | None]) -> str:
    return " ".join(f"{'unknown':>10s}" if value is None else f"{value:10.3f}" for value in values)
