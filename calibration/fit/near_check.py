"""Whether a law that a fit is to begin with is of the same actuator."""

import math
from collections.abc import Mapping
from typing import Any

from calibration.fit.join_sweeps import UnlikeError
from calibration.sweep import whole_material
from rodmodel import Calibration, Domain

# How far beyond a law's domain a fit may reach before its start is told to be an extrapolation.
_BEYOND = 1.25
_SAME = 1e-9  # of numbers that were written and read


def refuse_another_actuator(near: Calibration, run: Mapping[str, Any]) -> None:
    """Raise an `UnlikeError` where a law is of another geometry or material than a run, or of measurements.

    Parameters
    ----------
    near : calibration whose law a fit is to begin with.
    run : attributes of the dataset that is fitted.
    """
    if near.law.is_adjusted:
        raise UnlikeError("a law adjusted to measurements, expected one of finite elements")
    its, own = near.provenance.get("geometry_m"), dict(run["geometry"])
    if not isinstance(its, Mapping):
        # A file by another hand; it has these lengths all the same.
        its = {name: getattr(near.actuator, name) for name in ("body_length", "cap_length", "body_diameter")}
        own = {name: own.get(name) for name in its}
    _refuse_difference("geometry", its, own)
    material = near.provenance.get("material")
    if isinstance(material, Mapping):
        _refuse_difference("material", whole_material(material), whole_material(run.get("material", {})))


def cautions(near: Calibration, run: Mapping[str, Any], domain: Domain) -> list[str]:
    """What else differs, in words: the law may still be a good start.

    Parameters
    ----------
    near, run : see `refuse_another_actuator`.
    domain : that the fit is for.
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


def _refuse_difference(what: str, its: Any, own: Any) -> None:
    """Raise an `UnlikeError` that names the first of two files' entries that differ."""
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
