"""Choice of a calibration for a winding layout, and rods from it, compiled or differentiable."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, final

from rodmodel.actuator import Actuator, Domain, Layout, Number
from rodmodel.error_bound import ErrorBound
from rodmodel.io.calibration_file import Calibration, read_calibration
from rodmodel.io.calibration_text import calibration_record, layout_text
from rodmodel.io.snapped import SnappedLaw, snapped_bound, snapped_ends

if TYPE_CHECKING:
    import rodmodel.control
    import rodmodel.core
    import rodmodel.rod

_SHIPPED = Path(__file__).parents[1] / "calibrations"

# Images of a section that is the same: turns by 120° after a mirror image, by its law's symmetry.
_IMAGES = {
    "none": ((0, False),),
    "mirror": ((0, False), (0, True)),
    "full": tuple((turns, mirrored) for mirrored in (False, True) for turns in range(3)),
}
# Largest difference between equal orientations [rad] and equal pitches [m]: a change of units rounds.
_SAME = 1e-9
# Largest orientation [rad]: more than a turn, and less than most angles in degrees.
_MOST_PSI = 8.0


class CalibrationNotFoundError(ValueError):
    """No calibration for a layout: `argument` does not fit, `expected` lists the available ones."""

    def __init__(self, argument: str, value: str, expected: str) -> None:
        self.argument = argument
        self.expected = expected
        super().__init__(f"{argument}: got {value}, expected {expected}")


@final
@dataclass(frozen=True, eq=False)
class Found:
    """Calibration that serves a layout, and the relation of the layout's section to the calibrated one.

    Attributes
    ----------
    calibration : calibration that serves the layout.
    psi : requested orientation [rad].
    turns : turn of the section from the calibrated one in units of 120°, 0, 1 or 2: chamber 1 + `turns` is
        chamber 1 of the calibration.
    mirrored : whether the section, before that turn, is the mirror image y → −y of the calibrated one.
    domain : the calibration's domain, with the chambers numbered as in the section.
    """

    calibration: Calibration
    psi: float
    turns: int
    mirrored: bool
    domain: Domain


def shipped_calibrations() -> list[Calibration]:
    """Return the calibrations that come with the package."""
    return [read_calibration(file) for file in sorted(_SHIPPED.glob("*.json"))]


def load(
    layout: str, psi: float = 0.0, pitch: float = 3e-3, path: str | Path | None = None
) -> "rodmodel.rod.Rod":
    """Return the differentiable rod of a winding layout from its calibration; imports JAX.

    A calibration at one ψ serves ψ ± 120°, which only renumbers the chambers, and for the double helix ψ +
    180°, which is a shift by half a pitch: together, all multiples of 60° from ψ. It serves −ψ as well, the
    section's mirror image, in which chambers 2 and 3 are swapped. Other orientations need a calibration of
    all orientations; see `load_oriented`.

    Parameters
    ----------
    layout : name of the winding layout, as in "double-helix".
    psi : azimuth ψ of a crossing of the winding from the centre of chamber 1 [rad].
    pitch : pitch of the winding [m].
    path : calibration file to use instead of the shipped ones.

    Returns
    -------
    rod : rod of the layout.

    Raises
    ------
    ValueError
        If no calibration fits, with a message that lists the available ones, or the file at `path` cannot be
        used.
    """
    found = find(layout, psi, pitch, path)
    from rodmodel.rod import OrientedRod, Rod
    from rodmodel.section import MirroredLaw, OrientedNetwork, SectionLaw, TurnedLaw

    calibration, law = found.calibration, found.calibration.section_law
    if isinstance(law, OrientedNetwork):
        return OrientedRod(law, calibration.actuator, found.domain, calibration.error_bound).at_psi(psi)
    section: SectionLaw = MirroredLaw(law) if found.mirrored else law
    if found.turns:
        section = TurnedLaw(section, found.turns)
    return Rod(section, calibration.actuator, found.domain, calibration.error_bound)


def load_core(
    layout: str, psi: float = 0.0, pitch: float = 3e-3, path: str | Path | None = None
) -> "rodmodel.core.CoreRod":
    """Return the compiled rod of a winding layout: NumPy arrays in and out, microseconds a solve, no JAX.

    Arguments, errors and the choice of the calibration are those of `load`.
    """
    found = find(layout, psi, pitch, path)
    from rodmodel.core import CoreRod

    return CoreRod.of(found)


def load_branches(
    layout: str, psi: float = 0.0, pitch: float = 3e-3, path: str | Path | None = None
) -> "rodmodel.control.Branches":
    """Return the compiled rods of all branches of a winding layout that its calibration knows.

    Arguments, errors and the choice of the calibration are those of `load`.
    """
    return branches_of(find(layout, psi, pitch, path))


def branches_of(found: Found) -> "rodmodel.control.Branches":
    """Return the compiled rods of all branches that a calibration knows."""
    from rodmodel.control import Branch, Branches
    from rodmodel.core import CoreRod

    snapped = {Branch(sheet.chamber, sheet.side): CoreRod.of_sheet(sheet) for sheet in snapped_sheets(found)}
    return Branches(CoreRod.of(found), snapped)


def load_oriented(
    layout: str, pitch: float = 3e-3, path: str | Path | None = None
) -> "rodmodel.rod.OrientedRod":
    """Return the rods of all orientations ψ of a winding layout, from a calibration of all; imports JAX.

    Parameters
    ----------
    layout : name of the winding layout, as in "double-helix".
    pitch : pitch of the winding [m].
    path : calibration file to use instead of the shipped ones.

    Returns
    -------
    rods : rods of all orientations; `at_psi` returns the rod of one, differentiable by ψ.

    Raises
    ------
    ValueError
        If no calibration fits, with a message that lists the available ones, or the file at `path` cannot be
        used.
    """
    known = _known(path)
    calibration = _oriented(_of_layout(known, layout, pitch))
    if calibration is None:
        raise CalibrationNotFoundError("layout", f"{layout!r} at any psi", _in_words(known))
    from rodmodel.rod import OrientedRod
    from rodmodel.section import OrientedNetwork

    law = calibration.section_law
    assert isinstance(law, OrientedNetwork)
    return OrientedRod(law, calibration.actuator, calibration.domain, calibration.error_bound)


@final
@dataclass(frozen=True, eq=False)
class SnappedSheet:
    """Law of a snapped branch and the relation of the rod's section to the one that it was fitted to.

    Attributes
    ----------
    chamber, side : of the rod's section; see `rodmodel.control.Branch`.
    law : the law.
    turns, mirrored : see `Found`.
    domain : the law's domain, with the chambers numbered as in the rod's section.
    bound : bound of the errors.
    actuator : dimensions and ends; see `snapped_ends`.
    """

    chamber: int
    side: int
    law: SnappedLaw
    turns: int
    mirrored: bool
    domain: Domain
    bound: ErrorBound
    actuator: Actuator


def snapped_sheets(found: Found) -> tuple[SnappedSheet, ...]:
    """Return the snapped branches of a layout: the calibration's, and their images by symmetry."""
    sheets: dict[tuple[int, int], SnappedSheet] = {}
    bound, actuator = snapped_bound(found.calibration.snapped), snapped_ends(found.calibration.actuator)
    for law in found.calibration.snapped:
        for turns, mirrored in _IMAGES[found.calibration.law.symmetry]:
            # First the section's own image, then the one that the layout asks for.
            turn = found.turns + (-turns if found.mirrored else turns)
            turn, flipped = turn % 3, mirrored != found.mirrored
            place = (1 - law.chamber if flipped else law.chamber - 1) + turn
            key = (place % 3 + 1, -law.side if flipped else law.side)
            domain = _renumbered(law.domain, turn, flipped)
            sheets.setdefault(key, SnappedSheet(*key, law, turn, flipped, domain, bound, actuator))
    return tuple(sheets.values())


