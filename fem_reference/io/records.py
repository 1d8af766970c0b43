"""Validation of JSON objects from untrusted files against a schema: kind and range of each key.

Ranges exclude physically impossible values and do not judge results. Keys outside the schema are not checked.
"""

import json
import reprlib
from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any


class RecordError(ValueError):
    """Error for a file, or an object in one, that is not valid; the message is one line that names both."""


@dataclass(frozen=True, kw_only=True)
class Kind(ABC):
    """Kind of value that a key may hold.

    Parameters
    ----------
    null : whether the value may be null.
    optional : whether the key may be missing.
    """

    null: bool = False
    optional: bool = False

    @property
    @abstractmethod
    def expected(self) -> str:
        """Description for an error message."""

    @abstractmethod
    def holds(self, value: Any) -> bool:
        """Return whether a value other than null is of this kind."""


@dataclass(frozen=True)
class Numbers(Kind):
    """Finite number, or nested lists of numbers, from `least` to `most` inclusive.

    Parameters
    ----------
    least, most, unit : range and unit of each number.
    shape : shape of the nested lists, with None for any length from one; empty for a single number.
    whole : whether the numbers are integers.
    """

    least: float | int
    most: float | int
    unit: str = ""
    shape: tuple[int | None, ...] = ()
    whole: bool = False

    @property
    def expected(self) -> str:
        """Description for an error message."""
        number = "whole number" if self.whole else "number"
        size = " × ".join("n" if length is None else str(length) for length in self.shape)
        many = f"{size} {number}s, each" if self.shape else f"a {number}"
        return f"{many} from {self.least:g} to {self.most:g}{f' {self.unit}' if self.unit else ''}"

    def holds(self, value: Any) -> bool:
        """Return whether nested lists have the shape, and all numbers are in the range."""
        return self._holds(value, self.shape)

    def _holds(self, value: Any, shape: tuple[int | None, ...]) -> bool:
        if not shape:
            kinds = (int,) if self.whole else (int, float)
            return type(value) in kinds and self.least <= value <= self.most
        if not isinstance(value, list) or len(value) != (shape[0] or max(1, len(value))):
            return False
        return all(self._holds(inner, shape[1:]) for inner in value)


@dataclass(frozen=True)
class OneOf(Kind):
    """One of a few texts, or of true and false."""

    values: tuple[str | bool, ...]

    @property
    def expected(self) -> str:
        """Description for an error message."""
        return "one of " + ", ".join(json.dumps(value) for value in self.values)

    def holds(self, value: Any) -> bool:
        """Return whether the value is one of them; 1 does not count as true."""
        return any(type(value) is type(known) and value == known for known in self.values)


@dataclass(frozen=True)
class Text(Kind):
    """Any text."""

    expected: str = field(default="a text", init=False)

    def holds(self, value: Any) -> bool:
        """Return whether the value is a text."""
        return isinstance(value, str)


@dataclass(frozen=True)
class Object(Kind):
    """A JSON object with the keys of a schema, or with any keys."""

    keys: Mapping[str, Kind] = field(default_factory=dict)
    expected: str = field(default="a JSON object", init=False)

    def holds(self, value: Any) -> bool:
        """Return whether the value is an object; `refuse_faults` checks its keys."""
        return isinstance(value, dict)


FLAG = OneOf((False, True))


def read_record(file: Path, keys: Mapping[str, Kind]) -> dict[str, Any]:
    """Read a file with one JSON object.

    Raises
    ------
    RecordError
        If the file cannot be read, is not JSON in UTF-8, or does not match the schema.
    """
    try:
        text = file.read_text(encoding="utf-8")
    except (OSError, ValueError) as error:  # ValueError: text of another encoding
        raise RecordError(f"{file}: got {_one_line(error)}, expected a readable file") from error
    return parse_record(text, str(file), keys)


def parse_record(text: str, where: str, keys: Mapping[str, Kind]) -> dict[str, Any]:
    """Read a text with one JSON object; `where` names its source in error messages."""
    try:
        content = json.loads(text)
    except (ValueError, RecursionError) as error:
        raise RecordError(f"{where}: got {_one_line(error)}, expected a JSON object") from error
    refuse_faults(content, where, keys)
    return dict(content)


def refuse_faults(content: Any, where: str, keys: Mapping[str, Kind], inside: str = "") -> None:
    """Raise a `RecordError` if an object does not match a schema.

    Parameters
    ----------
    content : content read from JSON.
    where : file or other source that the error names.
    keys : schema.
    inside : keys that lead to the object, joined by dots.
    """
    if not isinstance(content, dict):
        raise RecordError(f"{where}: got {reprlib.repr(content)}, expected a JSON object")
    for key, kind in keys.items():
        name = f"{inside}.{key}" if inside else key
        if key not in content:
            if not kind.optional:
                raise RecordError(f"{where}: {name}: got nothing, expected {kind.expected}")
            continue
        value = content[key]
        if value is None and kind.null:
            continue
        if not kind.holds(value):
            null = " or null" if kind.null else ""
            raise RecordError(f"{where}: {name}: got {reprlib.repr(value)}, expected {kind.expected}{null}")
        if isinstance(kind, Object):
            refuse_faults(value, where, kind.keys, name)


def _one_line(error: BaseException) -> str:
    return " ".join(str(error).split())
