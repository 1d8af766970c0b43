"""CSV file of measurements of a real actuator, with checks of all its faults."""

import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from calibration.measured.text import Cells, MeasuredError, read_cells
from rodmodel import Domain

PRESSURES = ("pressure_1_kpa", "pressure_2_kpa", "pressure_3_kpa")
ANGLE, PLANE = "bending_angle_deg", "bending_plane_deg"
POSITIONS = ("tip_x_mm", "tip_y_mm", "tip_z_mm")
FORCES = ("tip_force_x_n", "tip_force_y_n", "tip_force_z_n")
GRAVITY = ("gravity_x_m_per_s2", "gravity_y_m_per_s2", "gravity_z_m_per_s2")
OUTPUTS = (ANGLE, PLANE, *POSITIONS)
_KNOWN = (*PRESSURES, *OUTPUTS, *FORCES, *GRAVITY)
# Columns of a file without names, by their number.
_WITHOUT_NAMES = {count: (*PRESSURES, *OUTPUTS)[:count] for count in (4, 5, 8)}
# Likely unit of pressures, by the least ratio of the number to the map's largest pressure.
_TOO_LARGE = ((200.0, "Pa, which are 0.001 kPa"), (4.0, "mbar, which are 0.1 kPa"))
_LENIENT = "; --lenient passes it over"


@dataclass(frozen=True)
class Measured:
    """Measurements in SI units, one per row.

    Attributes
    ----------
    pressure : pressure readings, (rows, 3) [Pa].
    outputs : names of the measured columns, in the order of `values`.
    values : measured angles [rad] and positions [m], (rows, outputs).
    tip_force, gravity : loads in the world frame, (rows, 3) [N], [m/s²]; None if the file has none.
    lines : line in the file of each row.
    passed_over : descriptions of what was skipped.
    """

    pressure: np.ndarray
    outputs: tuple[str, ...]
    values: np.ndarray
    tip_force: np.ndarray | None
    gravity: np.ndarray | None
    lines: tuple[int, ...]
    passed_over: tuple[str, ...] = ()


def read_measured(file: Path, domain: Domain, lenient: bool = False) -> Measured:
    """Read and check a file of measurements.

    Parameters
    ----------
    file : CSV file with a line of names, which include the units, and a line of numbers for each
        measurement. Empty lines and lines that begin with # are skipped. With semicolons or tabs as
        separators, commas are decimal; see `read_cells`.
    domain : domain of the map.
    lenient : skip columns of other names and rows with an empty cell, and read 4, 5 or 8 columns without
        names as the pressures and the first of angle, plane and tip.

    Raises
    ------
    MeasuredError
        With the file, the line, the value and what is expected.
    """
    cells = read_cells(file)
    line, names, rows, passed = _with_names(file, cells, lenient)
    if lenient:
        others = [name for name in names if name not in _KNOWN]
        passed += [f"column {name!r}" for name in others]
        kept = [n for n, name in enumerate(names) if name not in others]
    else:
        kept = list(range(len(names)))
    names = [names[n] for n in kept]
    _check_names(file, line, names)
    numbers, lines = [], []
    for at, row in rows:
        if len(row) <= max(kept) or (not lenient and len(row) != len(names)):
            raise _wrong_count(file, at, row, max(kept) + 1, cells.separator)
        own = [row[n] for n in kept]
        empty = [name for name, cell in zip(names, own, strict=True) if not cell]
        if empty and lenient:
            passed.append(f"line {at}, {empty[0]} empty")
            continue
        numbers.append(_numbers(file, at, names, own))
        lines.append(at)
    if not numbers:
        raise MeasuredError(f"{file}: line {line + 1}: got no measurement, expected one on each line")
    table = np.array(numbers)
    _check_pressures(file, lines, table[:, [names.index(name) for name in PRESSURES]], domain)

    def columns(wanted: tuple[str, ...], unit: float) -> np.ndarray | None:
        if wanted[0] not in names:
            return None
        return np.stack([unit * table[:, names.index(name)] for name in wanted], axis=1)

    outputs = tuple(name for name in OUTPUTS if name in names)
    units = [1e-3 if name in POSITIONS else math.radians(1.0) for name in outputs]
    pressure = columns(PRESSURES, 1e3)
    assert pressure is not None
    return Measured(
        pressure=pressure,
        outputs=outputs,
        values=np.stack([u * table[:, names.index(n)] for u, n in zip(units, outputs, strict=True)], axis=1),
        tip_force=columns(FORCES, 1.0),
        gravity=columns(GRAVITY, 1.0),
        lines=tuple(lines),
        passed_over=tuple(passed),
    )


