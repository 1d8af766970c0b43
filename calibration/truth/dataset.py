"""Runs of the full actuator, traced case by case and gathered into a dataset for comparison with rods."""

import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr
from jaxtyping import Bool
from scipy.spatial.transform import Rotation

from calibration.fit import on_loading_branch
from calibration.provenance import code_version, today
from calibration.truth.cases import TruthCase, cases
from fem_reference import (
    Actuator,
    ActuatorGeometry,
    ActuatorRun,
    ActuatorState,
    Design,
    Kind,
    MeshLevel,
    RecordError,
    RunError,
    Text,
    design_text,
    level_from_record,
    level_record,
    load_record,
    parse_record,
    read_record,
    refuse_faults,
)
from rodmodel.io import write_atomically

#: Runs of the full actuator that ship with the package.
SHIPPED = Path(__file__).with_name("full_actuator.nc")

# name in the dataset, key of the record, dims beside "state", unit, factor to that unit, largest magnitude
_VARIABLES: tuple[tuple[str, str, tuple[str, ...], str, float, float], ...] = (
    ("pressure", "pressure_kpa", ("chamber",), "Pa", 1e3, 1e8),
    ("tip_force", "tip_force_n", ("axis",), "N", 1.0, 1e6),
    ("gravity", "gravity_m_per_s2", ("axis",), "m/s2", 1.0, 1e5),
    ("bending_angle", "bending_angle_deg", (), "rad", np.pi / 180.0, 1e4),
    ("bending_plane", "bending_plane_deg", (), "rad", np.pi / 180.0, 10.0),
    ("tip_position", "tip_position_mm", ("axis",), "m", 1e-3, 1e2),
    ("tip_rotation", "tip_rotation", ("row", "column"), "1", 1.0, 1.001),
    ("volume", "chamber_volume_mm3", ("chamber",), "m3", 1e-9, 1e3),
    ("residual", "residual_n", (), "N", 1.0, 1e6),
    ("jumped", "jumped", (), "1", 1.0, 1.0),
)
_LENGTHS = {"chamber": 3, "axis": 3, "row": 3, "column": 3}
# Schemas of each case's files: the run, and its provenance.
_RUN_KEYS: dict[str, Kind] = {"role": Text(), "winding": Text()}
_NOTE_KEYS: dict[str, Kind] = {"command": Text(), "code_version": Text(), "date": Text()}
# Stations along the rod at which its axis is stored, and the range over which curvatures of the middle are
# averaged, as shares of the body's length.
_ALONG = np.linspace(0.0, 1.0, 13)
# Largest difference between equal stations, over the length.
_SAME = 1e-9
_MIDDLE = (0.4, 0.6)


class TruthError(ValueError):
    """Error for an unknown case, or runs or a dataset that cannot be used."""


def case_of(name: str) -> TruthCase:
    """Return the case of a name, or raise a `TruthError` that lists all names."""
    known = {case.name: case for case in cases()}
    if name not in known:
        raise TruthError(f"case: got {name!r}, expected one of {', '.join(known)}")
    return known[name]


def trace(
    case: TruthCase, directory: Path, level: str | MeshLevel, command: str, design: Design | None = None
) -> Iterator[ActuatorState]:
    """Follow a case's loads, with every state on disk as soon as it is computed; a killed run resumes.

    Parameters
    ----------
    case : case to follow.
    directory : directory of all runs, which contains that of the case.
    level : mesh level of the actuator.
    command : command that repeats the run, for the provenance.
    design : actuator, whose winding is the case's; by default the paper's.

    Raises
    ------
    ActuatorError
        If a load is not reached; the states before it are saved.
    RunError
        If the directory holds another run of that name.
    """
    own = replace(Design() if design is None else design, winding=case.winding)
    actuator = Actuator.of(own, level, case.symmetric)
    description = {
        "case": case.name,
        "role": case.role,
        "winding": repr(case.winding),
        "mesh": level_record(level),
        "symmetric": case.symmetric,
        "loads": [load_record(load) for load in case.loads],
        # Runs of the paper's actuator are from before designs.
        **({} if design is None else {"design": design_text(own)}),
    }
    run = ActuatorRun(directory / case.name, description)
    note = directory / case.name / "provenance.json"
    if not note.exists():
        provenance = {"command": command, "code_version": code_version(), "date": today()}
        write_atomically(note, json.dumps(provenance))
    return run.states(actuator, case.loads)


