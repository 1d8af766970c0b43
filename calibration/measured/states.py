"""Measurements of one state that were repeated: one row, and what the repeats scatter by."""

from dataclasses import dataclass, replace

import numpy as np

from calibration.measured.csv_file import PLANE, POSITIONS, Measured

# Within which pressures are the same: what a regulator holds, and a hundredth of what moves the tip by 1 mm
# times ten [Pa]. Of forces [N] and gravity [m/s²].
_SAME_PRESSURE, _SAME_FORCE, _SAME_GRAVITY = 50.0, 1e-3, 0.05


@dataclass(frozen=True)
class Repeats:
    """Rows of measured states.

    Attributes
    ----------
    measured : one row for each state, the mean of its repeats; its line is that of the first of them.
    rows : of the file.
    scatter : standard deviation of one measurement about its state's mean, (outputs,) [rad, m]; NaN where no
        state was repeated.
    """

    measured: Measured
    rows: int
    scatter: np.ndarray


def states_of(measured: Measured) -> Repeats:
    """Gather the rows of the same pressures and loads.

    Repeats share what is wrong with a measurement of their state, the pressure's reading and the moulding
    alike, and a row copied twice tells nothing: they count as one measurement, their mean.
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

    def means(of: np.ndarray | None) -> np.ndarray | None:
        return None if of is None else np.stack([of[group].mean(axis=0) for group in groups])

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
    """Values with the planes of a state on one branch, so that 359° and 1° have a mean of 0°."""
    values = measured.values.copy()
    if PLANE in measured.outputs:
        column = measured.outputs.index(PLANE)
        for group in groups:
            first = values[group[0], column]
            turn = values[group, column] - first
            values[group, column] = first + np.mod(turn + np.pi, 2.0 * np.pi) - np.pi
    return values


def unit_of(output: str) -> tuple[str, float]:
    """Unit of an output for people, and the factor to it from SI."""
    return ("mm", 1e3) if output in POSITIONS else ("deg", 180.0 / np.pi)
