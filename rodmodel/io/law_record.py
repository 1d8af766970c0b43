"""Section law and domain as parts of a calibration file."""

import math
from dataclasses import replace
from typing import Any

from rodmodel.actuator import Domain
from rodmodel.io.json_record import CalibrationFileError, Record
from rodmodel.io.law_arrays import ARRAYS, RidgeArrays

RIDGES, ORIENTED, ADJUSTED = "ridge-network", "oriented-ridge-network", "adjusted-ridge-network"
RIDGE_SLOPE = "(1 + z^2)^-2"

_NO_LONGER_READ = "free-state-expansion"
_RANK_ONE = ("feature_biases", "offsets", "weights", "factor", "slopes", "rest_pressures", "quadratic")
# Arrays that only one kind of law has.
_OF_ONE_KIND = {"orientation_weights": ORIENTED, "rest_pressures": ADJUSTED, "quadratic": ADJUSTED}
_SCALES = {
    "pressure_scale": "pressure_scale_pa",
    "curvature_scale": "curvature_scale_per_m",
    "energy_scale": "energy_scale_n",
    "rest_volume": "rest_volume_m2",
}


def law_content(law: RidgeArrays) -> dict[str, Any]:
    """Return a law for JSON."""
    scales = {key: getattr(law, name) for name, key in _SCALES.items()}
    arrays = {name: getattr(law, name).tolist() for name in ARRAYS if getattr(law, name) is not None}
    kind = ORIENTED if law.is_oriented else ADJUSTED if law.is_adjusted else RIDGES
    if law.is_adjusted:
        arrays = {"rest_pressures": [0.0] * 3, "quadratic": [0.0] * 6, **arrays}
    return {"kind": kind, "ridge_slope": RIDGE_SLOPE, **scales, "symmetry": law.symmetry, **arrays}


def domain_content(domain: Domain) -> dict[str, Any]:
    """Return a domain for JSON; limits that it does not have are left out."""
    beside = {"pressure_beside_share": domain.beside_share, "pressure_beside_max_pa": domain.beside_max}
    return {
        "pressure_max_pa": list(domain.pressure_max),
        "pressure_sum_max_pa": domain.pressure_sum_max,
        "moment_max_nm": domain.moment_max,
        "torque_max_nm": domain.torque_max,
        **({} if domain.beside_max == math.inf else beside),
        **({"pressure_min_pa": list(domain.pressure_min)} if any(domain.pressure_min) else {}),
        **(
            {"single_max_pa": list(domain.single_max), "single_beside_pa": domain.single_beside}
            if any(domain.single_max)
            else {}
        ),
    }


def domain_of(record: Record) -> Domain:
    """Return the domain of a record."""
    domain = Domain(
        pressure_max=record.three("pressure_max_pa"),
        pressure_sum_max=record.number("pressure_sum_max_pa"),
        moment_max=record.number("moment_max_nm"),
        torque_max=record.number_or_null("torque_max_nm"),
    )
    if "pressure_min_pa" in record.content:
        domain = replace(domain, pressure_min=record.three("pressure_min_pa"))
        for least, most in zip(domain.pressure_min, domain.pressure_max, strict=True):
            if least > most:
                raise record.error("pressure_min_pa", f"{least:g}", f"at most the largest pressure, {most:g}")
    if {"single_max_pa", "single_beside_pa"} & set(record.content):
        domain = replace(
            domain,
            single_max=record.three("single_max_pa"),
            single_beside=record.number("single_beside_pa"),
        )
    if not {"pressure_beside_share", "pressure_beside_max_pa"} & set(record.content):
        return domain
    return replace(
        domain,
        beside_share=record.number("pressure_beside_share"),
        beside_max=record.number("pressure_beside_max_pa"),
    )


def law_of(record: Record) -> RidgeArrays:
    """Return the law of a record."""
    kinds = f'"{RIDGES}", "{ORIENTED}" or "{ADJUSTED}"'
    known = (RIDGES, ORIENTED, ADJUSTED, _NO_LONGER_READ)
    kind = record.take("kind", kinds, lambda value: value in known)
    if kind == _NO_LONGER_READ:
        raise record.error("kind", f"{kind!r}, a kind that is no longer read", f"{kinds}: fit the law anew")
    record.take("ridge_slope", f'"{RIDGE_SLOPE}"', lambda value: value == RIDGE_SLOPE)
    parts: dict[str, Any] = {name: record.number(key) for name, key in _SCALES.items()}
    parts |= {
        name: record.array(name, rank=1 if name in _RANK_ONE else 2)
        for name in ARRAYS
        if _OF_ONE_KIND.get(name, kind) == kind
    }
    try:
        return RidgeArrays(**parts, symmetry=record.word("symmetry"))
    except CalibrationFileError:
        raise
    except ValueError as error:
        raise CalibrationFileError(f"{record.file}: {record.place}.{error}") from error
