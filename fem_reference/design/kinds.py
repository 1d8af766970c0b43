"""Kinds of values in a design file: numbers with a unit, words, flags; reading, writing and schema of each.

A number has the unit that its key names. It is converted with decimal digits, so that 11.2 mm are 0.0112 m
exactly, and a design that is written and read again is the same one.
"""

import difflib
import math
from collections.abc import Iterable
from dataclasses import dataclass
from decimal import Decimal, localcontext
from typing import Any

# Digits with which degrees are turned into radians, and which any double can be told apart by.
_DIGITS = 50
_DEGREE = Decimal("3.14159265358979323846264338327950288419716939937510582") / 180
# Shares of π at which a number of degrees looks like radians, and how near.
_PARTS, _NEAR = 12, 1e-3


@dataclass(frozen=True)
class Unit:
    """Unit of a number in the file.

    Parameters
    ----------
    name : for people.
    power : a number times 10 to this power is in SI.
    mistaken : by name, the power of ten that other units have in this one, the likeliest first.
    degrees : whether the number is an angle in degrees, and radians are SI.
    """

    name: str
    power: int = 0
    mistaken: tuple[tuple[str, int], ...] = ()
    degrees: bool = False

    def to_si(self, value: Decimal | int) -> float:
        """Return a number of the file in SI, correctly rounded."""
        if not self.degrees:
            return float(Decimal(value).scaleb(self.power))
        with localcontext() as context:
            context.prec = _DIGITS
            return float(Decimal(value) * _DEGREE)

    def from_si(self, value: float) -> Decimal:
        """Return the shortest number for the file that `to_si` turns into this one."""
        if not self.degrees:
            return Decimal(repr(float(value))).scaleb(-self.power)
        with localcontext() as context:
            context.prec = _DIGITS
            exact = Decimal(value) / _DEGREE
        for digits in range(1, _DIGITS):
            with localcontext() as context:
                context.prec = digits
                short = +exact
            if self.to_si(short) == value:
                return short
        raise ValueError(f"psi: got {value!r}, expected a finite angle in radians")


MM = Unit("mm", -3, (("metres", 3), ("micrometres", -3)))
MPA = Unit("MPa", 6, (("pascals", -6), ("kilopascals", -3), ("gigapascals", 3)))
KPA = Unit("kPa", 3, (("pascals", -3), ("megapascals", 3)))
DEGREES = Unit("deg", degrees=True)
KG_PER_M3 = Unit("kg/m³", 0, (("g/cm³", 3),))
MM_PER_N = Unit("mm/N", -3, (("m/N", 3), ("µm/N", -3)))
NONE = Unit("")


class NotValidError(ValueError):
    """Error for a value of a wrong kind or out of range; the message is `got …, expected …`."""


class KeysError(ValueError):
    """Error for keys of a table that do not belong together, or of which some are missing.

    Parameters
    ----------
    arguments : of the keys in question, as `tables.TABLES` names them.
    message : `got …, expected …`.
    """

    def __init__(self, arguments: tuple[str, ...], message: str) -> None:
        super().__init__(message)
        self.arguments = arguments


