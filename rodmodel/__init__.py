"""Cosserat rod of a soft pneumatic actuator, calibrated from 3D finite elements.

A name is imported at its first use: the compiled rod (`load_core`) needs no JAX, the differentiable one
(`load`, `Rod`, the section laws) does.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from rodmodel.actuator import Actuator as Actuator
    from rodmodel.actuator import Domain as Domain
    from rodmodel.actuator import Layout as Layout
    from rodmodel.control import Branch as Branch
    from rodmodel.control import Branches as Branches
    from rodmodel.control import BranchSolution as BranchSolution
    from rodmodel.control import Inverse as Inverse
    from rodmodel.control import Prediction as Prediction
    from rodmodel.control import Predictor as Predictor
    from rodmodel.control import TipJacobian as TipJacobian
    from rodmodel.core import CoreRod as CoreRod
    from rodmodel.core import CoreSolution as CoreSolution
    from rodmodel.error_bound import ErrorBound as ErrorBound
    from rodmodel.io import Calibration as Calibration
    from rodmodel.io import CalibrationFileError as CalibrationFileError
    from rodmodel.io import CalibrationNotFoundError as CalibrationNotFoundError
    from rodmodel.io import load as load
    from rodmodel.io import load_branches as load_branches
    from rodmodel.io import load_core as load_core
    from rodmodel.io import load_oriented as load_oriented
    from rodmodel.io import read_calibration as read_calibration
    from rodmodel.io import save_calibration as save_calibration
    from rodmodel.io import shipped_calibrations as shipped_calibrations
    from rodmodel.rod import Jacobian as Jacobian
    from rodmodel.rod import OrientedRod as OrientedRod
    from rodmodel.rod import PoseDerivative as PoseDerivative
    from rodmodel.rod import Rod as Rod
    from rodmodel.rod import stack as stack
    from rodmodel.section import CurvatureLaw as CurvatureLaw
    from rodmodel.section import LinearLaw as LinearLaw
    from rodmodel.section import MirroredLaw as MirroredLaw
    from rodmodel.section import OrientedNetwork as OrientedNetwork
    from rodmodel.section import RidgeLaw as RidgeLaw
    from rodmodel.section import RidgeNetwork as RidgeNetwork
    from rodmodel.section import SectionLaw as SectionLaw
    from rodmodel.section import TurnedLaw as TurnedLaw
    from rodmodel.section import unfolded as unfolded
    from rodmodel.statics import RESULTS as RESULTS
    from rodmodel.statics import Adaptive as Adaptive
    from rodmodel.statics import FixedStep as FixedStep
    from rodmodel.statics import Solution as Solution

__all__ = [
    "RESULTS",
    "Actuator",
    "Adaptive",
    "Branch",
    "BranchSolution",
    "Branches",
    "Calibration",
    "CalibrationFileError",
    "CalibrationNotFoundError",
    "CoreRod",
    "CoreSolution",
    "CurvatureLaw",
    "Domain",
    "ErrorBound",
    "FixedStep",
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
    "RidgeLaw",
    "RidgeNetwork",
    "Rod",
    "SectionLaw",
    "Solution",
    "TipJacobian",
    "TurnedLaw",
    "load",
    "load_branches",
    "load_core",
    "load_oriented",
    "read_calibration",
    "save_calibration",
    "shipped_calibrations",
    "stack",
    "unfolded",
]

_HOMES = {
    "rodmodel.actuator": (
        "Actuator",
        "Domain",
        "Layout",
    ),
    "rodmodel.control": (
        "Branch",
        "BranchSolution",
        "Branches",
        "Inverse",
        "Prediction",
        "Predictor",
        "TipJacobian",
    ),
    "rodmodel.core": (
        "CoreRod",
        "CoreSolution",
    ),
    "rodmodel.error_bound": ("ErrorBound",),
    "rodmodel.io": (
        "Calibration",
        "CalibrationFileError",
        "CalibrationNotFoundError",
        "load",
        "load_branches",
        "load_core",
        "load_oriented",
        "read_calibration",
        "save_calibration",
        "shipped_calibrations",
    ),
    "rodmodel.rod": (
        "Jacobian",
        "OrientedRod",
        "PoseDerivative",
        "Rod",
        "stack",
    ),
    "rodmodel.section": (
        "CurvatureLaw",
        "LinearLaw",
        "MirroredLaw",
        "OrientedNetwork",
        "RidgeLaw",
        "RidgeNetwork",
        "SectionLaw",
        "TurnedLaw",
        "unfolded",
    ),
    "rodmodel.statics": (
        "RESULTS",
        "Adaptive",
        "FixedStep",
        "Solution",
    ),
}
_HOME = {name: home for home, names in _HOMES.items() for name in names}
_GONE = ("FreeStateExpansion", "QuarticLaw")


def __getattr__(name: str) -> Any:
    if name in _HOME:
        value = getattr(import_module(_HOME[name]), name)
        globals()[name] = value  # later uses skip this function
        return value
    if name in _GONE:
        raise AttributeError(
            f"rodmodel.{name} left in this release, as no calibration used it; RidgeNetwork is the fitted law"
        )
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