def find(layout: str, psi: float, pitch: float, path: str | Path | None = None) -> Found:
    """Find the calibration that serves a layout; see `load` for the choice and the errors."""
    _check(psi, pitch)
    return find_among(_known(path), layout, psi, pitch)


def find_among(known: Sequence[Calibration], layout: str, psi: float, pitch: float) -> Found:
    """Find the calibration that serves a layout among given ones; see `load`."""
    _check(psi, pitch)
    of_layout = _of_layout(known, layout, pitch)
    for calibration in of_layout:
        own = calibration.layout.psi
        if own is None:
            continue
        # An individual actuator's law holds for it alone, not for its mirror image.
        for mirrored in (False,) if calibration.law.is_adjusted else (False, True):
            turns = _turns(calibration.layout, -own if mirrored else own, psi)
            if turns is not None:
                domain = _renumbered(calibration.domain, turns, mirrored)
                return Found(calibration, psi, turns, mirrored, domain)
    of_all = _oriented(of_layout)
    if of_all is None:
        raise CalibrationNotFoundError("psi", f"{psi} rad", _in_words(known))
    return Found(of_all, psi, 0, False, of_all.domain)


def _check(psi: float, pitch: float) -> None:
    if not math.isfinite(psi):
        raise ValueError(f"psi: got {psi}, expected a finite angle [rad]")
    if abs(psi) > _MOST_PSI:
        raise ValueError(
            f"psi: got {psi:g} rad, expected {-_MOST_PSI:g} to {_MOST_PSI:g} rad; is it in degrees?"
        )
    if not (math.isfinite(pitch) and pitch > 0.0):
        raise ValueError(f"pitch: got {pitch}, expected a positive length [m]")


