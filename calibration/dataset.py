"""The labelled dataset of a sweep: value, gradient and Hessian of the section potential at every state."""

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from calibration.design import LoadingPath
from calibration.path_file import PathRecord

CHAMBERS = ("1", "2", "3")
AXES = ("u1", "u2", "u3")
ARGUMENTS = (*AXES, "p1", "p2", "p3")

# name, dims beside "state", unit, meaning
VARIABLES: tuple[tuple[str, tuple[str, ...], str, str], ...] = (
    ("pressure", ("chamber",), "Pa", "gauge pressure of each chamber"),
    ("moment", ("axis",), "N m", "moment on the section, body frame, equal to dPi/du"),
    ("curvature", ("axis",), "1/m", "curvature and twist, body frame"),
    ("energy", (), "J/m", "section potential Pi less its value at rest"),
    ("volume", ("chamber",), "m2", "chamber volume per length, equal to -dPi/dp"),
    ("hessian", ("row", "column"), "SI", "second derivatives of Pi in (u, p), condensed"),
    ("iterations", (), "1", "Newton iterations of the state"),
    ("stable", (), "1", "1 at a minimum of the potential, 0 at none, -1 where it is not known"),
    ("jumped", (), "1", "1 where walls have snapped since the state before"),
    ("attempt", (), "1", "2 where the path was followed again in smaller steps"),
    ("seconds", (), "s", "wall time since the state before"),
)


class DatasetError(ValueError):
    """A file is not a dataset of a sweep, or lacks something that is needed of it."""


def build_dataset(
    paths: Sequence[LoadingPath], records: Mapping[str, PathRecord], provenance: Mapping[str, Any]
) -> xr.Dataset:
    """Gather the states of a run's paths.

    Parameters
    ----------
    paths : of the design.
    records : by the path's name; a path without a record counts as unfinished.
    provenance : goes into the attributes; nested values as JSON.

    Returns
    -------
    dataset with dimension ``state``; attribute ``failures`` lists the paths that ended early and where,
    ``unstable`` those that ended where the section loses its stability.
    """
    chosen = [(path, state) for path in paths if path.name in records for state in records[path.name].states]
    if not chosen:
        raise DatasetError("dataset: the run holds no finished state; run the sweep first")
    data: dict[str, Any] = {
        name: (
            ("state", *dims),
            np.array([state[name] for _, state in chosen]),
            {"units": unit, "long_name": meaning},
        )
        for name, dims, unit, meaning in VARIABLES
    }
    data["path"] = (
        "state",
        np.array([path.name for path, _ in chosen], dtype=object),
        {"long_name": "loading path"},
    )
    psi = provenance.get("winding", {}).get("psi", np.nan)
    data["psi"] = (
        "state",
        np.array([psi if path.psi is None else path.psi for path, _ in chosen]),
        {"units": "rad", "long_name": "orientation of the winding, where it has one"},
    )
    data["role"] = (
        "state",
        np.array([path.role for path, _ in chosen], dtype=object),
        {"long_name": "train or held-out"},
    )
    failures = {name: record.end for name, record in records.items() if record.failed}
    unstable = {name: record.end for name, record in records.items() if record.lost_stability}
    return xr.Dataset(
        data,
        coords={
            "chamber": list(CHAMBERS),
            "axis": list(AXES),
            "row": list(ARGUMENTS),
            "column": list(ARGUMENTS),
        },
        attrs=_flat({**provenance, "failures": failures, "unstable": unstable, "paths": len(paths)}),
    )


def save_dataset(dataset: xr.Dataset, file: Path) -> None:
    """Write netCDF, compressed."""
    numeric = [name for name, variable in dataset.data_vars.items() if variable.dtype.kind in "fiub"]
    encoding = {name: {"zlib": True, "complevel": 5, "shuffle": True} for name in numeric}
    dataset.to_netcdf(file, engine="h5netcdf", encoding=encoding)


def load_dataset(file: Path) -> xr.Dataset:
    """Read a dataset into memory, checked for what a fit needs."""
    try:
        dataset = xr.load_dataset(file, engine="h5netcdf")
    except (OSError, ValueError) as error:
        raise DatasetError(
            f"dataset: cannot read {file} as netCDF ({error}); expected a file of `run`"
        ) from error
    needed = [name for name, *_ in VARIABLES] + ["path", "role", "psi"]
    missing = [name for name in needed if name not in dataset]
    if missing:
        raise DatasetError(f"dataset: {file} lacks {', '.join(missing)}; expected a file of `run`")
    return dataset


def attributes(dataset: xr.Dataset) -> dict[str, Any]:
    """The provenance as it was given to `build_dataset`."""
    return {name: _unflat(value) for name, value in dataset.attrs.items()}


def _flat(attrs: Mapping[str, Any]) -> dict[str, Any]:
    """NetCDF attributes are text or numbers; everything else goes in as JSON."""
    return {
        name: value if type(value) in (str, int, float) else json.dumps(value)
        for name, value in attrs.items()
    }


def _unflat(value: Any) -> Any:
    if isinstance(value, str) and (value[:1] in ("[", "{") or value in ("true", "false")):
        return json.loads(value)
    return value.item() if isinstance(value, np.generic) else value
