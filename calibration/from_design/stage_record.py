"""Results of stages on file: a stage whose inputs are those of its file is not run again.

The file of a stage holds its inputs beside its result. The version of the code is told, and is no input: as
with sweeps, a work that was begun goes on under newer code.
"""

import hashlib
import json
import time
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from calibration.provenance import code_version, today
from fem_reference import RecordError, read_record
from rodmodel.io import write_atomically

# Version of the stages: results of another one are not used.
_VERSION = 1


class StageError(ArithmeticError):
    """Error for a stage that has no result; the message says which and why."""


def kept(
    directory: Path, stage: str, inputs: Mapping[str, Any], compute: Callable[[], Mapping[str, Any]]
) -> dict[str, Any]:
    """Return the result of a stage, from its file if that has the same inputs.

    Parameters
    ----------
    directory : of the stages' files; created if missing.
    stage : name of the stage, and of its file.
    inputs : all that the result depends on, in the types of JSON.
    compute : returns the result, in the types of JSON.
    """
    file, wanted = _file(directory, stage), _wanted(inputs)
    found = on_file(directory, stage, inputs)
    if found is not None:
        return found
    begun = time.monotonic()
    result: dict[str, Any] = json.loads(json.dumps(compute()))
    record = {
        "stage": stage,
        "code_version": code_version(),
        "date": today(),
        "seconds": round(time.monotonic() - begun, 1),
        "inputs": wanted,
        "result": result,
    }
    directory.mkdir(parents=True, exist_ok=True)
    write_atomically(file, json.dumps(record, indent=1) + "\n")
    return result


def on_file(directory: Path, stage: str, inputs: Mapping[str, Any]) -> dict[str, Any] | None:
    """Return the result of a stage if its file has the same inputs; else None."""
    found = _read(_file(directory, stage))
    if found is None or found.get("inputs") != _wanted(inputs) or not isinstance(found.get("result"), dict):
        return None
    result: dict[str, Any] = found["result"]
    return result


def _file(directory: Path, stage: str) -> Path:
    return directory / f"{stage}.json"


def _wanted(inputs: Mapping[str, Any]) -> Any:
    return json.loads(json.dumps({"version": _VERSION, **inputs}))


def _read(file: Path) -> dict[str, Any] | None:
    """Return the content of a stage's file; None without one, or if it is damaged: the stage runs again."""
    if not file.exists():
        return None
    try:
        return read_record(file, {})
    except RecordError:
        return None


def key_of(inputs: Mapping[str, Any]) -> str:
    """Return eight hexadecimal digits that tell inputs apart, for the name of a folder."""
    return hashlib.sha256(json.dumps(inputs, sort_keys=True).encode()).hexdigest()[:8]
