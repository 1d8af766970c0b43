"""Where runs of the full actuator under one chamber left their loading branch."""

import numpy as np
import xarray as xr

from calibration.fit import on_loading_branch
from calibration.truth.cases import layout_of, same_layout
from calibration.truth.dataset import case_of, truth_level
from fem_reference import level_record
from rodmodel import Layout
from rodmodel.io import Jump


def jump_limits(truth: xr.Dataset, layout: Layout) -> tuple[Jump, ...]:
    """Return a winding's runs that jumped under one chamber; of a chamber without, the one that went on most.

    A run that is held in its plane of symmetry tells nothing of a jump aside. A law of all orientations has
    none: which chamber jumps where depends on ψ.

    Parameters
    ----------
    truth : dataset of `gather`.
    layout : the calibration's.
    """
    names = truth["case"].values
    upright = on_loading_branch(truth, names)
    loads = np.concatenate([truth["tip_force"].values, truth["gravity"].values], axis=1)
    found = []
    for name in dict.fromkeys(map(str, names)):
        rows = np.flatnonzero(names == name)
        pressure = truth["pressure"].values[rows]
        (used,) = np.nonzero(pressure.any(axis=0))
        stands = upright[rows]
        alone = len(used) == 1 and not loads[rows].any() and stands[0]
        case = case_of(name)
        if alone and not case.symmetric and same_layout(layout_of(case.winding), layout):
            (chamber,) = used
            gone = pressure[~stands, chamber]
            found.append(
                Jump(
                    chamber=int(chamber) + 1,
                    stood=float(pressure[stands, chamber].max()),
                    jumped=float(gone[0]) if len(gone) else None,
                    run=name,
                    mesh=str(level_record(truth_level(truth, name))),
                )
            )
    return tuple(
        jump
        for chamber in (1, 2, 3)
        for jump in _telling([jump for jump in found if jump.chamber == chamber])
    )


def _telling(runs: list[Jump]) -> list[Jump]:
    jumped = [run for run in runs if run.jumped is not None]
    return jumped or sorted(runs, key=lambda run: run.stood)[-1:]
