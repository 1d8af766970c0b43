"""Rods on their snapped branches against runs of the full actuator that jumped."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import xarray as xr

from calibration.truth.serving import serving
from rodmodel import Branch, CoreRod, Layout, shipped_calibrations
from rodmodel.io import Found, snapped_sheets

# A bending plane this far from the chamber's own is that of an actuator that has snapped a second time [rad].
_TWICE = math.radians(45.0)


@dataclass(frozen=True)
class SnappedState:
    """A state of the full actuator after a jump, and the rod's.

    Parameters
    ----------
    case, pressure : run and pressures [Pa].
    branch : branch of the rod.
    layout, sheet : the calibration's layout, and chamber and side of its law that serves the branch.
    angle, plane : θ and γ of the actuator [rad].
    angle_error, plane_error : of the rod, with their signs [rad].
    tip : distance of the tips over the body's length.
    in_domain : whether the pressures are in the branch's domain.
    """

    case: str
    pressure: tuple[float, float, float]
    branch: Branch
    layout: Layout
    sheet: tuple[int, int]
    angle: float
    plane: float
    angle_error: float
    plane_error: float
    tip: float
    in_domain: bool


def compare_snapped(truth: xr.Dataset) -> tuple[SnappedState, ...]:
    """Solve the snapped rods of the shipped calibrations at the truth's states after a jump.

    The side is that of the actuator. States that have snapped a second time, far aside, and windings whose
    calibration knows no snapped branch are left out.

    Parameters
    ----------
    truth : dataset of `gather`.
    """
    names = truth["case"].values
    found = []
    shipped = shipped_calibrations()
    for case in dict.fromkeys(map(str, names)):
        rows = np.flatnonzero(names == case)
        jumped = np.maximum.accumulate(truth["jumped"].values[rows] != 0)
        calibrated = serving(case, shipped) if jumped.any() else None
        if calibrated is None:
            continue
        for row in rows[jumped]:
            state = _compared(truth.isel(state=int(row)), case, calibrated)
            if state is not None:
                found.append(state)
    return tuple(found)


def largest_errors(
    states: Sequence[SnappedState], layout: Layout, sheet: tuple[int, int], length: float
) -> dict[str, float] | None:
    """Return the largest errors of one law of a layout, as its file holds them; None without a state.

    Parameters
    ----------
    states : states of `compare_snapped`.
    layout, sheet : see `SnappedState`.
    length : the body's [m].
    """
    own = [state for state in states if (state.layout, state.sheet) == (layout, sheet)]
    if not own:
        return None
    return {
        "angle_rad": max(abs(state.angle_error) for state in own),
        "plane_rad": max(abs(state.plane_error) for state in own),
        "tip_m": length * max(state.tip for state in own),
        "states": len(own),
    }


def _compared(state: xr.Dataset, case: str, calibrated: Found) -> SnappedState | None:
    pressure = state["pressure"].values
    angle, plane = float(state["bending_angle"]), float(state["bending_plane"])
    chamber = int(np.argmax(pressure)) + 1
    aside = math.remainder(plane - 2.0 * math.pi / 3.0 * (chamber - 1), 2.0 * math.pi)
    branch = Branch(chamber, 1 if aside > 0.0 else -1)
    sheets = {Branch(sheet.chamber, sheet.side): sheet for sheet in snapped_sheets(calibrated)}
    if branch not in sheets or abs(aside) > _TWICE:
        return None
    law = sheets[branch].law
    rod = CoreRod.of_sheet(sheets[branch])
    solution = rod.solve(
        pressure, tip_force=state["tip_force"].values, gravity=state["gravity"].values, throw=False
    )
    way = solution.tip_position - state["tip_position"].values
    first, second, third = pressure.tolist()
    return SnappedState(
        case=case,
        pressure=(first, second, third),
        branch=branch,
        layout=calibrated.calibration.layout,
        sheet=(law.chamber, law.side),
        angle=angle,
        plane=plane,
        angle_error=float(solution.bending_angle) - angle,
        plane_error=math.remainder(float(solution.bending_plane) - plane, 2.0 * math.pi),
        tip=float(np.linalg.norm(way)) / float(rod.actuator.body_length),
        in_domain=bool(solution.in_domain),
    )
