"""Checked access to a JSON object, for errors that name file, key, what came and what is expected."""

import json
import math
import reprlib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np


class CalibrationFileError(ValueError):
    """A calibration file that cannot be used; the message is one line."""


class Record:
    """One JSON object of a file, with the keys that led to it."""

    def __init__(self, content: Any, file: Path, place: str = "") -> None:
        self.file = file
        self.place = place
        if not isinstance(content, dict):
            raise CalibrationFileError(
                f"{file}: {place or 'the file'}: got {reprlib.repr(content)}, expected a JSON object"
            )
        self.content: dict[str, Any] = content

    @classmethod
    def from_file(cls, file: Path) -> "Record":
        """Read a file that holds one JSON object."""
        try:
            text = file.read_text(encoding="utf-8")
        except (OSError, UnicodeDecodeError) as error:
            raise CalibrationFileError(
                f"{file}: got {error}, expected a readable calibration file"
            ) from error
        try:
            return cls(json.loads(text), file)
        except json.JSONDecodeError as error:
            raise CalibrationFileError(
                f"{file}: got text that is not JSON at character {error.pos} of {len(text)} ({error.msg}), "
                "expected a whole calibration file"
            ) from error

    def take(self, key: str, expected: str, valid: Callable[[Any], bool]) -> Any:
        """Value of a key that must be there and valid; `expected` says in words what that is."""
        if key not in self.content:
            raise self.error(key, "nothing", expected)
        value = self.content[key]
        if not valid(value):
            raise self.error(key, reprlib.repr(value), expected)
        return value

    def error(self, key: str, came: str, expected: str) -> CalibrationFileError:
        """Error about one key."""
        return CalibrationFileError(f"{self.file}: {self._full(key)}: got {came}, expected {expected}")

    def record(self, key: str) -> "Record":
        """Object under a key."""
        return Record(self.take(key, "an object", lambda value: True), self.file, self._full(key))

    def text(self, key: str) -> str:
        """Non-empty string under a key."""
        return str(self.take(key, "a name", lambda value: isinstance(value, str) and value != ""))

    def flag(self, key: str) -> bool:
        """Truth value under a key."""
        return bool(self.take(key, "true or false", lambda value: isinstance(value, bool)))

    def number(self, key: str) -> float:
        """Finite number under a key."""
        return float(self.take(key, "a finite number", _is_finite))

    def positive(self, key: str) -> float:
        """Positive number under a key."""
        return float(self.take(key, "a positive number", _is_positive))

    def positive_or_none(self, key: str) -> float | None:
        """Positive number or null under a key."""
        value = self.take(key, "a positive number or null", lambda v: v is None or _is_positive(v))
        return None if value is None else float(value)

    def not_negative(self, key: str) -> float:
        """Number that is zero or positive under a key."""
        return float(self.take(key, "zero or a positive number", lambda v: _is_finite(v) and v >= 0))

    def three_positive(self, key: str) -> tuple[float, float, float]:
        """Three positive numbers under a key."""
        first, second, third = self.take(
            key,
            "three positive numbers",
            lambda value: isinstance(value, list) and len(value) == 3 and all(map(_is_positive, value)),
        )
        return float(first), float(second), float(third)

    def arrays(self, key: str, rank: int) -> list[np.ndarray]:
        """List of arrays of finite numbers, all of one rank, under a key."""
        expected = f"a list of {'vectors' if rank == 1 else 'matrices'} of finite numbers"
        values = self.take(key, expected, lambda v: isinstance(v, list) and v != [])
        return [self._array(key, value, rank, expected) for value in values]

    def array(self, key: str, rank: int) -> np.ndarray:
        """Array of finite numbers of a rank under a key."""
        expected = f"a {'vector' if rank == 1 else 'matrix'} of finite numbers"
        return self._array(key, self.take(key, expected, lambda v: isinstance(v, list)), rank, expected)

    def _array(self, key: str, value: Any, rank: int, expected: str) -> np.ndarray:
        try:
            array = np.asarray(value, dtype=np.float64)
        except (TypeError, ValueError) as error:
            raise self.error(key, reprlib.repr(value), expected) from error
        if array.ndim != rank or not np.all(np.isfinite(array)):
            raise self.error(key, f"{reprlib.repr(value)} of shape {array.shape}", expected)
        return array

    def _full(self, key: str) -> str:
        return f"{self.place}.{key}" if self.place else key


def _is_finite(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value)


def _is_positive(value: Any) -> bool:
    return _is_finite(value) and value > 0
