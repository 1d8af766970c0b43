"""Mean and scatter of repeated measurements of the same state."""

from dataclasses import dataclass, replace

import numpy as np

from calibration.measured.csv_file import PLANE, POSITIONS, Measured

# Largest difference of equal pressures [Pa]: the accuracy of a regulator.
_SAME_PRESSURE = 50.0
# Largest difference of equal forces [N].
_SAME_FORCE = 1e-3
# Largest difference of equal gravity [m/s²].
_SAME_GRAVITY = 0.05


@dataclass(frozen=True)
class Repeats:
    """Measured states with their repeats.

    Attributes
    ----------
    measured : one row per state, the mean of its repeats, with the line of the first one.
    rows : number of rows in the file.
    scatter : standard deviation of a measurement about its state's mean, (outputs,) [rad, m]; NaN without
        repeats.
    """

    measured: Measured
    rows: int
    scatter: np.ndarray


def states_of(measured: Measured) -> Repeats:
    """Group the rows by equal pressures and loads.

    Repeats share systematic errors, as of the pressure reading and the moulding, so their mean counts as one
    measurement.
    """
    loads = [(measured.pressure, _SAME_PRESSURE)]
    loads += [
        (values, same)
        for values, same in ((measured.tip_force, _SAME_FORCE), (measured.gravity, _SAME_GRAVITY))
        if values is not None
    ]
    steps = np.concatenate([values / same for values, same in loads], axis=1)
    groups: list[list[int]] = []
    for row, step in enumerate(steps):
        same = next((g for g in groups if np.all(np.abs(step - steps[g[0]]) <= 1.0)), None)
        if same is None:
            groups.append([row])
        else:
            same.append(row)
    values = _level(measured, groups)
    mean = np.stack([values[group].mean(axis=0) for group in groups])
    off = np.concatenate([values[group] - values[group].mean(axis=0) for group in groups])
    degrees = len(values) - len(groups)
    scatter = np.sqrt(np.sum(off**2, axis=0) / degrees) if degrees else np.full(values.shape[1], np.nan)

    def means(rows: np.ndarray | None) -> np.ndarray | None:
        return None if rows is None else np.stack([rows[group].mean(axis=0) for group in groups])

    pressure = means(measured.pressure)
    assert pressure is not None
    one = replace(
        measured,
        pressure=pressure,
        values=mean,
        tip_force=means(measured.tip_force),
        gravity=means(measured.gravity),
        lines=tuple(measured.lines[group[0]] for group in groups),
    )
    return Repeats(one, len(values), scatter)


def _level(measured: Measured, groups: list[list[int]]) -> np.ndarray:
    """Return values with a state's planes on one branch, so that the mean of 359° and 1° is 0°."""
    values = measured.values.copy()
    if PLANE in measured.outputs:
        column = measured.outputs.index(PLANE)
        for group in groups:
            first = values[group[0], column]
            turn = values[group, column] - first
            values[group, column] = first + np.mod(turn + np.pi, 2.0 * np.pi) - np.pi
    return values


def unit_of(output: str) -> tuple[str, float]:
    """Return the unit of an output in reports, and the factor to it from SI."""
    return ("mm", 1e3) if output in POSITIONS else ("deg", 180.0 / np.pi)
