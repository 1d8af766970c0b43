"""The calibration of an actuator whose lengths, moduli and density are those of another, scaled.

An elastic body has no length and no modulus of its own. Where lengths are λ times and moduli μ times those of
another, Π'(u', p') = μ λ² Π(λ u', p'/μ): the law of one is the law of all, and so are its ends. Masses are
what the density makes of the lengths; the rod weighs them as they are.
"""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from fem_reference.design import Scale
from rodmodel import Actuator, Calibration, Domain, ErrorBound, Layout
from rodmodel.io import RidgeArrays

# Powers of length, modulus and density in each number of an actuator.
_ACTUATOR = {
    "body_length": (1, 0, 0),
    "cap_length": (1, 0, 0),
    "body_diameter": (1, 0, 0),
    "mass_per_length": (2, 0, 1),
    "cap_mass": (3, 0, 1),
    "stiff_tip": (1, 0, 0),
    "base_turn": (0, -1, 0),
    "base_lag": (1, 0, 0),
    "base_stiffness": (4, 1, 0),
    "base_growth": (0, 0, 0),
    "tip_offset": (1, 0, 0),
    "tip_offset_curvature": (-1, 0, 0),
    "tip_draw": (3, 0, 0),
    "held_length": (1, 0, 0),
    "shear_compliance": (-2, -1, 0),
}
# The same by the unit at the end of a name, in a file's errors.
_UNITS = {
    "_rad": (0, 0, 0),
    "_pa": (0, 1, 0),
    "_nm": (3, 1, 0),
    "_m2": (2, 0, 0),
    "_m3": (3, 0, 0),
    "_m": (1, 0, 0),
}
# Numbers in a file's errors that count or name something.
_COUNTS = ("states", "paths", "path")


def scaled(calibration: Calibration, scale: Scale, provenance: Mapping[str, Any]) -> Calibration:
    """Return the calibration of the similar actuator.

    Parameters
    ----------
    calibration : calibration of the actuator that the ratios refer to.
    scale : ratios of lengths, moduli and density.
    provenance : origin of the result.

    Returns
    -------
    calibration with the same angles at μ times the pressures, and an angle's error as it was.
    """
    return Calibration(
        layout=Layout(
            calibration.layout.name, calibration.layout.psi, scale.length * calibration.layout.pitch
        ),
        actuator=Actuator(
            **{
                name: scale.factor(powers) * getattr(calibration.actuator, name)
                for name, powers in _ACTUATOR.items()
            }
        ),
        law=_scaled_law(calibration.law, scale),
        domain=_scaled_domain(calibration.domain, scale),
        error={name: _scaled_error(name, value, scale) for name, value in calibration.error.items()},
        provenance=provenance,
        bound=None if calibration.bound is None else _scaled_bound(calibration.bound, scale),
        snapped=tuple(
            replace(
                sheet,
                law=_scaled_law(sheet.law, scale),
                domain=_scaled_domain(sheet.domain, scale),
                error={name: _scaled_error(name, value, scale) for name, value in sheet.error.items()},
            )
            for sheet in calibration.snapped
        ),
        jumps=tuple(
            replace(
                jump,
                stood=scale.pressure * jump.stood,
                jumped=None if jump.jumped is None else scale.pressure * jump.jumped,
            )
            for jump in calibration.jumps
        ),
    )


def _scaled_law(law: RidgeArrays, scale: Scale) -> RidgeArrays:
    return replace(
        law,
        pressure_scale=scale.pressure * law.pressure_scale,
        curvature_scale=law.curvature_scale / scale.length,
        energy_scale=scale.force * law.energy_scale,
        rest_volume=scale.factor((2, 0, 0)) * law.rest_volume,
    )


def _scaled_domain(domain: Domain, scale: Scale) -> Domain:
    pressure, moment = scale.pressure, scale.moment
    largest, least, alone = (
        (pressure * first, pressure * second, pressure * third)
        for first, second, third in (domain.pressure_max, domain.pressure_min, domain.single_max)
    )
    return Domain(
        largest,
        pressure * domain.pressure_sum_max,
        moment * domain.moment_max,
        None if domain.torque_max is None else moment * domain.torque_max,
        domain.beside_share,
        pressure * domain.beside_max,
        least,
        alone,
        pressure * domain.single_beside,
    )


def _scaled_error(name: str, value: Any, scale: Scale, factor: float = 1.0) -> Any:
    """Scale a number of a file's errors, or all in a table of them, by the unit that its name ends with."""
    for unit, powers in _UNITS.items():
        if name.endswith(unit):
            factor = scale.factor(powers)
            break
    if isinstance(value, Mapping):
        return {key: _scaled_error(key, entry, scale, factor) for key, entry in value.items()}
    if name in _COUNTS or isinstance(value, str):
        return value
    if isinstance(value, list):
        return [factor * entry for entry in value]
    return factor * value


def _scaled_bound(bound: ErrorBound, scale: Scale) -> ErrorBound:
    moment = scale.moment
    return ErrorBound(
        pressure_sum=tuple(scale.pressure * p for p in bound.pressure_sum),
        angle=bound.angle,
        tip=tuple(scale.length * tip for tip in bound.tip),
        angle_per_moment=bound.angle_per_moment / moment,
        tip_per_moment=scale.length * bound.tip_per_moment / moment,
        bending_angle=bound.bending_angle,
        angle_by_bend=bound.angle_by_bend,
        tip_by_bend=tuple(scale.length * tip for tip in bound.tip_by_bend),
    )
