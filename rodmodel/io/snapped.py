"""Laws of the section after partition walls have snapped to one side, as parts of a calibration file.

"snapped": [{"chamber": 1, 2 or 3, "side": 1 or -1, "section_law": {...}, "domain": {..., with
"pressure_min_pa"}, "error": {...}, "provenance": {...}}, ...]
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, final

from rodmodel.actuator import Actuator, Domain
from rodmodel.error_bound import ErrorBound
from rodmodel.io.json_record import Record
from rodmodel.io.law_arrays import RidgeArrays
from rodmodel.io.law_record import domain_content, domain_of, law_content, law_of

_MOST = 6


@final
@dataclass(frozen=True, eq=False)
class SnappedLaw:
    """Law of one snapped sheet.

    Attributes
    ----------
    chamber : number of the chamber with the high pressure, from 1.
    side : +1 if the bending plane's angle γ is larger than that of the upright section, −1 if smaller.
    law : section law as plain arrays.
    domain : loads inside which the law was calibrated; the least pressures are where the sheet ends.
    error, provenance : as in the file. `error` has the errors at held-out states of the cell, and under
        ``actuator`` the largest against runs of the full actuator: ``angle_rad``, ``plane_rad``, ``tip_m``
        and the number of ``states``.
    """

    chamber: int
    side: int
    law: RidgeArrays
    domain: Domain
    error: Mapping[str, Any]
    provenance: Mapping[str, Any]


def snapped_bound(laws: Sequence[SnappedLaw]) -> ErrorBound:
    """Return the bound of the errors on all snapped branches of a calibration.

    It is the largest against runs of the full actuator and, of θ, against held-out cells. A sheet has a run
    or two, which tell nothing of it alone; the walls snap in the same way on all of them. Without any run the
    bound says nothing, half a turn.
    """
    runs = [law.error["actuator"] for law in laws if "actuator" in law.error]
    if not runs:
        return ErrorBound.constant(math.pi)
    cells = [law.error["free_bending_angle_rad"] for law in laws if "free_bending_angle_rad" in law.error]
    angle = max(float(value) for value in [*(r["angle_rad"] for r in runs), *(c["worst"] for c in cells)])
    return ErrorBound((0.0,), (angle,), (max(float(run["tip_m"]) for run in runs),))


def snapped_ends(actuator: Actuator) -> Actuator:
    """Return an actuator with the ends of a snapped branch.

    The growth of the base and the draw of the cap are those of sections that stand upright. Most runs of the
    full actuator that jumped are nearer without them, those too that had no part in that choice: see
    `docs/notes/calibration.md`.
    """
    return replace(actuator, base_growth=0.0, tip_draw=0.0)


def snapped_content(laws: tuple[SnappedLaw, ...]) -> list[dict[str, Any]]:
    """Return the laws for JSON."""
    return [
        {
            "chamber": law.chamber,
            "side": law.side,
            "section_law": law_content(law.law),
            "domain": domain_content(law.domain),
            "error": dict(law.error),
            "provenance": dict(law.provenance),
        }
        for law in laws
    ]


def snapped_of(record: Record) -> tuple[SnappedLaw, ...]:
    """Return the laws of a file's record, none if it has none."""
    laws = record.each("snapped", _MOST, "chamber and side", _snapped)
    if len({(law.chamber, law.side) for law in laws}) < len(laws):
        raise record.error("snapped", "one chamber and side twice", "one object for each chamber and side")
    return laws


def _snapped(record: Record) -> SnappedLaw:
    law = law_of(record.record("section_law"))
    if law.is_oriented or law.is_adjusted:
        raise record.error("section_law", "a law of another kind", "a ridge-network")
    return SnappedLaw(
        chamber=record.take("chamber", "1, 2 or 3", lambda value: type(value) is int and value in (1, 2, 3)),
        side=record.take("side", "1 or -1", lambda value: type(value) is int and value in (-1, 1)),
        law=law,
        domain=domain_of(record.record("domain")),
        error=_error(record.record("error")),
        provenance=record.record("provenance").content,
    )


def _error(record: Record) -> dict[str, Any]:
    """Return the errors of a sheet; those that its bound is made of are checked."""
    if "free_bending_angle_rad" in record.content:
        record.record("free_bending_angle_rad").number("worst")
    if "actuator" in record.content:
        actuator = record.record("actuator")
        for figure in ("angle_rad", "tip_m"):
            actuator.number(figure)
    return record.content