def _known(path: str | Path | None) -> list[Calibration]:
    return shipped_calibrations() if path is None else [read_calibration(path)]


def _of_layout(known: Sequence[Calibration], layout: str, pitch: float) -> list[Calibration]:
    of_layout = [c for c in known if c.layout.name == layout]
    if not of_layout:
        raise CalibrationNotFoundError("layout", repr(layout), _in_words(known))
    of_pitch = [c for c in of_layout if abs(c.layout.pitch - pitch) < _SAME]
    if not of_pitch:
        raise CalibrationNotFoundError("pitch", f"{pitch} m", _in_words(known))
    return of_pitch


def _in_words(known: Sequence[Calibration]) -> str:
    texts = [layout_text(calibration_record(calibration)) for calibration in known]
    return "; ".join(texts) or "a path: no calibration ships with this installation"


def _oriented(calibrations: Sequence[Calibration]) -> Calibration | None:
    return next((c for c in calibrations if c.layout.psi is None), None)


def _renumbered(domain: Domain, turns: int, mirrored: bool) -> Domain:
    """Return the domain of the section that is mirrored and then turned."""

    def turned(three: tuple[Number, Number, Number]) -> tuple[Number, Number, Number]:
        first, second, third = three
        own = (first, third, second) if mirrored else three
        # Chamber 1 + turns of the section is chamber 1 of the calibration.
        return own[-turns], own[1 - turns], own[2 - turns]

    return replace(
        domain,
        pressure_max=turned(domain.pressure_max),
        pressure_min=turned(domain.pressure_min),
        single_max=turned(domain.single_max),
    )


def _turns(layout: Layout, start: float, psi: float) -> int | None:
    """Return the number of turns by 120° from one orientation to ψ; None if no number fits."""
    for turns in range(3):
        difference = math.remainder(psi - start - turns * 2.0 * math.pi / 3.0, 3.0 * layout.symmetry)
        if abs(difference) < _SAME:
            return turns
    return None
