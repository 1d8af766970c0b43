"""The section of a compiled rod, and its rod in other actuators, for tests of the core."""

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from rodmodel import Calibration, CoreRod
from rodmodel.core import Handle, ffi, law_data


class Section(NamedTuple):
    """Per length: potential [J/m], moment [N m], stiffness [N m²], chamber volumes [m²]."""

    energy: float
    moment: np.ndarray
    stiffness: np.ndarray
    volume: np.ndarray


def section_at(handle: Handle, curvature: np.ndarray, pressure: np.ndarray) -> Section:
    """Section at a curvature [1/m] and pressures [Pa]."""
    found = ffi.new("rm_section *")
    numbers = (ffi.new("rm_real[3]", list(values)) for values in (curvature, pressure))
    assert handle.call.rm_section_at(handle.rod, *numbers, handle.workspace(1), found) == 0
    return Section(
        found.energy,
        np.array(list(found.moment)),
        np.array(list(found.stiffness)).reshape(3, 3),
        np.array(list(found.volume)),
    )


def rod_with(calibration: Calibration, **ends: float) -> CoreRod:
    """Rod of a calibration of one ψ, some of its actuator's numbers replaced."""
    actuator = replace(calibration.actuator, **ends)
    handle = Handle(law_data(calibration.law), actuator, calibration.domain, calibration.error_bound)
    return CoreRod(handle, actuator, calibration.domain, calibration.error_bound)
