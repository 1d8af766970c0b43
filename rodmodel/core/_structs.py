"""NumPy record types with the memory layout of the core's structures, so that nothing is copied."""

import numpy as np

from rodmodel.core._native import ffi

_SHAPES = {36: (3, 12), 24: (2, 12), 9: (3, 3)}


def _record(name: str) -> np.dtype:
    """Return the record type of a structure, with two indices for its matrices."""
    names, formats, offsets = [], [], []
    for field_name, field in ffi.typeof(name).fields:
        kind = field.type
        shape: tuple[int, ...] = ()
        if kind.kind == "array":
            shape, kind = _SHAPES.get(kind.length, (kind.length,)), kind.item
        names.append(field_name)
        formats.append((np.int32 if kind.cname == "int" else np.float64, shape))
        offsets.append(field.offset)
    size = ffi.sizeof(name)
    return np.dtype({"names": names, "formats": formats, "offsets": offsets, "itemsize": size})


INPUT, SOLUTION, JACOBIAN, NODE, TARGET = (
    _record(name) for name in ("rm_input", "rm_solution", "rm_jacobian", "rm_node", "rm_target")
)
#: Record type of `rm_inverse_result`, with the solution as a nested record.
INVERSE = np.dtype(
    [("pressure", np.float64, 3), ("distance", np.float64), ("solution", SOLUTION)]
    + [(name, np.int32) for name in ("reached", "converged", "nearest", "evaluations")]
)
if INVERSE.itemsize != ffi.sizeof("rm_inverse_result"):
    raise ImportError("rodmodel.core: the extension has another rm_inverse_result; rebuild it")
