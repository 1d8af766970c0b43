"""Material test in a CSV file, as test machines and spreadsheets write them."""

import csv
import io
import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from jaxtyping import Float

from calibration.material.columns import UNITS, Column, column
from calibration.measured import MeasuredError, read_text, with_point

# Separators in the order in which they are tried: with the first two, commas are decimal.
_SEPARATORS = (";", "\t", ",")
# Fewest rows of a test, and smallest range of ln λ.
_FEWEST, _SHORTEST = 3, 0.02
# Loading ends where the strain has gone back by this share of its range.
_GONE_BACK = 0.05
# Below this share of the largest stress, after it, the specimen is broken.
_BROKEN = 0.5
# Stretches beyond are strains in percent.
_LARGEST_STRETCH = 25.0
# A test begins near rest: a smaller first stretch is a strain.
_LEAST_FIRST = 0.5
# Rows closer to λ = 1 say nothing.
_AT_REST = 1e-6
_DEFORMATION = ("stretch", "strain", "true strain", "displacement")
_LOADING = ("stress", "true stress", "force")


class MaterialTestError(ValueError):
    """Error for an invalid file of a material test; the message is one line with the line number."""


@dataclass(frozen=True)
class Specimen:
    """Dimensions at rest, for files of force and displacement.

    Parameters
    ----------
    gauge_length : length between the marks or clamps [m].
    area : of the section [m²].
    """

    gauge_length: float | None = None
    area: float | None = None


@dataclass(frozen=True)
class MaterialTest:
    """Loading part of one test.

    Parameters
    ----------
    name : of the file.
    mode : one of `fem_reference.materials.MODES`.
    stretch : λ of the stretched direction.
    stress : force over the area at rest [Pa].
    passed_over : descriptions of what was left out.
    """

    name: str
    mode: str
    stretch: Float[np.ndarray, " rows"]
    stress: Float[np.ndarray, " rows"]
    passed_over: tuple[str, ...] = ()

    def up_to(self, most: float) -> "MaterialTest":
        """Return the rows up to a stretch, or in compression down to its inverse.

        Raises
        ------
        MaterialTestError
            If too few are left.
        """
        kept = np.abs(np.log(self.stretch)) <= abs(math.log(most)) * (1.0 + 1e-9)
        if kept.sum() < _FEWEST:
            raise MaterialTestError(
                f"{self.name}: got {kept.sum()} rows up to a stretch of {most:g}, expected at least {_FEWEST}"
            )
        return replace(self, stretch=self.stretch[kept], stress=self.stress[kept])


@dataclass(frozen=True)
class _Table:
    """Names of a file's columns, and the rows below, with their line numbers."""

    line: int
    names: list[str]
    units: list[str]
    rows: list[tuple[int, list[str]]]


def read_material_test(file: Path, mode: str = "uniaxial", specimen: Specimen | None = None) -> MaterialTest:
    """Read the loading part of a test.

    Columns are found by their names, in English or German, with the unit in the name or in the line below:
    stretch, strain or displacement; and stress or force. Stress and strain are nominal unless the name says
    ``true``, and are taken before true ones. Other columns, and lines before the names, are passed over. With
    semicolons or tabs, commas are decimal. Rows after the first unloading and after the specimen's break are
    left out.

    Parameters
    ----------
    file : CSV file.
    mode : one of `fem_reference.materials.MODES`.
    specimen : for files that have forces and displacements alone.

    Raises
    ------
    MaterialTestError
        With the file, the line, what came and what is expected.
    """
    try:
        text = read_text(file)
    except MeasuredError as error:
        raise MaterialTestError(str(error)) from error
    table = _table(file, text)
    columns = [column(name, unit) for name, unit in zip(table.names, table.units, strict=True)]
    deformation = _chosen(file, table, columns, _DEFORMATION)
    loading = _chosen(file, table, columns, _LOADING)
    lines, numbers, empty = _numbers(file, table, columns, (deformation, loading))
    specimen = specimen or Specimen()
    stretch = _stretch(file, table, deformation, numbers[:, 0], specimen)
    stress = _nominal(file, table, loading, numbers[:, 1], stretch, specimen)
    passed_over = [f"{empty} rows with an empty cell"] if empty else []
    kept, why = _loading_part(np.log(stretch), stress, lines)
    stretch, stress = stretch[kept], stress[kept]
    _check(file, table, deformation, stretch, stress)
    return MaterialTest(file.name, mode, stretch, stress, (*passed_over, *why))


