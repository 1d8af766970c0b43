"""The calibration file of an actuator of one's own: a map and what its measurements say of it."""

from importlib.resources import files
from pathlib import Path
from typing import Any

from calibration.fit import narrowed
from calibration.measured.adjusted_law import adjustment_of
from calibration.measured.fit import MeasuredFit
from calibration.measured.held_out import angle_errors, error_figures
from rodmodel import Calibration, read_calibration
from rodmodel.io import Found, OuterWall, adjusted


def calibration_of_fit(
    found: Found, fit: MeasuredFit, wall: OuterWall, provenance: dict[str, Any]
) -> Calibration:
    """Make the calibration; everything that takes calibrations takes it.

    Parameters
    ----------
    found : the map that was adjusted.
    fit : to the measurements.
    wall : the outer wall that the wall variation counts in.
    provenance : of the fit.

    Returns
    -------
    calibration : its domain is in pressures as they are read, and ends where the law is not stable; its error
        is of the measured states, each left out of the fit, and at least that of the map.

    Raises
    ------
    ValueError
        Where the measurements say nothing of the bending angle, or no pressures are left inside the map.
    """
    measured, body = fit.repeats.measured, float(found.calibration.actuator.bending_length)
    figures = error_figures(angle_errors(fit.held_out, fit.angle, measured, body))
    made = adjusted(found, adjustment_of(fit.parameters, wall), {"measured_angle_rad": figures}, provenance)
    return Calibration(
        layout=made.layout,
        actuator=made.actuator,
        law=made.law,
        domain=narrowed(made.section_law, made.domain),
        error=made.error,
        provenance=made.provenance,
    )


def file_of_map(found: Found, given: str | None) -> Path:
    """The file of a map: the one that was given, or of those that ship the one that serves."""
    if given is not None:
        return Path(given)
    folder = Path(str(files("rodmodel"))) / "calibrations"
    layout = found.calibration.layout
    return next(file for file in sorted(folder.glob("*.json")) if read_calibration(file).layout == layout)
