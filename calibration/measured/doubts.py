"""Doubts about a fit to measurements: another actuator, other units, too few rows, a poor fit."""

import numpy as np

from calibration.measured.adjusted_law import NAMES, units_of
from calibration.measured.csv_file import ANGLE, PLANE, POSITIONS, Measured
from rodmodel import CoreRod, Rod

# Plausible range of each parameter for a moulding and sensor of the map's actuator, with unit and factor to
# it; that of offsets is relative to the map's largest pressure. Wall variations are not restricted, because
# the data hardly determine them.
_PLAUSIBLE = (
    (0.3, 3.0, "", 1.0),
    *((0.5, 2.0, "", 1.0),) * 3,
    *((-0.18, 0.18, " kPa", 1e-3),) * 3,
    *((-np.inf, np.inf, "", 1.0),) * 3,
)
# Factors of the pressure that are tried.
_FACTORS = np.geomspace(1e-3, 2e3, 300)
# Range of factors for mouldings of the map's actuator.
_MOULDINGS = (0.5, 2.0)
# Units of pressure [kPa] and of length [mm].
_PRESSURE_UNITS = {"MPa": 1e3, "bar": 100.0, "psi": 6.895, "mmHg": 0.1333, "mbar": 0.1, "Pa": 1e-3}
_LENGTH_UNITS = {"m": 1e3, "cm": 10.0, "inches": 25.4}
# Largest relative difference between a factor and a unit.
_SAME_UNIT = 0.15
# A fit is poor if its residuals exceed this fraction of the measured values (root mean square).
_POORLY = 0.2
# The map agrees with the data if its residuals are below this fraction.
_WELL = 0.3
# An output is fitted worse if its residuals exceed those of the map by this factor …
_WORSE = 1.2
# … and the noise by this one.
_OVER_NOISE = 2.0
_FEWEST_STATES = 3
_NOTHING = 1e-12  # guards a division by the bend of a straight rod


def doubts_of_units(rod: CoreRod, measured: Measured) -> str | None:
    """Check within seconds whether data are of the map's actuator and in the right units.

    The map's bends at the pressures, scaled by one factor, are compared with the measured bends. A moulding
    of the map's actuator fits at half to twice its pressures.

    Parameters
    ----------
    rod : compiled rod of the map.
    measured : measurements.

    Returns
    -------
    doubt : description; None without doubt.
    """
    factors = np.append(_FACTORS, 1.0)
    predicted, inside = _predicted(rod, measured, factors)
    length = rod.actuator.body_length + rod.actuator.cap_length

    def misfits(scales: dict[str, float]) -> np.ndarray:
        own = measured.values * [scales.get(name, 1.0) for name in measured.outputs]
        sizes = _sizes(measured.outputs, own, length)[:, None]
        off = _sizes(measured.outputs, predicted, length) - sizes
        size = np.sum(np.where(inside, sizes**2, 0.0), axis=(0, 2))
        rows = inside.sum(axis=(0, 2))
        wrong = np.sum(np.where(inside, off**2, 0.0), axis=(0, 2))
        enough = rows >= min(_FEWEST_STATES, len(own))
        return np.where(enough & (size > 0.0), np.sqrt(wrong / np.maximum(size, _NOTHING)), np.inf)

    plain = misfits({})
    if not np.any(np.isfinite(plain)) or plain[-1] < _WELL:
        return None
    for names, units in (((ANGLE,), {"radians": float(np.degrees(1.0))}), (POSITIONS, _LENGTH_UNITS)):
        for unit, factor in units.items():
            if misfits(dict.fromkeys(names, factor))[-1] < _WELL and set(names) & set(measured.outputs):
                return f"{names[0]} fits the map taken as {unit}: expected the unit in the column's name"
    factor = float(factors[np.argmin(plain)])
    if _MOULDINGS[0] <= factor <= _MOULDINGS[1]:
        return None
    known = [(u, f) for u, f in _PRESSURE_UNITS.items() if abs(factor / f - 1.0) < _SAME_UNIT]
    asked = "it is"
    for unit, size in known[:1]:
        asked = f"are the pressures in {unit}, {size:g} kPa each? Or it is"
    return (
        f"the map bends so far at {factor:.3g} times these pressures: {asked} another actuator than the "
        "map's, which needs a calibration of its own (rodmodel-calibrate run, fit)"
    )


