"""Measurements of a real actuator: the CSV file, and all that can be wrong with it."""

import csv
import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from rodmodel import Domain

PRESSURES = ("pressure_1_kpa", "pressure_2_kpa", "pressure_3_kpa")
ANGLE, PLANE = "bending_angle_deg", "bending_plane_deg"
POSITIONS = ("tip_x_mm", "tip_y_mm", "tip_z_mm")
FORCES = ("tip_force_x_n", "tip_force_y_n", "tip_force_z_n")
GRAVITY = ("gravity_x_m_per_s2", "gravity_y_m_per_s2", "gravity_z_m_per_s2")
_OUTPUTS = (ANGLE, PLANE, *POSITIONS)
_KNOWN = (*PRESSURES, *_OUTPUTS, *FORCES, *GRAVITY)


class MeasuredError(ValueError):
    """A file of measurements that cannot be used; the message is one line with the line's number."""


@dataclass(frozen=True)
class Measured:
    """Measurements in SI, one row each.

    Attributes
    ----------
    pressure : as read, (rows, 3) [Pa].
    outputs : names of the columns that were measured, in the order of `values`.
    values : (rows, outputs): angles [rad], positions [m].
    tip_force, gravity : (rows, 3) [N], [m/s²], world frame; None where the file has none.
    lines : of the file, one for each row.
    """

    pressure: np.ndarray
    outputs: tuple[str, ...]
    values: np.ndarray
    tip_force: np.ndarray | None
    gravity: np.ndarray | None
    lines: tuple[int, ...]


def read_measured(file: Path, domain: Domain) -> Measured:
    """Read and check a file of measurements.

    Parameters
    ----------
    file : CSV with a line of names, which hold the units, and a line of numbers for each measurement. Empty
        lines and lines that begin with # are passed over.
    domain : pressures that the map covers.

    Raises
    ------
    MeasuredError
        Names the file, the line, what came and what is expected.
    """
    try:
        with file.open(newline="", encoding="utf-8-sig") as stream:
            reader = csv.reader(stream)
            rows = [(reader.line_num, [cell.strip() for cell in row]) for row in reader]
    except OSError as error:
        raise MeasuredError(f"{file}: got {error.strerror}, expected a readable CSV file") from error
    except (UnicodeDecodeError, csv.Error) as error:
        raise MeasuredError(f"{file}: got {error}, expected a CSV file in UTF-8") from error
    rows = [(line, row) for line, row in rows if any(row) and not row[0].startswith("#")]
    if not rows:
        raise MeasuredError(f"{file}: line 1: got an empty file, expected names of columns")
    (line, names), *rest = rows
    _check_names(file, line, names)
    if not rest:
        raise MeasuredError(f"{file}: line {line + 1}: got no measurement, expected one on each line")
    table = np.array([_numbers(file, line, names, row, domain) for line, row in rest])

    def columns(wanted: tuple[str, ...], unit: float) -> np.ndarray | None:
        if wanted[0] not in names:
            return None
        return np.stack([unit * table[:, names.index(name)] for name in wanted], axis=1)

    outputs = tuple(name for name in _OUTPUTS if name in names)
    units = [1e-3 if name in POSITIONS else math.radians(1.0) for name in outputs]
    pressure = columns(PRESSURES, 1e3)
    assert pressure is not None
    return Measured(
        pressure=pressure,
        outputs=outputs,
        values=np.stack([u * table[:, names.index(n)] for u, n in zip(units, outputs, strict=True)], axis=1),
        tip_force=columns(FORCES, 1.0),
        gravity=columns(GRAVITY, 1.0),
        lines=tuple(line for line, _ in rest),
    )


def _check_names(file: Path, line: int, names: list[str]) -> None:
    def refuse(came: str, expected: str) -> MeasuredError:
        return MeasuredError(f"{file}: line {line}: got {came}, expected {expected}")

    for name in names:
        if name not in _KNOWN:
            raise refuse(f"a column {name!r}", f"columns among {', '.join(_KNOWN)}")
        if names.count(name) > 1:
            raise refuse(f"{names.count(name)} columns {name!r}", "one")
    for name in PRESSURES:
        if name not in names:
            raise refuse(f"no column {name!r}", f"{', '.join(PRESSURES)}")
    for group in (FORCES, GRAVITY):
        missing = [name for name in group if name not in names]
        if 0 < len(missing) < 3:
            raise refuse(f"no column {missing[0]!r}", f"all of {', '.join(group)}, or none of them")
    if not any(name in names for name in _OUTPUTS):
        raise refuse("no measured column", f"at least one of {', '.join(_OUTPUTS)}")


def _numbers(file: Path, line: int, names: list[str], row: list[str], domain: Domain) -> list[float]:
    def refuse(what: str, came: str, expected: str) -> MeasuredError:
        return MeasuredError(f"{file}: line {line}: {what}: got {came}, expected {expected}")

    if len(row) != len(names):
        raise refuse("row", f"{len(row)} values", f"{len(names)}, one for each column")
    numbers = []
    for name, cell in zip(names, row, strict=True):
        try:
            number = float(cell)
        except ValueError:
            number = math.nan
        at_least_zero = name in PRESSURES or name == ANGLE
        if not math.isfinite(number) or (at_least_zero and number < 0.0):
            raise refuse(
                name, repr(cell), "zero or a positive number" if at_least_zero else "a finite number"
            )
        numbers.append(number)
    pressure = [1e3 * numbers[names.index(name)] for name in PRESSURES]
    if not domain.covers_pressure(pressure):
        first, second, third = (1e-3 * most for most in domain.pressure_max)
        raise refuse(
            "pressure",
            " ".join(f"{1e-3 * p:g}" for p in pressure) + " kPa",
            f"what the map covers: at most {first:g}, {second:g}, {third:g} kPa in chambers 1, 2, 3 "
            f"and {1e-3 * domain.pressure_sum_max:g} kPa in sum",
        )
    return numbers
