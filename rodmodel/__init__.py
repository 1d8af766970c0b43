"""Cosserat rod of a soft pneumatic actuator, calibrated from 3D finite elements."""

from rodmodel._equilibria import Adaptive, FixedStep
from rodmodel._inverse import Inverse
from rodmodel._jacobian import Jacobian, PoseDerivative
from rodmodel._load import CalibrationNotFoundError, load, load_oriented, shipped_calibrations
from rodmodel._oriented_rod import OrientedRod
from rodmodel._predictor import Prediction, Predictor, TipJacobian
from rodmodel._record import CalibrationFileError
from rodmodel._rod import Rod
from rodmodel._solution import RESULTS, Solution
from rodmodel._stack import stack
from rodmodel.calibration_file import (
    Actuator,
    Calibration,
    Domain,
    Layout,
    read_calibration,
    save_calibration,
)
from rodmodel.section import (
    CurvatureLaw,
    FreeStateExpansion,
    LinearLaw,
    MirroredLaw,
    OrientedNetwork,
    QuarticLaw,
    RidgeLaw,
    RidgeNetwork,
    SectionLaw,
    TurnedLaw,
    unfolded,
)

__all__ = [
    "RESULTS",
    "Actuator",
    "Adaptive",
    "Calibration",
    "CalibrationFileError",
    "CalibrationNotFoundError",
    "CurvatureLaw",
    "Domain",
    "FixedStep",
    "FreeStateExpansion",
    "Inverse",
    "Jacobian",
    "Layout",
    "LinearLaw",
    "MirroredLaw",
    "OrientedNetwork",
    "OrientedRod",
    "PoseDerivative",
    "Prediction",
    "Predictor",
    "QuarticLaw",
    "RidgeLaw",
    "RidgeNetwork",
    "Rod",
    "SectionLaw",
    "Solution",
    "TipJacobian",
    "TurnedLaw",
    "load",
    "load_oriented",
    "read_calibration",
    "save_calibration",
    "shipped_calibrations",
    "stack",
    "unfolded",
]
