"""Stage 6: the actuator's ends, from the fit runs."""

from collections.abc import Mapping
from dataclasses import asdict, replace
from typing import Any

import numpy as np
import xarray as xr

from calibration.ends import PARAMETERS, Ends, fit_compliance, fit_ends
from calibration.from_design.near_law import NearLaw
from calibration.sweep import usual_end_compliance
from calibration.truth import TruthError, free_states
from fem_reference import Design
from rodmodel import Calibration, Domain

# Fitted compliances beyond this multiple of the usual one are taken for a failed fit.
_MOST = 4.0
# Fewest fit runs: each is left out once, to tell the ends' error.
_FEWEST = 2
_NAMES = (*PARAMETERS, "base_stiffness", "tip_draw", "held_length", "shear_compliance")


def end_compliance(design: Design, runs: xr.Dataset) -> dict[str, Any]:
    """Return the compliance of the ends for the cells of a sweep, with its origin.

    It is the design's own; else it is fitted to the curvature in the middle of the fit runs; else, if they
    tell none, it is that of similar actuators.

    Parameters
    ----------
    design : actuator.
    runs : of the full actuator.
    """
    if design.end_compliance is not None:
        return {"value": design.end_compliance, "from": "the design"}
    usual = usual_end_compliance(design)
    try:
        found = fit_compliance(runs, design.geometry.body_length, usual)
    except TruthError:
        return {"value": usual, "from": "similar actuators"}
    if 0.0 <= found.value <= _MOST * usual:
        return {"value": found.value, "from": "the runs", "fit": asdict(found)}
    return {"value": usual, "from": "similar actuators", "fit": asdict(found)}


def ends_of(design: Design, runs: xr.Dataset, compliance: float, domain: Domain) -> Ends | None:
    """Return the ends that fit the runs' states in a law's domain, see `fit_ends`.

    Beyond it the section has given way, and ends would be fitted to what it does there. None with states of
    fewer than two fit runs.
    """
    geometry = design.geometry
    inside = np.asarray(domain.covers_pressure(runs["pressure"].values.T))
    usable = free_states(runs) & (runs["role"].values == "fit") & inside
    if len(set(runs["case"].values[usable])) < _FEWEST:
        return None
    return fit_ends(runs.isel(state=usable), geometry.body_length, geometry.cap_length, compliance)


def with_ends(
    calibration: Calibration,
    ends: Ends | None,
    near: NearLaw | None,
    compliance: Mapping[str, Any],
    note: Mapping[str, Any],
) -> Calibration:
    """Return a calibration with its ends.

    No run has a tip force, so the shear compliance is that of the most similar shipped calibration, scaled.

    Parameters
    ----------
    calibration : law without ends.
    ends : fitted ends; without them all are those of the most similar shipped calibration.
    near : most similar shipped calibration.
    compliance : of the ends in the cell, with its origin.
    note : more of the ends' provenance.
    """
    its = {} if near is None else {name: getattr(near.calibration.actuator, name) for name in _NAMES}
    actuator = replace(calibration.actuator, **{**its, **({} if ends is None else ends.values)})
    errors = dict(calibration.error)
    told: dict[str, Any] = {**note, "compliance": dict(compliance)}
    if near is not None:
        told["from_shipped"] = {
            "layout": near.title,
            "names": [*_NAMES] if ends is None else ["shear_compliance"],
        }
    if ends is not None:
        errors["actuator_angle_rad"] = {
            "median": ends.angle_median,
            "p90": ends.angle_p90,
            "worst": ends.angle_worst,
        }
        told |= asdict(ends)
    provenance = {**calibration.provenance, "ends": told}
    return replace(calibration, actuator=actuator, error=errors, provenance=provenance, bound=None)
