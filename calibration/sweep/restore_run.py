"""Restore a run's directory from its dataset, so that a sweep can be extended without its files."""

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from calibration.sweep.dataset import VARIABLES, attributes
from calibration.sweep.path_file import PathWriter, path_file
from calibration.sweep.run_directory import RUN_FILE, RunPlan, refuse_another
from rodmodel.io import write_atomically

_OF_THE_DATASET = ("failures", "unstable", "paths")


def restore_run(dataset: xr.Dataset, directory: Path, plan: RunPlan, material: Mapping[str, Any]) -> None:
    """Write a run's directory as it was when its dataset was built, with all its paths finished.

    A directory that already holds a run is not changed: the same command resumes an interrupted run.

    Parameters
    ----------
    dataset : dataset of the run.
    directory : directory to write; created if missing.
    plan, material : plan and material of the extended run, with any number of paths.

    Raises
    ------
    RunError
        If the dataset belongs to another run; nothing is written then.
    """
    if (directory / RUN_FILE).exists():
        return
    run = attributes(dataset)
    refuse_another(run, plan, material, "--extend: the dataset", "one")
    ends = {**run["failures"], **run["unstable"]}
    names = dataset["path"].values
    values = {name: dataset[name].values for name, *_ in VARIABLES}
    for path in np.unique(names):
        rows = np.flatnonzero(names == path)
        states = [{name: column[row].tolist() for name, column in values.items()} for row in rows]
        end = ends.get(path, {"attempts": int(values["attempt"][rows].max())})
        PathWriter(path_file(directory, path)).add([*states, {"end": end}])
    description = {name: value for name, value in run.items() if name not in _OF_THE_DATASET}
    # Written last: a directory without it counts as empty.
    write_atomically(directory / RUN_FILE, json.dumps(description, indent=1) + "\n")
