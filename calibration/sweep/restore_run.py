"""Restore a run's directory from its dataset, so that a sweep can be extended without its files."""

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr
from jaxtyping import Float

from calibration.sweep.dataset import VARIABLES, attributes
from calibration.sweep.path_file import PathWriter, path_file
from calibration.sweep.run_directory import RUN_FILE, RunError, RunPlan, refuse_another
from rodmodel.io import write_atomically

_OF_THE_DATASET = ("failures", "unstable", "paths")
# Largest distance of a state from its path, over the largest pressure: rounding.
_OFF = 1e-9


def restore_run(
    dataset: xr.Dataset, directory: Path, plan: RunPlan, material: Mapping[str, Any], retry: bool = False
) -> None:
    """Write a run's directory as it was when its dataset was built, with all its paths finished.

    A directory that already holds a run is not changed: the same command resumes an interrupted run.

    Parameters
    ----------
    dataset : dataset of the run.
    directory : directory to write; created if missing.
    plan, material : plan and material of the extended run, with any number of paths.
    retry : leave out the paths that ended before their last load, so that they are computed again.

    Raises
    ------
    RunError
        If the dataset belongs to another run, or its paths are not those of this version's design; nothing
        is written then.
    """
    if (directory / RUN_FILE).exists():
        return
    run = attributes(dataset)
    refuse_another(run, plan, material, "--extend: the dataset", "one")
    _refuse_other_paths(dataset, plan)
    ends = {**run["failures"], **run["unstable"]}
    names = dataset["path"].values
    values = {name: dataset[name].values for name, *_ in VARIABLES}
    for path in np.unique(names):
        if retry and path in ends:
            continue
        rows = np.flatnonzero(names == path)
        states = [{name: column[row].tolist() for name, column in values.items()} for row in rows]
        end = ends.get(path, {"attempts": int(values["attempt"][rows].max())})
        PathWriter(path_file(directory, path)).add([*states, {"end": end}])
    description = {name: value for name, value in run.items() if name not in _OF_THE_DATASET}
    # Written last: a directory without it counts as empty.
    write_atomically(directory / RUN_FILE, json.dumps(description, indent=1) + "\n")


def _refuse_other_paths(dataset: xr.Dataset, plan: RunPlan) -> None:
    """Raise a `RunError` if states are off the paths of their names, which are drawn anew from the seed."""
    names = dataset["path"].values
    for path in plan.design():
        pressure = dataset["pressure"].values[names == path.name]
        waypoints = np.array([(0.0, 0.0, 0.0), *(load.pressure for load in path.loads)])
        if len(pressure) and _distance(pressure, waypoints).max() > _OFF * max(plan.domain.pressure_max):
            raise RunError(
                f"--extend: the dataset has states off the path {path.name} that this version draws from "
                f"seed {plan.seed}, expected one of the same design"
            )


def _distance(points: Float[np.ndarray, "n 3"], line: Float[np.ndarray, "m 3"]) -> Float[np.ndarray, " n"]:
    """Return the distance of points from a line through others."""
    begin, way = line[:-1], np.diff(line, axis=0)
    length = np.maximum((way**2).sum(axis=1), np.finfo(float).tiny)
    share = np.clip(((points[:, None] - begin) * way).sum(axis=2) / length, 0.0, 1.0)
    nearest = begin + share[:, :, None] * way
    return np.asarray(np.linalg.norm(points[:, None] - nearest, axis=2).min(axis=1))
