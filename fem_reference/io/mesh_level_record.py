"""What files say of a mesh level: the name of one that has a name, or the counts of one of your own."""

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
    """A mesh level as JSON holds it, the same for a name and for the counts that have it.

    Raises
    ------
    ValueError
        For an unknown name.
    """
    wanted = mesh_level(level) if isinstance(level, str) else level
    for name, known in LEVELS.items():
        if known == wanted:
            return name
    return asdict(wanted)


def level_from_record(record: Any, where: str) -> MeshLevel:
    """The mesh level that `level_record` told of.

    Parameters
    ----------
    record : name or counts.
    where : the file and the key that it was found under, for an error's message.

    Raises
    ------
    RecordError
        Where it is neither.
    """
    if isinstance(record, str):
        try:
            return mesh_level(record)
        except ValueError as error:
            raise RecordError(f"{where}: {error}") from error
    refuse_faults(record, where, _KEYS)
    return MeshLevel(**{key: record[key] for key in _KEYS})