def doubts_of_fit(
    rod: Rod,
    measured: Measured,
    parameters: np.ndarray,
    residuals: tuple[np.ndarray, np.ndarray],
    weight: np.ndarray,
    free: list[int],
    at_bound: list[int],
    outside: int,
) -> tuple[str, ...]:
    """Return the doubts about a fit.

    Parameters
    ----------
    rod : rod of the map.
    measured : measured states.
    parameters : fitted parameters, in the order and units of `NAMES`.
    residuals : residuals of the map and of the adjusted law, over the noise, (states, outputs).
    weight : one over the noise, (states, outputs).
    free, at_bound : indices of the fitted parameters, and of those at their bounds.
    outside : number of states that lie beyond the map when adjusted.
    """
    of_map, adjusted = residuals
    states = len(measured.lines)
    found, units = [], units_of(rod.domain)
    if states < _FEWEST_STATES:
        found.append(f"{_counted(states)} measured, repeats not counted: expected {_FEWEST_STATES} at least")
    elif free and adjusted.size <= len(free):
        found.append(f"{adjusted.size} measured numbers for {len(free)} parameters: nothing left to judge by")
    for n in free:
        least, most, unit, factor = _PLAUSIBLE[n]
        least, most = units[n] * least, units[n] * most
        value = parameters[n]
        if n in at_bound:
            found.append(f"{NAMES[n]} is at its bound, {factor * value:.3g}{unit}")
        elif not least <= value <= most:
            found.append(
                f"{NAMES[n]} is {factor * value:.3g}{unit}, expected {factor * least:.3g} to "
                f"{factor * most:.3g}{unit} of the map's actuator"
            )
    if 2 * outside > states:
        found.append(f"{outside} of {states} states lie beyond the map when adjusted")
    before, after = (np.sqrt(np.mean(off**2, axis=0)) for off in (of_map, adjusted))
    for name, first, second in zip(measured.outputs, before, after, strict=True):
        if second > max(_WORSE * first, _OVER_NOISE):
            found.append(f"{name} is fitted worse than by the map, {second / first:.1f} times as far off")
    length = rod.actuator.body_length + rod.actuator.cap_length
    left = _share_left(measured, measured.values - adjusted / weight, float(length))
    if left > _POORLY:
        found.append(
            f"the residuals are {100.0 * left:.0f} % of the measured values, expected at most "
            f"{100.0 * _POORLY:.0f} %: other columns, or another actuator?"
        )
    return tuple(found)


def _counted(states: int) -> str:
    return "one state was" if states == 1 else f"{states} states were"


def _predicted(rod: CoreRod, measured: Measured, factors: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return outputs (factors, rows, outputs) at scaled pressures, and which are valid, (1, f, r)."""
    pressure = factors[:, None, None] * measured.pressure
    given = {"pressure": pressure}
    for name, load in (("tip_force", measured.tip_force), ("gravity", measured.gravity)):
        if load is not None:
            given[name] = np.broadcast_to(load, pressure.shape)
    solved = rod.solve_many(**{name: values.reshape(-1, 3) for name, values in given.items()})
    tip = solved["tip_position"]
    columns = {ANGLE: solved["bending_angle"], PLANE: solved["bending_plane"]}
    columns |= {name: tip[:, k] for k, name in enumerate(POSITIONS)}
    outputs = np.stack([columns[name] for name in measured.outputs], axis=1)
    inside = np.asarray(rod.domain.covers_pressure(np.moveaxis(pressure, -1, 0))) & (
        solved["result"].reshape(pressure.shape[:2]) == 0
    )
    return outputs.reshape(*pressure.shape[:2], -1), inside[None]


def _sizes(outputs: tuple[str, ...], values: np.ndarray, length: float) -> np.ndarray:
    """Return the bend of each row: its angle [rad], and the tip's displacement over L, if measured."""
    found = []
    if ANGLE in outputs:
        found.append(values[..., outputs.index(ANGLE)])
    way = _tips(outputs, values, length)
    if way.shape[-1]:
        found.append(np.linalg.norm(way, axis=-1))
    return np.stack(found) if found else np.zeros((0, *values.shape[:-1]))


def _tips(outputs: tuple[str, ...], values: np.ndarray, length: float) -> np.ndarray:
    """Return the tip's displacement from rest over the length, in the measured coordinates."""
    at_rest = dict(zip(POSITIONS, (0.0, 0.0, length), strict=True))
    ways = [(values[..., outputs.index(n)] - rest) / length for n, rest in at_rest.items() if n in outputs]
    return np.stack(ways, axis=-1) if ways else np.zeros((*values.shape[:-1], 0))


def _share_left(measured: Measured, predicted: np.ndarray, length: float) -> float:
    """Return the root mean square residual over that of the measured bends and tip displacements."""

    def bends(values: np.ndarray) -> np.ndarray:
        names, parts = measured.outputs, [_tips(measured.outputs, values, length)]
        size = values[:, names.index(ANGLE)] if ANGLE in names else np.ones(len(values))
        if PLANE in names:
            plane = values[:, names.index(PLANE)]
            parts.append(np.stack([size * np.cos(plane), size * np.sin(plane)], axis=1))
        elif ANGLE in names:
            parts.append(size[:, None])
        return np.concatenate(parts, axis=1)

    values = bends(measured.values)
    size = float(np.linalg.norm(values))
    return float(np.linalg.norm(values - bends(predicted))) / max(size, _NOTHING)