@dataclass(frozen=True)
class Number:
    """Number or list of numbers.

    Parameters
    ----------
    unit : in the file.
    least, most : range in the file, both included.
    count : length of the list; 0 for one with any length from 1, None for a number alone.
    """

    unit: Unit
    least: float
    most: float
    count: int | None = None

    @property
    def expected(self) -> str:
        """Description for an error message."""
        one = f"from {self.least:g} to {self.most:g} {self.unit.name}".rstrip()
        if self.count is None:
            return f"a number {one}"
        return f"a list of {self.count or 'one or more'} numbers {one}"

    def read(self, value: Any) -> Any:
        """Return the number, or a tuple of them, in SI; raise a `NotValidError` for another value."""
        if self.count is None:
            return self._one(value)
        if not isinstance(value, list) or not value or (self.count and len(value) != self.count):
            raise NotValidError(f"got {shown(value)}, expected {self.expected}")
        return tuple(self._one(one) for one in value)

    def _one(self, value: Any) -> float:
        if isinstance(value, bool) or not isinstance(value, int | Decimal) or not math.isfinite(value):
            raise NotValidError(f"got {shown(value)}, expected {self.expected}")
        if not self.least <= value <= self.most:
            raise NotValidError(f"got {shown(value)}, expected {self.expected}{self._guess(float(value))}")
        if self.unit.degrees:
            _refuse_radians(float(value))
        return self.unit.to_si(value)

    def _guess(self, value: float) -> str:
        for name, power in self.unit.mistaken:
            if self.least <= value * 10.0**power <= self.most:
                return f"; is it in {name}?"
        return ""

    def write(self, value: Any) -> str:
        """Return the text of a number, or of a tuple of them, in SI."""
        if self.count is None:
            return number_text(self.unit.from_si(value))
        return f"[{', '.join(number_text(self.unit.from_si(one)) for one in value)}]"

    @property
    def schema(self) -> dict[str, Any]:
        """JSON schema of the value."""
        one = {"type": "number", "minimum": self.least, "maximum": self.most}
        if self.count is None:
            return one
        length = {"minItems": self.count or 1, **({"maxItems": self.count} if self.count else {})}
        return {"type": "array", "items": one, **length}


def _refuse_radians(degrees: float) -> None:
    """Refuse degrees that are a twelfth of π, or some of them, to three digits."""
    twelfths = round(degrees * _PARTS / math.pi)
    if twelfths and abs(twelfths) <= 2 * _PARTS and abs(degrees - twelfths * math.pi / _PARTS) < _NEAR:
        angle = 180 // _PARTS * twelfths
        raise NotValidError(f"got {degrees:g}, expected degrees; is it in radians, for {angle} deg?")


@dataclass(frozen=True)
class Word:
    """One of a few texts, or any line of text where none are named."""

    words: tuple[str, ...] = ()

    @property
    def expected(self) -> str:
        """Description for an error message."""
        return f"one of {', '.join(self.words)}" if self.words else "one line of text"

    def read(self, value: Any) -> str:
        """Return the text; raise a `NotValidError` for another value."""
        if not isinstance(value, str) or not value.isprintable() or not value.strip():
            raise NotValidError(f"got {shown(value)}, expected {self.expected}")
        if self.words and value not in self.words:
            raise NotValidError(f"got {shown(value)}, expected {self.expected}{nearest(value, self.words)}")
        return value

    def write(self, value: str) -> str:
        """Return the text in quotation marks."""
        escaped = value.replace("\\", "\\\\").replace('"', '\\"')
        return f'"{escaped}"'

    @property
    def schema(self) -> dict[str, Any]:
        """JSON schema of the value."""
        return {"enum": list(self.words)} if self.words else {"type": "string", "minLength": 1}


@dataclass(frozen=True)
class Flag:
    """True or false."""

    expected = "true or false"

    def read(self, value: Any) -> bool:
        """Return the flag; raise a `NotValidError` for another value."""
        if not isinstance(value, bool):
            raise NotValidError(f"got {shown(value)}, expected {self.expected}")
        return value

    def write(self, value: bool) -> str:
        """Return the word for it."""
        return "true" if value else "false"

    @property
    def schema(self) -> dict[str, Any]:
        """JSON schema of the value."""
        return {"type": "boolean"}


def number_text(value: Decimal) -> str:
    """Return a decimal number as TOML has it: without an exponent from 1e-4 to 1e15, without idle zeros."""
    value = value.normalize()
    if value == 0:
        return "0"
    text = f"{value:f}" if -5 < value.adjusted() < 15 else f"{value:e}"
    return text.replace("e+", "e")


def shown(value: Any) -> str:
    """Return a value of the file for an error message."""
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, str):
        return Word().write(value if len(value) < 60 else f"{value[:57]}...")
    if isinstance(value, list):
        inner = ", ".join(shown(one) for one in value[:6])
        return f"[{inner}{', ...' if len(value) > 6 else ''}]"
    if isinstance(value, dict):
        return "a table"
    return str(value).lower()


def nearest(word: str, words: Iterable[str]) -> str:
    """Return a question after the word that was meant, or nothing where none is near."""
    found = difflib.get_close_matches(word, list(words), n=1, cutoff=0.6)
    return f"; is it {found[0]}?" if found else ""
