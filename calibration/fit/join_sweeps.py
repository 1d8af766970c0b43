"""Joined training states of several sweeps of one section, or of a section at several orientations."""

from collections.abc import Sequence
from dataclasses import fields
from typing import Any

import numpy as np
import xarray as xr

from calibration.fit.samples import Samples
from calibration.sweep import attributes, whole_material

# Attributes that sweeps must share, beside the winding (without its orientation for a law of all).
_IN_COMMON = ("layout", "geometry", "mesh", "end_compliance", "material")


class UnlikeError(ValueError):
    """Error for sweeps of different sections."""


def refuse_unlike(dataset: xr.Dataset, other: xr.Dataset) -> None:
    """Raise an `UnlikeError` if another sweep has a different section.

    Parameters
    ----------
    dataset : sweep of the section; of all orientations if each path has its own.
    other : sweep whose states are to be fitted too.
    """
    own, its = attributes(dataset), attributes(other)
    for run in (own, its):
        run["material"] = whole_material(run.get("material", {}))
    for name in _IN_COMMON:
        if own.get(name) != its.get(name):
            raise UnlikeError(f"a sweep with {name} {its.get(name)}, expected {own.get(name)}")
    any_orientation = "orientations" in own
    if "orientations" in its and not any_orientation:
        raise UnlikeError("a sweep of many orientations, expected one of a single orientation")
    wound, expected = (_winding(run, any_orientation) for run in (its, own))
    if wound != expected:
        raise UnlikeError(f"a sweep with winding {wound}, expected {expected}")


def joined(parts: Sequence[Samples]) -> Samples:
    """Join the states of several sweeps; path names get the sweep's number, as they may be equal."""
    names = [np.array([f"{number}:{path}" for path in part.path]) for number, part in enumerate(parts)]
    arrays = {
        field.name: np.concatenate([getattr(part, field.name) for part in parts]) for field in fields(Samples)
    }
    return Samples(**{**arrays, "path": np.concatenate(names)})


def _winding(run: dict[str, Any], any_orientation: bool) -> dict[str, Any]:
    return {name: value for name, value in run["winding"].items() if not (any_orientation and name == "psi")}