def _table(file: Path, text: str) -> _Table:
    """Return the table of the first separator with which a line of names is found."""
    for separator in _SEPARATORS:
        try:
            reader = csv.reader(io.StringIO(text), delimiter=separator)
            rows = [(reader.line_num, [cell.strip() for cell in row]) for row in reader]
        except csv.Error as error:
            raise MaterialTestError(f"{file}: got {error}, expected a CSV file") from error
        if separator != ",":
            rows = [(line, [with_point(cell) for cell in row]) for line, row in rows]
        for n, (line, names) in enumerate(rows):
            found = {made.quantity for name in names if (made := column(name)) is not None}
            if found & set(_DEFORMATION) and found & set(_LOADING):
                below = [row for row in rows[n + 1 :] if any(row[1]) and not row[1][0].startswith("#")]
                units = [""] * len(names)
                if below and not any(_is_number(cell) for cell in below[0][1]):
                    given = below.pop(0)[1]
                    units = [*given, *units][: len(names)]
                return _Table(line, names, units, below)
    raise MaterialTestError(
        f"{file}: line 1: got no line of names, expected one with a stretch, strain or displacement and a "
        "stress or force"
    )


def _chosen(file: Path, table: _Table, columns: Sequence[Column | None], wanted: tuple[str, ...]) -> Column:
    """Return the column of the first wanted quantity that the file has."""
    for quantity in wanted:
        found = [made for made in columns if made is not None and made.quantity == quantity]
        if len(found) > 1:
            names = " and ".join(repr(made.name) for made in found)
            raise MaterialTestError(
                f"{file}: line {table.line}: got the columns {names}, expected one {quantity}"
            )
        if found:
            if found[0].scale is None:
                unit = f"the unit {found[0].unit!r}" if found[0].unit else "no unit"
                known = ", ".join(unit for unit in UNITS[quantity] if unit)
                raise MaterialTestError(
                    f"{file}: line {table.line}: {found[0].name}: got {unit}, expected one of {known} in the "
                    "name, such as (kPa), or in the line below"
                )
            return found[0]
    raise AssertionError("a line of names has both quantities")


def _numbers(
    file: Path, table: _Table, columns: Sequence[Column | None], wanted: tuple[Column, Column]
) -> tuple[list[int], Float[np.ndarray, "rows 2"], int]:
    """Return lines and numbers of the wanted columns in SI, and how many rows had an empty cell."""
    places = [columns.index(made) for made in wanted]
    lines, numbers, empty = [], [], 0
    for line, row in table.rows:
        cells = [row[place] if place < len(row) else "" for place in places]
        if not all(cells):
            empty += 1
            continue
        for made, cell in zip(wanted, cells, strict=True):
            if not _is_number(cell):
                raise MaterialTestError(
                    f"{file}: line {line}: {made.name}: got {cell!r}, expected a finite number"
                )
        lines.append(line)
        numbers.append([(made.scale or 0.0) * float(cell) for made, cell in zip(wanted, cells, strict=True)])
    if len(numbers) < _FEWEST:
        raise MaterialTestError(
            f"{file}: line {table.line + 1}: got {len(numbers)} rows of numbers, expected at least {_FEWEST}"
        )
    return lines, np.array(numbers), empty


