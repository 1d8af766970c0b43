"""Points of finite elements for the figures: the period cell's, and the full actuator's."""

import json
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np
import xarray as xr

from calibration.truth import SHIPPED, case_of, layout_of, load_truth, same_layout
from rodmodel import Layout

POINTS = Path(__file__).parents[1] / "data" / "cell_points.json"
# Largest pressure beside those of a path [Pa].
_BESIDE = 1e-6


@dataclass(frozen=True)
class Points:
    """States on a path of rising pressures.

    Attributes
    ----------
    pressure : largest pressure [kPa].
    angle, plane : θ and γ [deg].
    tip : centre of the cap's outer face [mm]; not a number for the cell, which has no cap.
    snapped : whether a wall has snapped on the way.
    """

    pressure: np.ndarray
    angle: np.ndarray
    plane: np.ndarray
    tip: np.ndarray
    snapped: np.ndarray


def cell_points(name: str, turned_deg: float = 0.0, mirrored: bool = False) -> Points:
    """Return a path of the cell, as the angle of 60 mm of uniform bending.

    Parameters
    ----------
    name : of the path in the file of points.
    turned_deg, mirrored : where the path is another chamber's: its plane is turned, after a mirror.
    """
    held = json.loads(POINTS.read_text())[name]
    plane = np.array(held["plane_deg"])
    plane = ((-plane if mirrored else plane) + turned_deg) % 360.0
    snapped = np.cumsum(held["jumped"]) > 0
    none = np.full((len(plane), 3), np.nan)
    return Points(np.array(held["pressure_kpa"]), np.array(held["angle_deg"]), plane, none, snapped)


def actuator_points(layout: Layout, chambers: Sequence[float]) -> Points:
    """Return the runs of the full actuator without a load that no rod was fitted to; none if there are none.

    Parameters
    ----------
    layout : winding of the runs.
    chambers : shares of the largest pressure in each chamber.
    """
    run = _run(layout, chambers)
    return Points(
        1e-3 * run["pressure"].values.max(axis=1),
        np.degrees(run["bending_angle"].values),
        np.degrees(run["bending_plane"].values),
        1e3 * run["tip_position"].values,
        np.cumsum(run["jumped"].values) > 0,
    )


def middle_curvature(layout: Layout, chambers: Sequence[float]) -> tuple[np.ndarray, np.ndarray]:
    """Return pressures [kPa] of the runs of `actuator_points`, and curvatures of their middle [1/m], (n, 3).

    States after a snap are left out.
    """
    run = _run(layout, chambers)
    upright = np.cumsum(run["jumped"].values) == 0
    return 1e-3 * run["pressure"].values.max(axis=1)[upright], run["middle_curvature"].values[upright]


def _run(layout: Layout, chambers: Sequence[float]) -> xr.Dataset:
    truth = _judges()
    pressure, cases = truth["pressure"].values, truth["case"].values.astype(str)
    beside = np.abs(pressure - pressure.max(axis=1, keepdims=True) * np.array(chambers)).max(axis=1)
    wound = {case for case in set(cases) if same_layout(layout_of(case_of(case).winding), layout)}
    return truth.isel(state=np.flatnonzero((beside < _BESIDE) & np.isin(cases, list(wound))))


@cache
def _judges() -> xr.Dataset:
    truth = load_truth(SHIPPED)
    loaded = truth["tip_force"].values.any(axis=1) | truth["gravity"].values.any(axis=1)
    return truth.isel(state=np.flatnonzero(~loaded & (truth["role"].values.astype(str) == "judge")))
