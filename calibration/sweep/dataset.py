"""Labelled dataset of a sweep: value, gradient and Hessian of the section potential at every state."""

import json
import reprlib
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import xarray as xr

from calibration.sweep.design import LoadingPath
from calibration.sweep.path_file import PathRecord
from calibration.sweep.run_schema import refuse_run
from rodmodel.io import write_atomically

CHAMBERS = ("1", "2", "3")
AXES = ("u1", "u2", "u3")
ARGUMENTS = (*AXES, "p1", "p2", "p3")


class Variable(NamedTuple):
    """A variable of each state.

    Parameters
    ----------
    name, unit, meaning : name, unit and description in the file.
    dims : dimensions after "state".
    least, most : inclusive range.
    """

    name: str
    dims: tuple[str, ...]
    unit: str
    meaning: str
    least: float
    most: float


VARIABLES: tuple[Variable, ...] = (
    Variable("pressure", ("chamber",), "Pa", "gauge pressure of each chamber", 0.0, 1e8),
    Variable("moment", ("axis",), "N m", "moment on the section, body frame, equal to dPi/du", -1e6, 1e6),
    Variable("applied_moment", ("axis",), "N m", "moment of the path; not all of it if held", -1e6, 1e6),
    Variable("curvature", ("axis",), "1/m", "curvature and twist, body frame", -1e6, 1e6),
    Variable("energy", (), "J/m", "section potential Pi less its value at rest", -1e9, 1e9),
    Variable("volume", ("chamber",), "m2", "chamber volume per length, equal to -dPi/dp", -10.0, 10.0),
    Variable("hessian", ("row", "column"), "SI", "second derivatives of Pi in (u, p), condensed", -1e9, 1e9),
    Variable("iterations", (), "1", "Newton iterations of the state", 0.0, 1e9),
    Variable(
        "stable", (), "1", "1 at a minimum of the potential, 0 at none, -1 where it is not known", -1.0, 1.0
    ),
    Variable("jumped", (), "1", "1 where walls have snapped since the state before", 0.0, 1.0),
    Variable("held", (), "1", "1 at an imposed curvature, beyond the loss of lateral stability", 0.0, 1.0),
    Variable("attempt", (), "1", "2 where the path was followed again in smaller steps", 1.0, 2.0),
    Variable("seconds", (), "s", "wall time since the state before", -1e9, 1e9),
)
ROLES = ("train", "held-out")
_LENGTHS = {"chamber": 3, "axis": 3, "row": 6, "column": 6}


class DatasetError(ValueError):
    """Error for a file that is not a complete dataset of a sweep."""


