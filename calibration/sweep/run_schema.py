"""Schemas of a sweep's files: run directory, path files, and attributes of the dataset.

Ranges exclude physically impossible values and do not judge results.
"""

from collections.abc import Mapping
from dataclasses import fields
from typing import Any

from fem_reference import (
    FLAG,
    ActuatorGeometry,
    Kind,
    Numbers,
    Object,
    OneOf,
    Text,
    level_from_record,
    refuse_faults,
)
from rodmodel import Domain

_LENGTH = Numbers(0.0, 10.0, "m")
_PRESSURE, _MOMENT = Numbers(0.0, 1e8, "Pa"), Numbers(0.0, 1e6, "N m")

_GEOMETRY = Object(
    {
        **{field.name: _LENGTH for field in fields(ActuatorGeometry) if field.name != "outer_wall_variation"},
        # Where walls differ.
        "outer_wall_variation": Numbers(-1.0, 100.0, "1", (3,), optional=True),
    }
)
_DOMAIN = Object(
    {
        "pressure_max": Numbers(0.0, 1e8, "Pa", (3,)),
        "pressure_sum_max": _PRESSURE,
        "moment_max": _MOMENT,
        "torque_max": Numbers(0.0, 1e6, "N m", null=True),
        "beside_share": Numbers(0.0, 1.0, "1", optional=True),
        "beside_max": Numbers(0.0, 1e8, "Pa", optional=True),
        "pressure_min": Numbers(0.0, 1e8, "Pa", (3,), optional=True),
    }
)
_WINDING = Object(
    {
        "psi": Numbers(-100.0, 100.0, "rad", optional=True),
        "pitch": Numbers(1e-6, 1.0, "m", optional=True),
        "spacing": Numbers(1e-6, 1.0, "m", optional=True),
    }
)

# Parameters of a winding of each layout.
_WOUND = {
    "double-helix": {"psi", "pitch"},
    "six-helix": {"psi", "pitch"},
    "ring": {"spacing"},
    "none": set(),
}

#: Schema of ``run.json``. The mesh is a name or counts, see `level_from_record`.
RUN_KEYS: Mapping[str, Kind] = {
    "layout": OneOf(tuple(_WOUND)),
    "winding": _WINDING,
    "orientations": Numbers(-100.0, 100.0, "rad", (2,), optional=True),
    "around": Numbers(1, 3, whole=True, optional=True),
    "geometry": _GEOMETRY,
    "body_area_m2": Numbers(1e-12, 100.0, "m²"),
    "end_compliance": Numbers(0.0, 1e3, "m/N"),
    "domain": _DOMAIN,
    "seed": Numbers(-(2**63), 2**63, whole=True),
    "mirror": FLAG,
    "pressure_step": _PRESSURE,
    "material": Object(
        {"body": Object(optional=True), "thread": Object(optional=True), "core": Object(optional=True)}
    ),
    # Where a sweep began on a snapped sheet: its chamber and side.
    "snapped": Object(
        {"chamber": Numbers(1, 3, whole=True), "side": Numbers(-1, 1, whole=True)}, optional=True
    ),
    # The canonical text of a design file; absent in files from before designs.
    "design": Text(optional=True),
    "command": Text(),
    "code_version": Text(),
    "date": Text(),
}

#: Schema of a dataset's attributes.
DATASET_KEYS: Mapping[str, Kind] = {
    **RUN_KEYS,
    "failures": Object(),
    "unstable": Object(),
    "paths": Numbers(0, 1e9, whole=True),
}

#: Schema of a state in a path's file.
STATE_KEYS: Mapping[str, Kind] = {
    "pressure": Numbers(0.0, 1e8, "Pa", (3,)),
    "moment": Numbers(-1e6, 1e6, "N m", (3,)),
    "applied_moment": Numbers(-1e6, 1e6, "N m", (3,)),
    # Absent in files from before states at imposed curvature.
    "held": Numbers(0, 1, whole=True, optional=True),
    "curvature": Numbers(-1e6, 1e6, "1/m", (3,)),
    "energy": Numbers(-1e9, 1e9, "J/m"),
    "volume": Numbers(-10.0, 10.0, "m²", (3,)),
    "hessian": Numbers(-1e9, 1e9, "", (6, 6)),
    "iterations": Numbers(0, 1e9, whole=True),
    "stable": Numbers(-1, 1, whole=True),
    "jumped": Numbers(0, 1, whole=True),
    "attempt": Numbers(1, 2, whole=True),
    "seconds": Numbers(-1e9, 1e9, "s"),
}

#: Schema of a path's last line, with the reason if it ended early.
END_KEYS: Mapping[str, Kind] = {
    "end": Object(
        {
            "attempts": Numbers(1, 2, whole=True),
            "failure": Text(optional=True),
            "unstable": Object(null=True, optional=True),
            "reached": Object(null=True, optional=True),
        }
    )
}


def refuse_run(run: Mapping[str, Any]) -> None:
    """Raise a ValueError or a TypeError if a dataset's attributes do not describe a sweep.

    Parameters
    ----------
    run : attributes after parsing their JSON.
    """
    refuse_faults(run, "attributes", DATASET_KEYS)
    level_from_record(run.get("mesh"), "attributes: mesh")
    ActuatorGeometry(**run["geometry"])
    domain_of_run(run)
    if missing := _WOUND[run["layout"]] - set(run["winding"]):
        raise ValueError(f"attributes: winding: got no {', '.join(sorted(missing))}, expected it")


def domain_of_run(run: Mapping[str, Any]) -> Domain:
    """Return the domain of a run's attributes."""
    lists = {key: tuple(value) for key, value in run["domain"].items() if isinstance(value, list)}
    return Domain(**{**run["domain"], **lists})
