"""Checked access to a JSON object; errors name the file, the key, the value and what is expected."""

import json
import math
import reprlib
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

from rodmodel.io.ranges import ADJUSTMENT_RANGES, ARRAY_NUMBER, RANGES

_Read = TypeVar("_Read")
# Largest file [bytes]; the largest law takes about 80 MB.
_MOST_BYTES = 256 * 2**20
# Deepest nesting of objects and lists; the format needs four levels.
_MOST_DEPTH = 32
_RANGES = {**RANGES, **ADJUSTMENT_RANGES}
# Longest integer: a longer one has no double, and Python refuses to read some of them.
_MOST_DIGITS = 300


class CalibrationFileError(ValueError):
    """A calibration file that cannot be used; the message is one line."""


class Record:
    """One JSON object of a file, with the path of keys to it."""

    def __init__(self, content: Any, file: Path, place: str = "") -> None:
        self.file = file
        self.place = place
        if not isinstance(content, dict):
            raise CalibrationFileError(
                f"{_name(file)}: {place or 'the file'}: got {reprlib.repr(content)}, expected a JSON object"
            )
        self.content: dict[str, Any] = content

    @classmethod
    def from_file(cls, file: Path) -> "Record":
        """Read a file that holds one JSON object.

        Raises
        ------
        CalibrationFileError
            If the file cannot be read, is not JSON, repeats a key, holds a NaN, an infinity or a huge
            integer, or nests too deeply.
        """
        try:
            with file.open("rb") as stream:
                text = stream.read(_MOST_BYTES + 1)
            if len(text) > _MOST_BYTES:
                raise CalibrationFileError(
                    f"{_name(file)}: got more than {_MOST_BYTES} bytes, expected a calibration file"
                )
            return cls.from_text(text.decode("utf-8"), file)
        except CalibrationFileError:
            raise
        except (OSError, ValueError) as error:  # ValueError: text of another encoding, a name with a NUL
            raise CalibrationFileError(
                f"{_name(file)}: got {_one_line(error)}, expected a readable calibration file"
            ) from error

    @classmethod
    def from_text(cls, text: str, file: Path) -> "Record":
        """Read the text of a file; see `from_file`."""
        try:
            content = json.loads(
                text, parse_int=_integer, parse_constant=_NoNumber, object_pairs_hook=_without_twins
            )
        except json.JSONDecodeError as error:
            raise CalibrationFileError(
                f"{_name(file)}: got text that is not JSON at character {error.pos} of {len(text)} "
                f"({error.msg}), expected a whole calibration file"
            ) from error
        except RecursionError as error:
            raise CalibrationFileError(
                f"{_name(file)}: got too many brackets within one another, expected at most {_MOST_DEPTH}"
            ) from error
        _refuse_faults(content, file)
        return cls(content, file)

    def take(self, key: str, expected: str, valid: Callable[[Any], bool]) -> Any:
        """Return the value of a key; refuse a missing or invalid one, with `expected` as the remedy."""
        if key not in self.content:
            raise self.error(key, "nothing", expected)
        value = self.content[key]
        if not valid(value):
            raise self.error(key, reprlib.repr(value), expected)
        return value

    def error(self, key: str, value: str, expected: str) -> CalibrationFileError:
        """Return an error about one key."""
        return _error(self.file, self._full(key), value, expected)

    def record(self, key: str) -> "Record":
        """Return the object under a key."""
        return Record(self.take(key, "an object", lambda value: True), self.file, self._full(key))

    def each(self, key: str, most: int, what: str, read: Callable[["Record"], _Read]) -> tuple[_Read, ...]:
        """Return what `read` makes of each object in the list under a key, none without the key.

        Parameters
        ----------
        most : largest length of the list.
        what : what there is one object for, in words.
        """
        if key not in self.content:
            return ()
        listed = self.take(
            key,
            f"a list of 1 to {most} objects, one for each {what}",
            lambda value: isinstance(value, list) and 1 <= len(value) <= most,
        )
        found = []
        for index, content in enumerate(listed):
            try:
                found.append(read(Record(content, self.file)))
            except CalibrationFileError as error:
                raise CalibrationFileError(f"{error}, in {key}[{index}]") from error
        return tuple(found)

    def word(self, key: str) -> str:
        """Return the name under a key, of letters, digits, and -._ between them."""
        return str(self.take(key, "a name of letters, digits, -, . and _", _is_name))

    def number(self, key: str) -> float:
        """Return the number under a key, in its range in `rodmodel.io.ranges`."""
        allowed = _RANGES[self._full(key)]
        return float(self.take(key, allowed.expected, lambda v: _is_number(v) and allowed.holds(v)))

    def number_or_null(self, key: str) -> float | None:
        """Return the number under a key, in its range in `rodmodel.io.ranges`, or None for null."""
        if key in self.content and self.content[key] is None:
            return None
        return self.number(key)

    def three(self, key: str) -> tuple[float, float, float]:
        """Return the three numbers under a key, each in its range in `rodmodel.io.ranges`."""
        allowed = _RANGES[self._full(key)]
        first, second, third = self.take(
            key,
            f"three numbers, each {allowed.expected}",
            lambda value: (
                isinstance(value, list)
                and len(value) == 3
                and all(_is_number(number) and allowed.holds(number) for number in value)
            ),
        )
        return float(first), float(second), float(third)

    def nodes(self, key: str, most: int) -> tuple[float, ...]:
        """Return the numbers under a key, 1 to `most`, each in its range in `rodmodel.io.ranges`."""
        allowed = _RANGES[self._full(key)]
        values = self.take(
            key,
            f"1 to {most} numbers, each {allowed.expected}",
            lambda value: (
                isinstance(value, list)
                and 1 <= len(value) <= most
                and all(_is_number(number) and allowed.holds(number) for number in value)
            ),
        )
        return tuple(map(float, values))

    def array(self, key: str, rank: int) -> np.ndarray:
        """Return the vector (rank 1) or matrix (rank 2) of finite numbers under a key, not empty."""
        expected = f"a {'vector' if rank == 1 else 'matrix'} of finite numbers"
        value = self.take(key, expected, lambda v: isinstance(v, list))
        rows = value if rank == 2 else [value]
        lengths = {len(row) if isinstance(row, list) else -1 for row in rows}
        if len(lengths) != 1 or lengths & {-1, 0}:
            raise self.error(key, reprlib.repr(value), expected)
        for row in rows:
            for number in row:
                # Floats, nearly all, are told by the largest below: looking at each takes most of the time.
                if type(number) is not float and not _is_number(number):
                    raise self.error(key, f"{reprlib.repr(number)} among its numbers", expected)
        array = np.array(value, np.float64)
        largest = float(array.flat[np.argmax(np.abs(array))])
        if not ARRAY_NUMBER.holds(largest):
            raise self.error(
                key, f"{largest:g} among its numbers", f"{expected}, each {ARRAY_NUMBER.expected}"
            )
        return array

    def _full(self, key: str) -> str:
        return f"{self.place}.{key}" if self.place else key


