"""Conversion of a solve's arguments to `rm_input` records, with errors that name the bad argument."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from rodmodel.core._native import lib
from rodmodel.core._structs import INPUT

LOADS = ("tip_force", "tip_moment", "gravity", "distributed_force", "follower_moment")
_UNITS = {
    "pressure": "three gauge pressures [Pa]",
    "tip_force": "three components [N]",
    "tip_moment": "three components [N m]",
    "gravity": "three components [m/s²]",
    "distributed_force": "three components [N/m]",
    "follower_force": "three components [N]",
    "follower_moment": "three components [N m]",
    "base_position": "three coordinates [m]",
    "base_rotation": "a rotation matrix, (3, 3)",
}


def row_of(given: Mapping[str, Any]) -> np.ndarray:
    """Return one `rm_input` record of arguments by name; a load that is None is absent.

    Raises
    ------
    ValueError
        For an unknown argument, or one of a wrong shape.
    """
    row = np.zeros(1, INPUT)
    for name, value in _present(given).items():
        row[name][0] = numbers_of(name, value, (shape_of(name),))
    return _finished(row, given)


def rows_of(given: Mapping[str, Any]) -> np.ndarray:
    """Return `rm_input` records of arguments with rows, or one for all rows; see `row_of`."""
    arrays = {name: numbers_of(name, value) for name, value in _present(given).items()}
    with_rows = [array for name, array in arrays.items() if array.ndim == 1 + len(shape_of(name))]
    count = max(map(len, with_rows), default=1)
    rows = np.zeros(count, INPUT)
    for name, array in arrays.items():
        shape = shape_of(name)
        rows[name] = numbers_of(name, array, (shape, (count, *shape)))
    return _finished(rows, given)


def numbers_of(name: str, value: Any, shapes: Sequence[tuple[int, ...]] = ()) -> np.ndarray:
    """Return an argument as an array of doubles; refuse other shapes than `shapes`, if any are given."""
    if name not in _UNITS:
        raise ValueError(f"{name}: got an argument of that name, expected any of {', '.join(_UNITS)}")
    try:
        array = np.asarray(value, np.float64)
    except (TypeError, ValueError) as error:
        raise ValueError(f"{name}: got {value!r}, expected {_UNITS[name]}") from error
    if shapes and array.shape not in shapes:
        expected = " or ".join(str(shape) for shape in shapes)
        raise ValueError(f"{name}: got shape {array.shape}, expected {expected}: {_UNITS[name]}")
    return array


def _present(given: Mapping[str, Any]) -> dict[str, Any]:
    """Return the arguments that are not None, the pressure among them."""
    if given.get("pressure") is None:
        raise ValueError(f"pressure: got None, expected {_UNITS['pressure']}")
    return {name: value for name, value in given.items() if value is not None}


def shape_of(name: str) -> tuple[int, ...]:
    """Return the shape of an argument of one solve."""
    return (3, 3) if name == "base_rotation" else (3,)


def _finished(rows: np.ndarray, given: Mapping[str, Any]) -> np.ndarray:
    """Set the flags of the arguments that are given."""
    present = _present(given)
    flags = 0
    if any(name in present for name in LOADS):
        flags |= lib.RM_LOADS
    if "follower_force" in present:
        flags |= lib.RM_FOLLOWER_FORCE
    if "base_position" in present or "base_rotation" in present:
        flags |= lib.RM_BASE
        if "base_rotation" not in present:
            rows["base_rotation"] = np.eye(3)
    rows["given"] = flags
    return rows
