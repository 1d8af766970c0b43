"""Cells of a text file of measurements, for the encodings, separators and decimal commas of spreadsheets."""

import csv
import io
import re
from dataclasses import dataclass
from pathlib import Path

_SEPARATORS = (";", "\t", ",")
_DECIMAL_COMMA = re.compile(r"[+-]?\d*,\d+([eE][+-]?\d+)?")
_BYTE_ORDER_MARKS = (b"\xff\xfe", b"\xfe\xff")


class MeasuredError(ValueError):
    """Error for an invalid file of measurements; the message is one line with the line number."""


@dataclass(frozen=True)
class Cells:
    """Cells of the lines that are neither empty nor comments, with their line numbers.

    Attributes
    ----------
    separator : separator between cells.
    rows : line number and cells; decimal commas are points unless the separator is a comma.
    """

    separator: str
    rows: list[tuple[int, list[str]]]


def read_cells(file: Path) -> Cells:
    """Read the cells of a text file that a spreadsheet or a program wrote.

    The separator is a semicolon, a tab or a comma: the first of these in the line of names. With semicolons
    and tabs, a comma between digits is a decimal comma, as in files of German Excel. Trailing empty columns,
    as spreadsheets append them, are left out.

    Parameters
    ----------
    file : text in UTF-8, UTF-16 with byte order mark, or Windows code page 1252.

    Raises
    ------
    MeasuredError
        If it cannot be read, or is empty.
    """
    lines = read_text(file).splitlines()
    declared = next(
        (line[4] for line in lines[:1] if line.lower().startswith("sep=") and len(line) == 5), None
    )
    if declared is not None:
        lines[0] = ""
    header = next((line for line in lines if line.strip() and not line.lstrip().startswith(("#", '"#'))), "")
    separator = declared or next((mark for mark in _SEPARATORS if mark in header), ",")
    try:
        reader = csv.reader(io.StringIO("\n".join(lines)), delimiter=separator)
        rows = [(reader.line_num, [cell.strip() for cell in row]) for row in reader]
    except csv.Error as error:
        raise MeasuredError(f"{file}: got {error}, expected a CSV file") from error
    rows = [(line, row) for line, row in rows if any(row) and not row[0].startswith("#")]
    if not rows:
        raise MeasuredError(f"{file}: line 1: got an empty file, expected names of columns")
    if separator != ",":
        rows = [(line, [with_point(cell) for cell in row]) for line, row in rows]
    most = max(len(row) for _, row in rows)
    filled = [n for n in range(most) if any(n < len(row) and row[n] for _, row in rows)]
    last = max(filled) + 1
    return Cells(separator, [(line, row[:last]) for line, row in rows])


def read_text(file: Path) -> str:
    """Read a text file in UTF-8, UTF-16 with byte order mark, or Windows code page 1252.

    Raises
    ------
    MeasuredError
        If it cannot be read, or is a workbook.
    """
    try:
        content = file.read_bytes()
    except OSError as error:
        raise MeasuredError(f"{file}: got {error.strerror}, expected a readable CSV file") from error
    if content.startswith(b"PK\x03\x04"):
        raise MeasuredError(f"{file}: got a workbook, expected a CSV file: save the sheet as one")
    try:
        return _decoded(content)
    except UnicodeDecodeError as error:
        raise MeasuredError(f"{file}: got {error}, expected a CSV file in UTF-8") from error


def with_point(cell: str) -> str:
    """Return a number with a decimal comma as one with a point; any other text as it is."""
    return cell.replace(",", ".") if _DECIMAL_COMMA.fullmatch(cell) else cell


def _decoded(content: bytes) -> str:
    if content.startswith(_BYTE_ORDER_MARKS):
        return content.decode("utf-16")
    try:
        return content.decode("utf-8-sig")
    except UnicodeDecodeError:
        # Tried last, because it accepts nearly all bytes.
        return content.decode("cp1252")
