"""Former place of the calibration file's classes, kept for one release; `rodmodel` has them."""

import warnings

from rodmodel.actuator import Actuator as Actuator
from rodmodel.actuator import Domain as Domain
from rodmodel.actuator import Layout as Layout
from rodmodel.io import Calibration as Calibration
from rodmodel.io import CalibrationFileError as CalibrationFileError
from rodmodel.io import read_calibration as read_calibration
from rodmodel.io import save_calibration as save_calibration

warnings.warn(
    "rodmodel.calibration_file leaves in the next release: import its names from rodmodel",
    DeprecationWarning,
    stacklevel=2,
)
