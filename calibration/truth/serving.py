"""Which shipped calibration serves a run of the full actuator."""

from collections.abc import Sequence

from calibration.truth.cases import layout_of
from calibration.truth.dataset import case_of
from rodmodel import Calibration, CalibrationNotFoundError
from rodmodel.io import Found, find_among


def serving(case: str, shipped: Sequence[Calibration]) -> Found | None:
    """Return the one of the shipped calibrations that serves a case's winding, or None."""
    layout = layout_of(case_of(case).winding)
    try:
        return find_among(shipped, layout.name, layout.psi or 0.0, layout.pitch)
    except CalibrationNotFoundError:
        return None