def _stretch(
    file: Path, table: _Table, made: Column, values: Float[np.ndarray, " rows"], specimen: Specimen
) -> Float[np.ndarray, " rows"]:
    if made.quantity == "displacement":
        if specimen.gauge_length is None:
            raise MaterialTestError(
                f"{file}: line {table.line}: {made.name}: got displacements, expected --gauge-length-mm too"
            )
        values = values / specimen.gauge_length
    if made.quantity == "stretch":
        stretch = values
        if values[0] < _LEAST_FIRST:
            raise MaterialTestError(
                f"{file}: line {table.line + 1}: {made.name}: got a first stretch of {values[0]:g}, expected "
                "about 1; is the column a strain?"
            )
    elif made.quantity == "true strain":
        stretch = np.exp(np.minimum(values, 50.0))
    else:
        stretch = 1.0 + values
    if not (stretch > 0.0).all() or stretch.max() > _LARGEST_STRETCH:
        hint = "" if made.unit == "%" else "; is it in %?"
        raise MaterialTestError(
            f"{file}: line {table.line}: {made.name}: got stretches from {stretch.min():.3g} to "
            f"{stretch.max():.3g}, expected them between 0 and {_LARGEST_STRETCH:g}{hint}"
        )
    return stretch


def _nominal(
    file: Path,
    table: _Table,
    made: Column,
    values: Float[np.ndarray, " rows"],
    stretch: Float[np.ndarray, " rows"],
    specimen: Specimen,
) -> Float[np.ndarray, " rows"]:
    if made.quantity == "true stress":
        # The section of an incompressible solid is A/λ, in all three modes.
        return values / stretch
    if made.quantity == "force":
        if specimen.area is None:
            raise MaterialTestError(
                f"{file}: line {table.line}: {made.name}: got forces, expected --area-mm2 too"
            )
        return values / specimen.area
    return values


def _loading_part(
    strain: Float[np.ndarray, " rows"], stress: Float[np.ndarray, " rows"], lines: list[int]
) -> tuple[np.ndarray, list[str]]:
    """Return the rows of the first loading up to break, and descriptions of what is left out."""
    why = []
    size = np.abs(strain)
    highest = np.maximum.accumulate(size)
    back = np.flatnonzero(highest - size > _GONE_BACK * size.max())
    end = len(strain)
    if len(back):
        end = int(size[: back[0]].argmax()) + 1
        why.append(f"{len(strain) - end} rows after line {lines[end - 1]}, where the strain goes back")
    peak = int(np.abs(stress[:end]).argmax())
    after = np.abs(stress[peak:end])
    if (after < _BROKEN * after[0]).any():
        why.append(f"{end - peak - 1} rows after line {lines[peak]}, where the specimen breaks")
        end = peak + 1
    kept = np.arange(end)
    return kept[size[:end] > _AT_REST], why


def _check(
    file: Path, table: _Table, made: Column, stretch: Float[np.ndarray, " rows"], stress: np.ndarray
) -> None:
    def refuse(got: str, expected: str) -> MaterialTestError:
        return MaterialTestError(f"{file}: line {table.line}: got {got}, expected {expected}")

    if len(stretch) < _FEWEST:
        raise refuse(f"{len(stretch)} rows of a first loading", f"at least {_FEWEST}")
    if np.ptp(np.append(np.log(stretch), 0.0)) < _SHORTEST:
        hint = "; is the strain in %?" if made.unit in ("", "1", "-") else ""
        raise refuse(
            f"stretches from {stretch.min():.4g} to {stretch.max():.4g}",
            f"a strain of at least {100.0 * _SHORTEST:g} %{hint}",
        )
    work = (np.log(stretch) * stress).sum()
    if not work > 0.0:
        raise refuse(
            "stresses against the strain", "a positive stress in tension, a negative one in compression"
        )


def _is_number(cell: str) -> bool:
    try:
        return math.isfinite(float(cell))
    except ValueError:
        return False