def gather(
    directory: Path, chosen: Sequence[TruthCase] | None = None, design: Design | None = None
) -> xr.Dataset:
    """Return all finished states of the runs in a directory, in SI units.

    Parameters
    ----------
    directory : of all runs.
    chosen : cases to gather; by default all of `cases`.
    design : actuator of the runs, which the dataset then names; by default the paper's.

    Raises
    ------
    TruthError
        If there is none, or a file of a run is damaged.
    """
    rows: list[tuple[TruthCase, dict[str, Any]]] = []
    provenance: dict[str, Any] = {}
    for case in cases() if chosen is None else chosen:
        folder = directory / case.name
        if not (folder / "run.json").exists():
            continue
        try:
            run = read_record(folder / "run.json", _RUN_KEYS)
            level_from_record(run.get("mesh"), f"{folder / 'run.json'}: mesh")
            note = read_record(folder / "provenance.json", _NOTE_KEYS)
            found = ActuatorRun(folder, run).records()
        except (RecordError, RunError) as error:
            raise TruthError(f"truth: {error}") from error
        rows += [(case, record) for record in found]
        provenance[case.name] = {
            **note,
            "mesh": run["mesh"],
            "reached": len(found),
            "loads": len(case.loads),
        }
    if not rows:
        raise TruthError(f"truth: no finished state in {directory}; expected runs of `truth`")
    data: dict[str, Any] = {
        name: (
            ("state", *dims),
            factor * np.array([record[key] for _, record in rows], float),
            {"units": unit},
        )
        for name, key, dims, unit, factor, _ in _VARIABLES
    }
    geometry = ActuatorGeometry() if design is None else design.geometry
    stations = geometry.body_length * _ALONG
    axis = [_at_stations(record["axis"], stations) for _, record in rows]
    middle = [_middle_curvature(record["axis"], geometry.body_length) for _, record in rows]
    lean = np.array([_middle_lean(record, geometry) for _, record in rows])
    data["middle_shear"] = (("state", "across"), lean[:, 0], {"units": "rad"})
    data["middle_force"] = (("state", "across"), lean[:, 1], {"units": "N"})
    data["middle_curvature"] = (("state", "axis"), np.array(middle), {"units": "1/m"})
    data["axis_position"] = (("state", "station", "axis"), np.array(axis), {"units": "m"})
    stable = [-1 if record["stable"] is None else int(record["stable"]) for _, record in rows]
    data["stable"] = (("state",), np.array(stable), {"units": "1"})
    for name, values in (
        ("case", [case.name for case, _ in rows]),
        ("role", [case.role for case, _ in rows]),
    ):
        data[name] = (("state",), np.array(values, dtype=object))
    coords = {"station": ("station", stations, {"units": "m"})}
    attrs = {"runs": json.dumps(provenance), "mesh": _common_mesh(provenance)}
    if design is not None:
        attrs["design"] = design_text(design)
    return xr.Dataset(data, coords=coords, attrs=attrs)


def merged(held: xr.Dataset, found: xr.Dataset) -> xr.Dataset:
    """Merge the cases of two datasets in the order of `cases`; a case in both is taken from the second.

    Raises
    ------
    TruthError
        If their axes are stored at other stations.
    """
    stations = held["station"].values, found["station"].values
    if stations[0].shape != stations[1].shape or not np.allclose(
        *stations, rtol=0.0, atol=_SAME * stations[0].max()
    ):
        raise TruthError(f"truth: got stations {stations[1]} m, expected those of the file, {stations[0]} m")
    # Equal to rounding: without this, each would be a station of its own.
    found = found.assign_coords(station=held["station"])
    kept = held.isel(state=~np.isin(held["case"].values.astype(str), found["case"].values.astype(str)))
    both = xr.concat([kept, found], dim="state", join="exact", combine_attrs="drop")
    order = {case.name: number for number, case in enumerate(cases())}
    numbers = [order.get(str(name), len(order)) for name in both["case"].values]
    runs = {**json.loads(held.attrs["runs"]), **json.loads(found.attrs["runs"])}
    runs = dict(sorted(runs.items(), key=lambda run: order.get(run[0], len(order))))
    both = both.isel(state=np.argsort(numbers, kind="stable"))
    # A file's encoding limits the length of strings, which would cut longer names.
    return both.assign_attrs(runs=json.dumps(runs), mesh=_common_mesh(runs)).drop_encoding()


def truth_level(truth: xr.Dataset, case: str) -> MeshLevel:
    """Return the mesh level of a case's run.

    Raises
    ------
    ValueError
        If the file does not say it, or it is not a mesh level.
    """
    runs = parse_record(str(truth.attrs.get("runs", "{}")), "runs", {})
    # Files of one mesh may say it for all runs.
    record = runs.get(case, {}).get("mesh", truth.attrs.get("mesh"))
    if isinstance(record, str) and record.startswith("{"):
        record = parse_record(record, "mesh", {})
    return level_from_record(record, f"mesh of {case}")


def _common_mesh(runs: Mapping[str, Any]) -> str:
    """Return the mesh of all runs for an attribute, its name or the JSON of its counts; or ``several``."""
    records = [run.get("mesh") for run in runs.values()]
    meshes = {record if isinstance(record, str) else json.dumps(record, sort_keys=True) for record in records}
    return meshes.pop() if len(meshes) == 1 else "several"