class _NoNumber:
    """Literal in place of a number: NaN, Infinity, or an integer of hundreds of digits."""

    def __init__(self, text: str) -> None:
        self._text = text

    def __repr__(self) -> str:
        digits = len(self._text)
        return self._text if digits <= _MOST_DIGITS else f"an integer of {digits} digits"


@dataclass(frozen=True)
class _Twice:
    """Placeholder for an object that repeats a key."""

    key: str


def _refuse_faults(content: Any, file: Path) -> None:
    """Refuse a `_NoNumber`, a `_Twice`, and too many brackets within one another, under any key."""
    stack: list[tuple[str, Any, int]] = [("", content, 1)]
    while stack:
        place, value, depth = stack.pop()
        if isinstance(value, _NoNumber):
            raise _error(file, place, str(value), "a finite number")
        if isinstance(value, _Twice):
            raise _error(file, f"{place}.{value.key}" if place else value.key, "this key twice", "it once")
        if depth > _MOST_DEPTH and isinstance(value, dict | list):
            raise _error(file, place, "too many brackets within one another", f"at most {_MOST_DEPTH}")
        if isinstance(value, dict):
            stack += [(f"{place}.{key}" if place else key, inner, depth + 1) for key, inner in value.items()]
        elif isinstance(value, list):
            # Floats, most of a file, are skipped for speed: they are valid here.
            stack += [(place, inner, depth + 1) for inner in value if type(inner) is not float]


def _error(file: Path, place: str, value: str, expected: str) -> CalibrationFileError:
    # Keys may hold any text, and their path may be long.
    shown = place if place.isprintable() and len(place) <= 200 else reprlib.repr(place)
    return CalibrationFileError(f"{_name(file)}: {shown or 'the file'}: got {value}, expected {expected}")


def _integer(digits: str) -> int | _NoNumber:
    return int(digits) if len(digits) <= _MOST_DIGITS else _NoNumber(digits)


def _without_twins(pairs: list[tuple[str, Any]]) -> dict[str, Any] | _Twice:
    content: dict[str, Any] = {}
    for key, value in pairs:
        if key in content:
            return _Twice(key)
        content[key] = value
    return content


def _is_number(value: Any) -> bool:
    return type(value) in (int, float) and math.isfinite(value)


def _is_name(value: Any) -> bool:
    if not (isinstance(value, str) and value.isascii() and 0 < len(value) <= 64):
        return False
    return value.translate(str.maketrans("", "", "-._")).isalnum()


def _name(file: Path) -> str:
    """Return a file's name in one line."""
    name = str(file)
    return name if name.isprintable() else repr(name)


def _one_line(error: Exception) -> str:
    return " ".join(str(error).split())