def _with_names(
    file: Path, cells: Cells, lenient: bool
) -> tuple[int, list[str], list[tuple[int, list[str]]], list[str]]:
    """Return the line of the names, the names, the rows, and what was skipped."""
    (line, first), *rest = cells.rows
    if not all(map(_is_number, filter(None, first))):
        return line, first, rest, []
    names = _WITHOUT_NAMES.get(len(first))
    expected = ", ".join(_KNOWN)
    if not lenient or names is None:
        counts = ", ".join(map(str, _WITHOUT_NAMES))
        hint = f"; --lenient takes {counts} columns in the order of the first ones" if not lenient else ""
        raise MeasuredError(
            f"{file}: line {line}: got numbers and no line of names before them, expected names among "
            f"{expected}{hint}"
        )
    return line, list(names), cells.rows, [f"the missing names, taken for {', '.join(names)}"]


def _check_names(file: Path, line: int, names: list[str]) -> None:
    def refuse(got: str, expected: str) -> MeasuredError:
        return MeasuredError(f"{file}: line {line}: got {got}, expected {expected}")

    for name in names:
        if name not in _KNOWN:
            got = f"an unknown column {name!r}" if name else "a column without a name"
            raise refuse(got, f"columns among {', '.join(_KNOWN)}{_LENIENT}")
        if names.count(name) > 1:
            raise refuse(f"{names.count(name)} columns {name!r}", "one")
    for name in PRESSURES:
        if name not in names:
            raise refuse(f"no column {name!r}", f"{', '.join(PRESSURES)}")
    for group in (FORCES, GRAVITY):
        missing = [name for name in group if name not in names]
        if 0 < len(missing) < 3:
            raise refuse(f"no column {missing[0]!r}", f"all of {', '.join(group)}, or none of them")
    if not any(name in names for name in OUTPUTS):
        raise refuse("no measured column", f"at least one of {', '.join(OUTPUTS)}")


def _wrong_count(file: Path, line: int, row: list[str], expected: int, separator: str) -> MeasuredError:
    remedy = ""
    if separator == "," and len(row) > expected:
        remedy = "; decimal commas need semicolons or tabs between the columns"
    return MeasuredError(
        f"{file}: line {line}: row: got {len(row)} values, expected {expected}, one for each column{remedy}"
    )


def _numbers(file: Path, line: int, names: list[str], row: list[str]) -> list[float]:
    def refuse(column: str, got: str, expected: str) -> MeasuredError:
        return MeasuredError(f"{file}: line {line}: {column}: got {got}, expected {expected}")

    numbers = []
    for name, cell in zip(names, row, strict=True):
        at_least_zero = name in PRESSURES or name == ANGLE
        expected = "zero or a positive number" if at_least_zero else "a finite number"
        if not cell:
            raise refuse(name, "an empty cell", f"{expected}; --lenient passes over its line")
        number = float(cell) if _is_number(cell) else math.nan
        if not math.isfinite(number) or (at_least_zero and number < 0.0):
            raise refuse(name, repr(cell), expected)
        numbers.append(number)
    return numbers


def _check_pressures(file: Path, lines: list[int], kpa: np.ndarray, domain: Domain) -> None:
    """Refuse pressures [kPa] outside the domain, and guess their unit from the largest."""
    beyond = [line for line, row in zip(lines, 1e3 * kpa, strict=True) if not domain.covers_pressure(row)]
    if not beyond:
        return
    most = 1e-3 * np.array(domain.pressure_max)
    ratio = float((kpa / most).max())
    unit = next((f"; are they in {unit}?" for least, unit in _TOO_LARGE if ratio > least), "")
    got = " ".join(f"{p:g}" for p in kpa[lines.index(beyond[0])])
    raise MeasuredError(
        f"{file}: line {beyond[0]}: pressure: got {got} kPa, expected what the map covers: at most "
        f"{domain.largest_pressures('kPa')}{unit}"
    )


def _is_number(cell: str) -> bool:
    try:
        float(cell)
    except ValueError:
        return False
    return True
