"""Cosserat rod of a soft pneumatic actuator, calibrated from 3D finite elements."""

from rodmodel._inverse import Inverse
from rodmodel._load import CalibrationNotFoundError, load, shipped_calibrations
from rodmodel._record import CalibrationFileError
from rodmodel._rod import Rod
from rodmodel._solution import Solution
from rodmodel.calibration_file import (
    Actuator,
    Calibration,
    Domain,
    Layout,
    read_calibration,
    save_calibration,
)
from rodmodel.section import CurvatureLaw, FreeStateExpansion, QuarticLaw, SectionLaw, TurnedLaw

__all__ = [
    "Actuator",
    "Calibration",
    "CalibrationFileError",
    "CalibrationNotFoundError",
    "CurvatureLaw",
    "Domain",
    "FreeStateExpansion",
    "Inverse",
    "Layout",
    "QuarticLaw",
    "Rod",
    "SectionLaw",
    "Solution",
    "TurnedLaw",
    "load",
    "read_calibration",
    "save_calibration",
    "shipped_calibrations",
]
