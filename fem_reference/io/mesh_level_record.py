"""JSON record of a mesh level: the name of a predefined level, or the counts of another."""

from dataclasses import asdict
from typing import Any

from fem_reference.io.records import Kind, Numbers, RecordError, refuse_faults
from fem_reference.mesh import LEVELS, MeshLevel, mesh_level

_COUNT = Numbers(1, 1000, whole=True)
_KEYS: dict[str, Kind] = {
    "inner_arc": _COUNT,
    "outer_arc": _COUNT,
    "partition_across": _COUNT,
    "partition_along": _COUNT,
    "inner_wall": _COUNT,
    "outer_wall_inside": _COUNT,
    "outer_wall_outside": _COUNT,
    "axial_size": Numbers(1e-3, 1e3, "mm"),
    "order": Numbers(1, 2, whole=True),
}


def level_record(level: str | MeshLevel) -> str | dict[str, Any]:
    """Return a mesh level for JSON: its name if it has one, also when given by its counts.

    Raises
    ------
    ValueError
        If the name is unknown.
    """
    wanted = mesh_level(level)
    for name, known in LEVELS.items():
        if known == wanted:
            return name
    return asdict(wanted)


def level_from_record(record: Any, where: str) -> MeshLevel:
    """Return the mesh level of a record that `level_record` wrote.

    Parameters
    ----------
    record : name or counts.
    where : file and key of the record, for error messages.

    Raises
    ------
    RecordError
        If it is neither.
    """
    if isinstance(record, str):
        try:
            return mesh_level(record)
        except ValueError as error:
            raise RecordError(f"{where}: {error}") from error
    refuse_faults(record, where, _KEYS)
    return MeshLevel(**{key: record[key] for key in _KEYS})
