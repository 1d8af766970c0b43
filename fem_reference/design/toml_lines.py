"""Lines of the keys of a TOML text, which `tomllib` does not tell."""

import re
from collections.abc import Iterator
from typing import NamedTuple

_BARE = re.compile(r"[A-Za-z0-9_-]+")
_BLANK = re.compile(r"(?:[ \t\r\n]|#[^\n]*)*")
_SPACES = re.compile(r"[ \t]*")
_STRINGS = (
    re.compile(r'"""(?:[^\\]|\\.)*?"{3,5}', re.DOTALL),
    re.compile(r"'''.*?'{3,5}", re.DOTALL),
    re.compile(r'"(?:[^"\\\n]|\\.)*"'),
    re.compile(r"'[^'\n]*'"),
)

#: Names from the outermost table to the key.
Path = tuple[str, ...]


class Entry(NamedTuple):
    """A table's header or a key.

    Parameters
    ----------
    path : names of the tables around it, and its own.
    line : from 1.
    table : whether it is a header.
    """

    path: Path
    line: int
    table: bool


def toml_entries(text: str) -> list[Entry]:
    """Return headers and keys in the order of the text.

    Keys of inline tables are among them, and dotted keys as the path that they mean. Entries of a faulty text
    end where it can no longer be read.
    """
    return list(_entries(text))


def key_lines(text: str) -> dict[Path, int]:
    """Return the line on which each table and key begins first, by its path."""
    lines: dict[Path, int] = {}
    for entry in toml_entries(text):
        lines.setdefault(entry.path, entry.line)
    return lines


def repeated(text: str) -> list[tuple[Path, int, int]]:
    """Return keys and tables that stand twice, with the lines of the first and of the second time."""
    seen: dict[Path, int] = {}
    twice = []
    for entry in toml_entries(text):
        if entry.path in seen:
            twice.append((entry.path, seen[entry.path], entry.line))
        seen.setdefault(entry.path, entry.line)
    return twice


def _entries(text: str) -> Iterator[Entry]:
    at = 0
    table: Path = ()
    while (at := _past(_BLANK, text, at)) < len(text):
        line = _line(text, at)
        if text[at] == "[":
            opening = 2 if text.startswith("[[", at) else 1
            path, at = _dotted(text, at + opening)
            if not path or not text.startswith("]" * opening, at):
                return
            table, at = path, at + opening
            yield Entry(path, line, True)
            continue
        path, at = _dotted(text, at)
        if not path or not text.startswith("=", at):
            return
        yield Entry((*table, *path), line, False)
        inner: list[Entry] = []
        at = _past_value(text, at + 1, (*table, *path), inner)
        yield from inner
        if at < 0:
            return


def _line(text: str, at: int) -> int:
    return text.count("\n", 0, at) + 1


def _past(pattern: re.Pattern[str], text: str, at: int) -> int:
    found = pattern.match(text, at)
    return found.end() if found else at


def _string(text: str, at: int) -> int:
    """Return the end of a string that begins here; -1 without one."""
    for pattern in _STRINGS:
        found = pattern.match(text, at)
        if found:
            return found.end()
    return -1


def _dotted(text: str, at: int) -> tuple[Path, int]:
    """Return a key, dotted or not, and the place after it and its spaces; no names where there is none."""
    names: list[str] = []
    while True:
        at = _past(_SPACES, text, at)
        found = _BARE.match(text, at)
        if found:
            names.append(found.group())
            at = found.end()
        elif text[at : at + 1] in ('"', "'") and (end := _string(text, at)) > 0:
            names.append(text[at + 1 : end - 1])
            at = end
        else:
            return (), at
        at = _past(_SPACES, text, at)
        if text[at : at + 1] != ".":
            return tuple(names), at
        at += 1


def _past_value(text: str, at: int, path: Path, inner: list[Entry]) -> int:
    """Return the place after a value, -1 where it has no end; keys of inline tables go to ``inner``."""
    at = _past(_SPACES, text, at)
    first = text[at : at + 1]
    if first in ('"', "'"):
        return _string(text, at)
    if first == "[":
        return _past_list(text, at + 1, path, inner)
    if first == "{":
        return _past_inline_table(text, at + 1, path, inner)
    found = re.compile(r"[^,\]}#\n]+").match(text, at)
    return found.end() if found else -1


def _past_list(text: str, at: int, path: Path, inner: list[Entry]) -> int:
    while True:
        at = _past(_BLANK, text, at)
        if text[at : at + 1] == "]":
            return at + 1
        at = _past_value(text, at, path, inner)
        if at < 0:
            return -1
        at = _past(_BLANK, text, at)
        if text[at : at + 1] == ",":
            at += 1
        elif text[at : at + 1] != "]":
            return -1


def _past_inline_table(text: str, at: int, path: Path, inner: list[Entry]) -> int:
    while True:
        at = _past(_BLANK, text, at)
        if text[at : at + 1] == "}":
            return at + 1
        begins = at
        names, at = _dotted(text, at)
        if not names or text[at : at + 1] != "=":
            return -1
        inner.append(Entry((*path, *names), _line(text, begins), False))
        at = _past_value(text, at + 1, (*path, *names), inner)
        if at < 0:
            return -1
        at = _past(_BLANK, text, at)
        if text[at : at + 1] == ",":
            at += 1
        elif text[at : at + 1] != "}":
            return -1
