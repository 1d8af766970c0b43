"""Reading a design file: every fault with its file, line and key, all of them at once."""

import re
import tomllib
from collections.abc import Callable, Mapping, Sequence
from decimal import Decimal
from pathlib import Path
from typing import Any, NamedTuple, TypeVar

from fem_reference.design.design import Design
from fem_reference.design.kinds import KeysError, NotValidError, nearest, shown
from fem_reference.design.material_table import FitMaterial, silicone_of
from fem_reference.design.tables import TABLES, Key, Table
from fem_reference.design.toml_lines import key_lines, repeated
from fem_reference.design.winding_table import thread_of, winding_of
from fem_reference.geometry import ActuatorGeometry, Core, NoWinding, Thread, Winding

_T = TypeVar("_T")
_PLACE = re.compile(r"\s*\(at (?:line (\d+), column \d+|end of document)\)$")
_BY_NAME = {table.name: table for table in TABLES}


class Fault(NamedTuple):
    """One fault of a design file: its line, the key with its table, and `got …, expected …`."""

    line: int
    key: str
    message: str


class DesignError(ValueError):
    """Error for a design file that is not valid; the message is one line on its first fault.

    Parameters
    ----------
    where : the file.
    faults : all of them, in the order of the file.
    """

    def __init__(self, where: str, faults: Sequence[Fault]) -> None:
        self.where = where
        self.faults = tuple(faults)
        #: One line for each fault.
        self.lines = tuple(f"{where}, line {line}: {key}: {message}" for line, key, message in self.faults)
        more = len(self.lines) - 1
        told = f"; and {more} more, see `rodmodel-design check`" if more else ""
        super().__init__(f"{self.lines[0]}{told}")


def read_design(file: str | Path, fit: FitMaterial | None = None) -> Design:
    """Read a design file.

    Parameters
    ----------
    file : TOML in UTF-8.
    fit : fits a law to the CSV file of a test, where a design may name one; `calibration` has it.

    Raises
    ------
    DesignError
        For a file that cannot be read, or is not a valid design.
    """
    path = Path(file)
    try:
        text = path.read_text(encoding="utf-8")
    except OSError as error:
        fault = Fault(1, "file", f"got {error.strerror or error}, expected a file that can be read")
        raise DesignError(str(file), [fault]) from error
    except UnicodeDecodeError as error:
        line = path.read_bytes().count(b"\n", 0, error.start) + 1
        fault = Fault(line, "file", f"got {error.reason}, expected text in UTF-8")
        raise DesignError(str(file), [fault]) from error
    return parse_design(text, str(file), path.parent, fit)


def parse_design(
    text: str, where: str = "design", folder: Path = Path(), fit: FitMaterial | None = None
) -> Design:
    """Read the text of a design.

    Parameters
    ----------
    text : TOML.
    where : name of its source in error messages.
    folder : beside which a test's file lies.
    fit : see `read_design`.

    Raises
    ------
    DesignError
        For a text that is not a valid design.
    """
    try:
        content = tomllib.loads(text, parse_float=Decimal)
    except (tomllib.TOMLDecodeError, ArithmeticError) as error:
        raise DesignError(where, [_syntax_fault(text, str(error))]) from error
    reading = _Reading(text, content)
    design = reading.design(folder, fit)
    if design is None or reading.faults:
        raise DesignError(where, sorted(reading.faults))
    return design


def _syntax_fault(text: str, message: str) -> Fault:
    place = _PLACE.search(message)
    last = text.count("\n") + 1
    line = int(place.group(1)) if place and place.group(1) else last
    for path, first, second in repeated(text):
        if second <= line:
            expected = f"got it again, expected it once; it stands in line {first} too"
            return Fault(second, ".".join(path), expected)
    begun = [path for path, begins in key_lines(text).items() if begins <= line]
    key = ".".join(begun[-1]) if begun else "syntax"
    told = _PLACE.sub("", message).replace("\n", "\\n")
    return Fault(line, key, f"got {told[:1].lower()}{told[1:]}, expected TOML")


