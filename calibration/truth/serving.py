"""Which shipped calibration serves a run of the full actuator."""

from calibration.truth.cases import layout_of
from calibration.truth.dataset import case_of
from rodmodel import CalibrationNotFoundError
from rodmodel.io import Found, find


def serving(case: str) -> Found | None:
    """Return the calibration of a case's winding, or None."""
    layout = layout_of(case_of(case).winding)
    try:
        return find(layout.name, layout.psi or 0.0, layout.pitch)
    except CalibrationNotFoundError:
        return None
