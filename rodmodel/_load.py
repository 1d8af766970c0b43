"""Find a calibration, shipped or given, and make a rod of it."""

import math
from dataclasses import replace
from pathlib import Path
from typing import cast

from rodmodel._oriented_rod import OrientedRod
from rodmodel._report import calibration_record, layout_text
from rodmodel._rod import Rod
from rodmodel.calibration_file import Calibration, Layout, read_calibration
from rodmodel.section import MirroredLaw, OrientedNetwork, SectionLaw, TurnedLaw

_SHIPPED = Path(__file__).parent / "calibrations"

# Orientations and pitches that are equal but for the rounding of a change of units are equal [rad, m].
_SAME = 1e-9


class CalibrationNotFoundError(ValueError):
    """No calibration for a layout: `argument` does not fit, `expected` says in words what there is."""

    def __init__(self, argument: str, came: str, expected: str) -> None:
        self.argument = argument
        self.expected = expected
        super().__init__(f"{argument}: got {came}, expected {expected}")


def shipped_calibrations() -> list[Calibration]:
    """Calibrations that come with the package."""
    return [read_calibration(file) for file in sorted(_SHIPPED.glob("*.json"))]


def load(layout: str, psi: float = 0.0, pitch: float = 3e-3, path: str | Path | None = None) -> Rod:
    """Make the rod of a winding layout from its calibration.

    A calibration at one ψ serves ψ ± 120°, which only renumbers the chambers, and for the double helix ψ +
    180°, which is a shift by half a pitch: all multiples of 60° from it. It serves −ψ as well, the section's
    mirror image, in which chambers 2 and 3 are swapped. Other orientations are taken from a calibration of
    all of them, where there is one; see `load_oriented`.

    Parameters
    ----------
    layout : name of the winding layout, as in "double-helix".
    psi : azimuth ψ of a crossing of the winding from the centre of chamber 1 [rad].
    pitch : of the winding [m].
    path : calibration file to take in place of those that ship.

    Returns
    -------
    rod : ready to solve.

    Raises
    ------
    ValueError
        Where there is no such calibration; the message says what there is. Where the file at `path` cannot
        be used.
    """
    if not math.isfinite(psi):
        raise ValueError(f"psi: got {psi}, expected a finite angle [rad]")
    if not (math.isfinite(pitch) and pitch > 0.0):
        raise ValueError(f"pitch: got {pitch}, expected a positive length [m]")
    found, expected = _calibrations(layout, pitch, path)
    of_one = [(c, c.layout.psi) for c in found if c.layout.psi is not None]
    for calibration, own in of_one:
        for mirrored in (False, True):
            turns = _turns(calibration.layout, -own if mirrored else own, psi)
            if turns is not None:
                return _rod(calibration, turns, mirrored)
    oriented = _oriented(found)
    if oriented is None:
        raise CalibrationNotFoundError("psi", f"{psi} rad", expected)
    return oriented.at_psi(psi)


def load_oriented(layout: str, pitch: float = 3e-3, path: str | Path | None = None) -> OrientedRod:
    """Make the rods of all orientations ψ of a winding layout, from a calibration of all of them.

    Parameters
    ----------
    layout : name of the winding layout, as in "double-helix".
    pitch : of the winding [m].
    path : calibration file to take in place of those that ship.

    Returns
    -------
    rods : whose `at_psi` gives the rod of an orientation, differentiable in it.

    Raises
    ------
    ValueError
        Where there is no such calibration; the message says what there is. Where the file at `path` cannot
        be used.
    """
    found, expected = _calibrations(layout, pitch, path)
    oriented = _oriented(found)
    if oriented is None:
        raise CalibrationNotFoundError("layout", f"{layout!r} at any psi", expected)
    return oriented


def _calibrations(layout: str, pitch: float, path: str | Path | None) -> tuple[list[Calibration], str]:
    """Calibrations of a layout and pitch, and what there is in words."""
    known = shipped_calibrations() if path is None else [read_calibration(path)]
    expected = (
        "; ".join(layout_text(calibration_record(c)) for c in known)
        or "a path: no calibration ships with this installation"
    )
    of_layout = [c for c in known if c.layout.name == layout]
    if not of_layout:
        raise CalibrationNotFoundError("layout", repr(layout), expected)
    of_pitch = [c for c in of_layout if abs(c.layout.pitch - pitch) < _SAME]
    if not of_pitch:
        raise CalibrationNotFoundError("pitch", f"{pitch} m", expected)
    return of_pitch, expected


def _oriented(calibrations: list[Calibration]) -> OrientedRod | None:
    for c in calibrations:
        if isinstance(c.section_law, OrientedNetwork):
            return OrientedRod(c.section_law, c.actuator, c.domain, c.angle_error)
    return None


def _rod(calibration: Calibration, turns: int, mirrored: bool) -> Rod:
    law = cast(SectionLaw, calibration.section_law)
    largest = calibration.domain.pressure_max
    if mirrored:
        law, largest = MirroredLaw(law), (largest[0], largest[2], largest[1])
    if turns:
        # Chamber 1 + turns of the rod is chamber 1 of the calibration.
        law, largest = TurnedLaw(law, turns), (largest[-turns], largest[1 - turns], largest[2 - turns])
    domain = replace(calibration.domain, pressure_max=largest)
    return Rod(law, calibration.actuator, domain, calibration.angle_error)


def _turns(layout: Layout, start: float, psi: float) -> int | None:
    """Turns by 120° that take the section at an orientation to the orientation ψ; None for none."""
    for turns in range(3):
        left = math.remainder(psi - start - turns * 2.0 * math.pi / 3.0, 3.0 * layout.symmetry)
        if abs(left) < _SAME:
            return turns
    return None