def build_dataset(
    paths: Sequence[LoadingPath], records: Mapping[str, PathRecord], provenance: Mapping[str, Any]
) -> xr.Dataset:
    """Collect the states of a run's paths.

    Parameters
    ----------
    paths : paths of the design.
    records : records by path name; a path without a record is unfinished.
    provenance : attributes of the dataset; nested values become JSON.

    Returns
    -------
    dataset with dimension ``state``; attribute ``failures`` lists the paths that ended early and where,
    ``unstable`` those that ended where the section loses its stability.
    """
    chosen = [
        (path, {"held": 0} | state)
        for path in paths
        if path.name in records
        for state in records[path.name].states
    ]
    if not chosen:
        raise DatasetError("dataset: the run holds no finished state; run the sweep first")
    data: dict[str, Any] = {
        name: (
            ("state", *dims),
            np.array([state[name] for _, state in chosen]),
            {"units": unit, "long_name": meaning},
        )
        for name, dims, unit, meaning, *_ in VARIABLES
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
    """Write compressed netCDF, atomically."""
    numeric = [name for name, variable in dataset.data_vars.items() if variable.dtype.kind in "fiub"]
    encoding = {name: {"zlib": True, "complevel": 5, "shuffle": True} for name in numeric}
    # Through memory: HDF5 crashes the process if the disk is full.
    write_atomically(file, bytes(dataset.to_netcdf(engine="h5netcdf", encoding=encoding)))


def load_dataset(file: Path) -> xr.Dataset:
    """Read a dataset into memory and check the variables and ranges that a fit needs.

    Raises
    ------
    DatasetError
        With one line that names the file and the fault.
    """
    try:
        dataset = xr.load_dataset(file, engine="h5netcdf")
    except (OSError, ValueError, KeyError, RuntimeError) as error:
        reason = " ".join(str(error).split())
        raise DatasetError(
            f"dataset: cannot read {file} as netCDF ({reason}); expected a file of `run`"
        ) from error
    if "held" not in dataset and "moment" in dataset:
        # Files from before states at imposed curvature, whose moments are those of their paths.
        dataset["held"] = ("state", np.zeros(dataset.sizes["state"], dtype=int))
        dataset["applied_moment"] = dataset["moment"]
    needed = [variable.name for variable in VARIABLES] + ["path", "role", "psi"]
    missing = [name for name in needed if name not in dataset]
    if missing:
        raise DatasetError(f"dataset: {file} lacks {', '.join(missing)}; expected a file of `run`")
    try:
        _refuse_states(dataset)
        refuse_run(attributes(dataset))
    except (ValueError, TypeError) as error:
        raise DatasetError(f"dataset: {file}: {error}") from error
    return dataset


def _refuse_states(dataset: xr.Dataset) -> None:
    """Raise a ValueError if there are no states, or their numbers are out of range."""
    states = dataset.sizes.get("state", 0)
    if not states:
        raise ValueError("got no states, expected at least one")
    for variable in VARIABLES:
        found = dataset[variable.name]
        shape = (states, *(_LENGTHS[name] for name in variable.dims))
        if found.dims != ("state", *variable.dims) or found.shape != shape or found.dtype.kind not in "fiu":
            raise ValueError(
                f"{variable.name}: got {found.dtype} of {found.shape}, expected numbers of shape {shape}"
            )
        outside = ~((found.values >= variable.least) & (found.values <= variable.most))
        if outside.any():
            raise ValueError(
                f"{variable.name}: got {found.values[outside][0]:g} in state {np.argwhere(outside)[0, 0]}, "
                f"expected numbers from {variable.least:g} to {variable.most:g} {variable.unit}"
            )
    psi = dataset["psi"]
    # NaN if the winding has no orientation.
    if psi.dims != ("state",) or psi.dtype.kind != "f" or not (np.isnan(psi) | (np.abs(psi) <= 100.0)).all():
        raise ValueError("psi: got numbers beyond ±100 rad, expected an orientation of each state")
    if dataset["path"].dims != ("state",) or dataset["role"].dims != ("state",):
        raise ValueError("path, role: got other dimensions, expected one text for each state")
    strange = set(map(str, dataset["role"].values)) - set(ROLES)
    if strange:
        raise ValueError(f"role: got {sorted(strange)[0]!r}, expected {' or '.join(ROLES)}")


def attributes(dataset: xr.Dataset) -> dict[str, Any]:
    """Return the provenance that `build_dataset` was given.

    Raises
    ------
    ValueError
        If an attribute is broken JSON.
    """
    return {name: _unflat(name, value) for name, value in dataset.attrs.items()}


def _flat(attrs: Mapping[str, Any]) -> dict[str, Any]:
    """Return attributes for netCDF, which allows text and numbers; other values become JSON."""
    return {
        name: value if type(value) in (str, int, float) else json.dumps(value)
        for name, value in attrs.items()
    }


def _unflat(name: str, value: Any) -> Any:
    if isinstance(value, str) and (value[:1] in ("[", "{") or value in ("true", "false")):
        try:
            return json.loads(value)
        except (ValueError, RecursionError) as error:
            raise ValueError(f"{name}: got {reprlib.repr(value)} ({error}), expected JSON") from error
    return value.item() if isinstance(value, np.generic) else value
