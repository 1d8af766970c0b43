"""File of a path: one line per state, written as soon as it is computed, then one for the path's end."""

import json
import os
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from calibration.sweep.run_schema import END_KEYS, STATE_KEYS
from fem_reference import RecordError, parse_record, refuse_faults
from rodmodel.io import sync_folder


class PathFileError(ValueError):
    """Error for a damaged path file; the message is one line that names file and line."""


@dataclass(frozen=True)
class PathRecord:
    """States of a path on file, and how it ended (None while it is unfinished)."""

    states: tuple[dict[str, Any], ...]
    end: dict[str, Any] | None

    @property
    def failed(self) -> bool:
        """Whether the path ended early, for another reason than a loss of stability."""
        return self.end is not None and "failure" in self.end

    @property
    def lost_stability(self) -> bool:
        """Whether the path ended where the section loses its stability."""
        return self.end is not None and "unstable" in self.end


def path_file(directory: Path, name: str) -> Path:
    """Return the file of a path in a run's directory."""
    return directory / "paths" / f"{name}.jsonl"


def read_path(file: Path) -> PathRecord:
    """Read a path's file; an incomplete last line, as after a kill, is ignored.

    Raises
    ------
    PathFileError
        If a line is damaged.
    """
    states: list[dict[str, Any]] = []
    if not file.exists():
        return PathRecord((), None)
    try:
        lines = file.read_bytes().split(b"\n")
        for number, line in enumerate(lines[:-1], start=1):
            record = _record(line, f"{file}, line {number}")
            if "end" in record:
                return PathRecord(tuple(states), record["end"])
            states.append(record)
    except (OSError, RecordError) as error:
        raise PathFileError(f"{error}; delete the file to trace the path again") from error
    return PathRecord(tuple(states), None)


def _record(line: bytes, where: str) -> dict[str, Any]:
    record = parse_record(line.decode("utf-8", errors="replace"), where, {})
    refuse_faults(record, where, END_KEYS if "end" in record else STATE_KEYS)
    return record


class PathWriter:
    """Append new records to a path's file; a finished path is not changed.

    Parameters
    ----------
    file : file of the path; created if missing, with its folder.

    Raises
    ------
    PathFileError
        If an existing file is damaged.
    """

    def __init__(self, file: Path) -> None:
        self._file = file
        file.parent.mkdir(parents=True, exist_ok=True)
        _drop_cut_line(file)
        known = read_path(file)
        self._ended = known.end is not None
        self._known = {_load_of(state) for state in known.states}

    def add(self, records: Iterable[dict[str, Any]]) -> None:
        """Append new records; each is synced to disk before the next one is taken."""
        begun = self._file.exists()
        with self._file.open("a", encoding="utf-8") as lines:
            if not begun:
                sync_folder(self._file.parent)
            for record in records:
                new = not self._ended and ("end" in record or _load_of(record) not in self._known)
                if new:
                    lines.write(json.dumps(record) + "\n")
                    lines.flush()
                    os.fsync(lines.fileno())
                    if "end" in record:
                        self._ended = True
                    else:
                        self._known.add(_load_of(record))


def _load_of(record: dict[str, Any]) -> tuple[float, ...]:
    return (*record["pressure"], *record["applied_moment"])


def _drop_cut_line(file: Path) -> None:
    """Remove an incomplete last line, as after a kill."""
    if file.exists():
        with file.open("rb+") as content:
            content.truncate(content.read().rfind(b"\n") + 1)
