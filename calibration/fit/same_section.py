"""What is fitted together belongs to one section: sweeps whose states are joined, and a fit's initial law."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import fields
from typing import Any

import numpy as np
import xarray as xr

from calibration.fit.samples import Samples
from calibration.sweep import attributes, whole_material
from rodmodel import Calibration, Domain

# Attributes that sweeps must share, beside the winding (without its orientation for a law of all).
_IN_COMMON = ("layout", "geometry", "mesh", "end_compliance", "material")
# Extent of a fit relative to the domain of its initial law beyond which a caution is given.
_BEYOND = 1.25
_SAME = 1e-9  # relative difference of numbers that were written and read


class UnlikeError(ValueError):
    """Error for sweeps, or a law, of different sections."""


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


def refuse_another_actuator(near: Calibration, run: Mapping[str, Any]) -> None:
    """Raise an `UnlikeError` if a law has another geometry or material than a run, or is adjusted.

    Parameters
    ----------
    near : calibration of the initial law.
    run : attributes of the fitted dataset.
    """
    if near.law.is_adjusted:
        raise UnlikeError("a law adjusted to measurements, expected one of finite elements")
    its, own = near.provenance.get("geometry_m"), dict(run["geometry"])
    if not isinstance(its, Mapping):
        # The file was not written here, but has these lengths.
        its = {name: getattr(near.actuator, name) for name in ("body_length", "cap_length", "body_diameter")}
        own = {name: own.get(name) for name in its}
    _refuse_difference("geometry", its, own)
    material = near.provenance.get("material")
    if isinstance(material, Mapping):
        _refuse_difference("material", whole_material(material), whole_material(run.get("material", {})))


def cautions(near: Calibration, run: Mapping[str, Any], domain: Domain) -> list[str]:
    """Return other differences in words; the law may still be a good start.

    Parameters
    ----------
    near, run : see `refuse_another_actuator`.
    domain : domain of the fit.
    """
    found = []
    if not isinstance(near.provenance.get("material"), Mapping):
        found.append("it does not say of which material it is")
    for key, of_run in (("mesh", "mesh"), ("end_compliance_m_per_n", "end_compliance")):
        its, own = near.provenance.get(key), run.get(of_run)
        if its is not None and not _same(its, own):
            found.append(f"its {of_run} is {its}, the run's {own}")
    reach = max(
        *(own / its for own, its in zip(domain.pressure_max, near.domain.pressure_max, strict=True)),
        domain.pressure_sum_max / near.domain.pressure_sum_max,
        domain.moment_max / near.domain.moment_max,
    )
    if reach > _BEYOND:
        found.append(f"the fit reaches {reach:.2g} times as far as its domain: its law is extrapolated there")
    return found


def _winding(run: dict[str, Any], any_orientation: bool) -> dict[str, Any]:
    return {name: value for name, value in run["winding"].items() if not (any_orientation and name == "psi")}


def _refuse_difference(what: str, its: Any, own: Any) -> None:
    """Raise an `UnlikeError` that names the first different entry of two files."""
    if isinstance(its, Mapping) and isinstance(own, Mapping):
        for name in sorted({*its, *own}):
            _refuse_difference(f"{what}.{name}", its.get(name), own.get(name))
    elif not _same(its, own):
        raise UnlikeError(f"a law with {what} {its}, expected {own}, as the run's")


def _same(one: Any, other: Any) -> bool:
    if isinstance(one, list | tuple) and isinstance(other, list | tuple):
        return len(one) == len(other) and all(map(_same, one, other))
    numbers = (int, float)
    if isinstance(one, numbers) and isinstance(other, numbers):
        return math.isclose(one, other, rel_tol=_SAME)
    return bool(one == other)