def load_truth(file: Path) -> xr.Dataset:
    """Read a dataset of `gather`.

    Raises
    ------
    TruthError
        If it is no such file, with one line that names it and the fault.
    """
    try:
        truth = xr.load_dataset(file, engine="h5netcdf")
    except (OSError, ValueError, KeyError, RuntimeError) as error:
        reason = " ".join(str(error).split())
        raise TruthError(
            f"truth: cannot read {file} as netCDF ({reason}); expected a file of `truth --gather`"
        ) from error
    missing = {
        "case",
        "role",
        "stable",
        "middle_curvature",
        "middle_shear",
        *(name for name, *_ in _VARIABLES),
    } - set(truth)
    if missing:
        raise TruthError(
            f"truth: {file} lacks {', '.join(sorted(map(str, missing)))}; expected a file of `truth --gather`"
        )
    try:
        _refuse_states(truth)
        runs = parse_record(str(truth.attrs.get("runs", "{}")), "runs", {})
        for name, run in runs.items():
            refuse_faults(run, f"runs: {name}", _NOTE_KEYS)
        for name in np.unique(truth["case"].values.astype(str)):
            truth_level(truth, str(name))
    except ValueError as error:
        raise TruthError(f"truth: {file}: {error}") from error
    return truth


def _refuse_states(truth: xr.Dataset) -> None:
    """Raise a ValueError if there are no states, or their numbers are out of range."""
    states = truth.sizes.get("state", 0)
    if not states:
        raise ValueError("got no states, expected at least one")
    for name, _, dims, unit, _, most in _VARIABLES:
        found = truth[name]
        shape = (states, *(_LENGTHS[dim] for dim in dims))
        if found.shape != shape or found.dtype.kind not in "fiu":
            raise ValueError(f"{name}: got {found.dtype} of {found.shape}, expected numbers of shape {shape}")
        outside = ~(np.abs(found.values) <= most)
        if outside.any():
            raise ValueError(
                f"{name}: got {found.values[outside][0]:g} in state {np.argwhere(outside)[0, 0]}, expected "
                f"numbers from {-most:g} to {most:g} {unit}"
            )
    if strange := set(map(str, truth["role"].values)) - {"fit", "judge"}:
        raise ValueError(f"role: got {sorted(strange)[0]!r}, expected fit or judge")


def free_states(truth: xr.Dataset) -> Bool[np.ndarray, " states"]:
    """Return which states have neither tip force nor gravity, and are on the loading branch."""
    loaded = truth["tip_force"].values.any(axis=1) | truth["gravity"].values.any(axis=1)
    return ~loaded & on_loading_branch(truth, truth["case"].values)


def _middle_curvature(axis: dict[str, Any], body_length: float) -> np.ndarray:
    """Return the mean curvature and twist of the rod's axis over the middle of the body [1/m]."""
    inside = _in_the_middle(1e-3 * np.array(axis["arc_length_mm"]), body_length)
    mean: np.ndarray = np.array(axis["curvature_per_m"])[inside].mean(axis=0)
    return mean


def _in_the_middle(arc_length: np.ndarray, body_length: float) -> Bool[np.ndarray, " n"]:
    """Return which arc lengths [m] are of the middle of the body."""
    least, most = (share * body_length for share in _MIDDLE)
    slack = 1e-7 * body_length
    inside: np.ndarray = (arc_length >= least - slack) & (arc_length <= most + slack)
    return inside


def _middle_lean(record: dict[str, Any], geometry: ActuatorGeometry) -> np.ndarray:
    """Return the mean shear angles along d₁ and d₂ [rad], and the mean forces along these [N].

    They are means over the middle of the body, and NaN for records without the sections' frames.
    """
    axis = record["axis"]
    if "turn_rad" not in axis:
        return np.full((2, 2), np.nan)
    length = 1e-3 * np.array(axis["arc_length_mm"])
    inside = _in_the_middle(length, geometry.body_length)
    # Silicone and rod have one density, so the weight is proportional to the volumes.
    disc = np.pi / 4.0 * geometry.body_diameter**2
    body, cap = disc - 3.0 * geometry.chamber_area, disc * geometry.cap_length
    above = cap + body * (geometry.body_length - length[inside])
    force = np.array(record["tip_force_n"])
    weight = -np.array(record["base_force_n"]) - force
    forces = force + np.outer(above / (cap + body * geometry.body_length), weight)
    turns = Rotation.from_rotvec(np.array(axis["turn_rad"])[inside])
    lean = 1e-3 * np.array(axis["shear_mrad"])[inside]
    # A rotation about d₂ shears along d₁, one about d₁ against d₂.
    mean: np.ndarray = np.array(
        [lean[:, ::-1].mean(axis=0) * [1.0, -1.0], turns.inv().apply(forces)[:, :2].mean(axis=0)]
    )
    return mean


def _at_stations(axis: dict[str, Any], stations: np.ndarray) -> np.ndarray:
    """Return the rod's axis at the stations [m], interpolated between points millimetres apart."""
    position, length = np.array(axis["position_mm"]), np.array(axis["arc_length_mm"])
    return np.column_stack([np.interp(1e3 * stations, length, position[:, k]) for k in range(3)]) / 1e3
