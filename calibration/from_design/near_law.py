"""The shipped calibration that is most like a design, scaled to it."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from calibration.similar import scaled
from fem_reference import (
    ActuatorGeometry,
    Core,
    Design,
    DoubleHelix,
    Ogden,
    Similarity,
    Thread,
    layout,
    parse_design,
    similarity,
)
from rodmodel import Calibration, shipped_calibrations

# Relative difference of a layout by name: more than any of a number.
_ANOTHER = 10.0


@dataclass(frozen=True)
class NearLaw:
    """A shipped calibration, scaled to a design.

    Parameters
    ----------
    calibration : scaled; its pitch and ψ are its own.
    title : layout of the shipped one.
    deviations : relative differences of the design from it, by name.
    """

    calibration: Calibration
    title: str
    deviations: Mapping[str, float]

    @property
    def distance(self) -> float:
        """Root of the sum of the squared differences; another layout counts most."""
        return _distance(self.deviations)


def near_laws(design: Design, known: Sequence[Calibration] | None = None) -> tuple[NearLaw, ...]:
    """Return calibrations scaled to a design, the most similar first.

    Parameters
    ----------
    design : actuator.
    known : calibrations to choose from; by default those that ship. One of all orientations is that of a
        double helix at the design's ψ.
    """
    from calibration.truth import on_its_mesh, title

    found = []
    for calibration in shipped_calibrations() if known is None else known:
        oriented = calibration.layout.psi is None
        if calibration.law.is_adjusted or (oriented and not isinstance(design.winding, DoubleHelix)):
            continue
        source = design_of(calibration, design)
        its = similarity(design, source)
        mine = on_its_mesh(calibration)
        made = scaled(mine, its.scale, mine.provenance)
        found.append(NearLaw(made, title(calibration.layout), _deviations(design, source, its)))
    # Of equally similar ones that of a single orientation is the more accurate.
    return tuple(
        sorted(found, key=lambda near: (round(near.distance, 9), near.calibration.layout.psi is None))
    )


def _deviations(design: Design, source: Design, its: Similarity) -> dict[str, float]:
    """Return the deviations of two designs; that of ψ is the turn from one to the other [rad]."""
    deviations = dict(its.deviations)
    own, other = (getattr(one.winding, "psi", None) for one in (design, source))
    if own is not None and other is not None:
        # A double helix crosses itself every half turn: a shift along the rod.
        deviations["psi"] = math.remainder(own - other, math.pi)
    return deviations


def _distance(deviations: Mapping[str, float]) -> float:
    numbers = [_ANOTHER if name == "layout" else value for name, value in deviations.items()]
    return float(np.linalg.norm(numbers)) if numbers else 0.0


def design_of(calibration: Calibration, other: Design | None = None) -> Design:
    """Return the design that a calibration is of; files from before designs are of the paper's parts.

    Parameters
    ----------
    calibration : calibration of finite elements.
    other : design whose orientation a law of all orientations takes.
    """
    known, own = calibration.provenance, calibration.layout
    psi = own.psi
    if psi is None and other is not None and isinstance(other.winding, DoubleHelix):
        psi = other.winding.psi
    winding = layout(own.name, psi or 0.0, own.pitch)
    if isinstance(known.get("design"), str):
        return replace(parse_design(known["design"], "provenance: design"), winding=winding)
    material: Any = known.get("material", {})
    return Design(
        geometry=ActuatorGeometry(**{name: _plain(v) for name, v in known.get("geometry_m", {}).items()}),
        material=Ogden(**{name: _plain(value) for name, value in material.get("body", {}).items()}),
        core=Core(**material.get("core", {})),
        thread=Thread(**material.get("thread", {})),
        winding=winding,
    )


def _plain(value: Any) -> Any:
    """Return lists of JSON as tuples, which designs hold."""
    return tuple(value) if isinstance(value, list) else value
