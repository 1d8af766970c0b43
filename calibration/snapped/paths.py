"""Loading paths over a snapped sheet, all of which begin at the state where it was reached."""

import numpy as np

from calibration.snapped.sheet import SnappedSheet
from calibration.sweep import HELD_OUT_EVERY, LoadingPath, Role, walk
from fem_reference import Load


def snapped_paths(
    sheet: SnappedSheet,
    pressure: tuple[float, float],
    beside: float,
    moment_axes: tuple[float, float, float],
    number: int,
    seed: int,
    pressure_step: float,
) -> tuple[LoadingPath, ...]:
    """Draw paths that lead from the sheet's first state down to its end.

    The first goes straight down. The others pass three random points, at falling pressure of the chamber;
    every second of them is without moment, and every fifth is held out.

    Parameters
    ----------
    sheet : sheet.
    pressure : least and largest pressure of the chamber [Pa]; paths begin at the largest.
    beside : largest pressure of each of the other two [Pa].
    moment_axes : half axes of the ellipsoid of moments, body frame [N m].
    number, seed : of the paths.
    pressure_step : largest change of a pressure between two loads [Pa].
    """
    rng = np.random.default_rng([seed, sheet.chamber, sheet.side + 1])
    least, most = pressure
    begin = Load(sheet.pressure(most), (0.0, 0.0, 0.0))
    paths = []
    for index in range(number):
        role: Role = "held-out" if index % HELD_OUT_EVERY == HELD_OUT_EVERY - 1 else "train"
        free = index % 2 == 0
        waypoints = [Load(sheet.pressure(least), (0.0, 0.0, 0.0))] if index == 0 else []
        for share in (
            () if index == 0 else (rng.uniform(0.7, 1.0), rng.uniform(0.3, 0.7), rng.uniform(0.0, 0.3))
        ):
            others = beside * rng.random(2)
            size, way = 0.0 if free else rng.random() ** (1 / 3), rng.standard_normal(3)
            moment = (size * np.asarray(moment_axes) * way / np.linalg.norm(way)).tolist()
            at = sheet.pressure(least + share * (most - least), *others.tolist())
            waypoints.append(Load(at, (moment[0], moment[1], moment[2])))
        kind = "named" if index == 0 else ("free" if free else "mixed")
        loads = walk(begin, waypoints, pressure_step, moment_axes)
        paths.append(LoadingPath(f"{index:03d}-{role}-{kind}", role, loads))
    return tuple(paths)
