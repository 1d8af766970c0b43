"""Calibration file of a measured actuator: a map with its adjustment."""

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
    """Build the calibration of a measured actuator.

    Parameters
    ----------
    found : map that was adjusted.
    fit : fit to the measurements.
    wall : outer wall to which the wall variation refers.
    provenance : provenance of the fit.

    Returns
    -------
    calibration : with a domain of pressure readings in which the law is stable, and an error from
        leave-one-out residuals of the measured states, at least that of the map.

    Raises
    ------
    ValueError
        If the measurements do not determine the bending angle, or no pressures are left inside the map.
    """
    measured, body = fit.repeats.measured, float(found.calibration.actuator.bending_length)
    figures = error_figures(angle_errors(fit.held_out, fit.angle, measured, body))
    made = adjusted(found, adjustment_of(fit.parameters, wall), {"measured_angle_rad": figures}, provenance)
    return Calibration(
        layout=made.layout,
        actuator=made.actuator,
        law=made.law,
        domain=narrowed(made.section_law, made.domain),
        bound=made.bound,
        error=made.error,
        provenance=made.provenance,
    )


def file_of_map(found: Found, given: str | None) -> Path:
    """Return the file of a map: the given one, or the shipped one of its layout."""
    if given is not None:
        return Path(given)
    folder = Path(str(files("rodmodel"))) / "calibrations"
    layout = found.calibration.layout
    return next(file for file in sorted(folder.glob("*.json")) if read_calibration(file).layout == layout)