class _Reading:
    """One pass over the content of a file, which gathers faults."""

    def __init__(self, text: str, content: Mapping[str, Any]) -> None:
        self.faults: list[Fault] = []
        self._content = content
        self._lines = key_lines(text)
        self._last = max(1, len(text.splitlines()))

    def design(self, folder: Path, fit: FitMaterial | None) -> Design | None:
        """Return the design, or None where a part of it could not be made."""
        self._refuse_unknown_tables()
        given: dict[str, Any] = {table.name: self._values(table) for table in TABLES}
        winding = self._part("winding", given, winding_of)
        silicone = self._part("material", given, lambda values: silicone_of(values, folder, fit))
        parts: dict[str, Any] = {
            "geometry": self._part("dimensions", given, lambda values: ActuatorGeometry(**values)),
            "core": self._part("core", given, lambda values: Core(**values)),
            "winding": winding,
            "thread": self._thread(given, winding),
        }
        own, ends, pressures, material = (given[name] for name in ("", "ends", "pressures", "material"))
        if silicone is None or None in parts.values() or None in (own, ends, pressures, material):
            return None
        parts |= {"material": silicone.law, "material_source": silicone.source, **own, **ends, **pressures}
        if "pressure_max" in parts:
            parts.setdefault("pressure_sum_max", sum(parts["pressure_max"]))
        if "density" in material:
            parts["density"] = material["density"]
        return self._made(tuple(_BY_NAME), lambda: Design(**parts))

    def _thread(self, given: Mapping[str, Any], winding: Winding | None) -> Thread | None:
        if "thread" not in self._content and winding is not None and not isinstance(winding, NoWinding):
            self._fault(("thread",), "got no such table, expected it for a winding")
            return None
        if "thread" not in self._content:
            return Thread()
        return self._part("thread", given, thread_of)

    def _part(self, name: str, given: Mapping[str, Any], make: Callable[[dict[str, Any]], _T]) -> _T | None:
        values = given[name]
        return None if values is None else self._made((name,), lambda: make(values))

    def _made(self, tables: tuple[str, ...], make: Callable[[], _T]) -> _T | None:
        """Make a part; a ValueError that names an argument becomes a fault of its key."""
        try:
            return make()
        except KeysError as error:
            self._fault_of_arguments(tables, error.arguments, str(error))
        except ValueError as error:
            names, _, message = str(error).partition(": ")
            self._fault_of_arguments(tables, re.split(r" and |, ", names), message)
        return None

    def _fault_of_arguments(self, tables: tuple[str, ...], arguments: Sequence[str], message: str) -> None:
        keys = [
            (table.name, key.name)
            for table in map(_BY_NAME.__getitem__, tables)
            for argument in arguments
            if (key := table.key_of(argument)) is not None
        ]
        if not keys:
            raise ValueError(f"{arguments[0]}: {message}")
        self.faults.append(Fault(self._line(keys[0]), " and ".join(map(_dotted, keys)), message))

    def _fault(self, path: tuple[str, ...], message: str) -> None:
        self.faults.append(Fault(self._line(path), _dotted(path), message))

    def _line(self, path: tuple[str, ...]) -> int:
        """Line of a key; for one that is missing, that of its table, or the last one."""
        path = tuple(name for name in path if name)
        return self._lines.get(path) or self._lines.get(path[:1]) or self._last

    def _refuse_unknown_tables(self) -> None:
        known = {key.name for key in _BY_NAME[""].keys} | set(_BY_NAME)
        for name in self._content:
            if name in known:
                continue
            kind = "table" if isinstance(self._content[name], dict) else "key"
            message = f"got an unknown {kind}, expected {', '.join(sorted(known - {''}))}"
            self._fault((name,), message + nearest(name, known))

    def _values(self, table: Table) -> dict[str, Any] | None:
        """Return a table's values in SI by argument; None where a key is missing or not valid."""
        found = self._content if not table.name else self._content.get(table.name)
        if found is None:
            if table.optional:
                return {}
            names = ", ".join(key.name for key in table.keys if not key.optional)
            needed = f" with {names}" if names else ""
            self._fault((table.name,), f"got no such table, expected [{table.name}]{needed}")
            return None
        if not isinstance(found, dict):
            self._fault((table.name,), f"got {shown(found)}, expected the table [{table.name}]")
            return None
        if table.name:
            self._refuse_unknown_keys(table, found)
        values, good = {}, True
        for key in table.keys:
            if key.name in found:
                try:
                    values[key.argument] = key.kind.read(found[key.name])
                except NotValidError as error:
                    self._fault((table.name, key.name), str(error))
                    good = False
            elif not key.optional:
                self._fault((table.name, key.name), f"got nothing, expected {key.kind.expected}")
                good = False
        return values if good else None

    def _refuse_unknown_keys(self, table: Table, found: Mapping[str, Any]) -> None:
        known = [key.name for key in table.keys]
        for name in found:
            if name not in known:
                meant = _meant(name, table.keys) or nearest(name, known)
                message = f"got an unknown key, expected one of {', '.join(known)}{meant}"
                self._fault((table.name, name), message)


def _meant(name: str, keys: Sequence[Key]) -> str:
    """Return a question after the key whose unit another name has, as body_diameter or body_diameter_m."""
    for key in keys:
        if key.name.startswith(f"{key.argument}_") and name.rpartition("_")[0] == key.argument:
            return f"; is it {key.name}, in the unit that the key names?"
        if name == key.argument:
            return f"; is it {key.name}?"
    return ""


def _dotted(path: Sequence[str]) -> str:
    return ".".join(name for name in path if name)
