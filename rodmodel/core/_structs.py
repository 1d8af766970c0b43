"""The core's structures as NumPy sees them: records of the same layout, so that no number is copied twice."""

import numpy as np

from rodmodel.core._native import ffi

_SHAPES = {36: (3, 12), 24: (2, 12), 9: (3, 3)}


def _record(name: str) -> np.dtype:
    """Record type of a structure, its matrices of two indices."""
    names, formats, offsets = [], [], []
    for field, at in ffi.typeof(name).fields:
        kind = at.type
        shape: tuple[int, ...] = ()
        if kind.kind == "array":
            shape, kind = _SHAPES.get(kind.length, (kind.length,)), kind.item
        names.append(field)
        formats.append((np.int32 if kind.cname == "int" else np.float64, shape))
        offsets.append(at.offset)
    size = ffi.sizeof(name)
    return np.dtype({"names": names, "formats": formats, "offsets": offsets, "itemsize": size})


INPUT, SOLUTION, JACOBIAN, NODE, TARGET = (
    _record(name) for name in ("rm_input", "rm_solution", "rm_jacobian", "rm_node", "rm_target")
)
#: What an inverse returns, its solution by itself.
INVERSE = np.dtype(
    [("pressure", np.float64, 3), ("distance", np.float64), ("solution", SOLUTION)]
    + [(name, np.int32) for name in ("reached", "converged", "nearest", "evaluations")]
)
if INVERSE.itemsize != ffi.sizeof("rm_inverse_result"):
    raise ImportError("rodmodel.core: the record of an inverse does not fit the core's; build it anew")
