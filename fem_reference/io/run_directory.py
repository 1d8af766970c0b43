"""Run directory for a path of loads: every load step is saved, and a killed run resumes after the last one.

The directory holds ``run.json`` (the description of the run), ``step_0001.json`` … (records) and
``state.npz``, the checkpoint of the last step. Files are written atomically.
"""

import json
import zipfile
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from fem_reference.actuator import Actuator, ActuatorLoad, ActuatorState, Deformation, Settled, VolumeState
from fem_reference.io.actuator_record import RECORD_KEYS, state_record
from fem_reference.io.atomic import atomic_part, drop_parts, write_atomically
from fem_reference.io.records import RecordError, read_record
from fem_reference.solver import PathMemory

_FIELDS = tuple(Deformation.__dataclass_fields__)


class RunError(ValueError):
    """Error for a directory that cannot be used for this run; the message says why."""


class ActuatorRun:
    """Directory of a path of loads.

    Parameters
    ----------
    directory : path of the directory; created, or that of the same run.
    description : everything that the results depend on, loads included, in the types of JSON.

    Raises
    ------
    RunError
        If the directory holds another run, or is not writable.
    """

    def __init__(self, directory: str | Path, description: dict[str, Any]) -> None:
        self.directory = Path(directory)
        file = self.directory / "run.json"
        try:
            self.directory.mkdir(parents=True, exist_ok=True)
            # A directory belongs to one run, so these parts come from its killed processes.
            drop_parts(self.directory)
            if not file.exists():
                write_atomically(file, json.dumps(description, indent=1))
            stored = read_record(file, {})
        except (OSError, RecordError) as error:
            raise RunError(
                f"run: got {str(directory)!r}, expected a directory for this run: {error}"
            ) from error
        # Through JSON, so that tuples and lists compare as equal.
        if stored != json.loads(json.dumps(description)):
            differ = [key for key in {*stored, *description} if stored.get(key) != description.get(key)]
            raise RunError(
                f"run: got {str(directory)!r}, which holds a run with another {', '.join(sorted(differ))}; "
                "expected a new directory, or the same run"
            )

    def _file(self, step: int) -> Path:
        return self.directory / f"step_{step:04d}.json"

    def records(self) -> list[dict[str, Any]]:
        """Return the records of the finished steps.

        Raises
        ------
        RunError
            If a record is damaged.
        """
        found: list[dict[str, Any]] = []
        while (file := self._file(len(found) + 1)).exists():
            try:
                found.append(read_record(file, RECORD_KEYS))
            except RecordError as error:
                raise RunError(f"run: {error}; delete it and state.npz to start the run again") from error
        return found

    def states(self, actuator: Actuator, loads: Sequence[ActuatorLoad]) -> Iterator[ActuatorState]:
        """Follow the unfinished loads; each state is saved before it is yielded.

        If all loads are finished, the last state is yielded again.

        Raises
        ------
        ActuatorError
            If a load is not reached; the states before it are saved.
        RunError
            If the directory holds a damaged file, or a state cannot be written.
        """
        start, done = self.checkpoint(actuator, loads)
        if done == len(loads) and start is not None:
            yield start
            return
        for step, state in enumerate(actuator.follow(loads[done:], start), start=done + 1):
            self._save(state, step)
            yield state

    def _save(self, state: ActuatorState, step: int) -> None:
        settled, memory = state.settled, state.settled.memory
        arrays: dict[str, Any] = {
            "step": step,
            "base": np.concatenate([settled.base_force, settled.base_moment]),
            "iterations": settled.iterations,
            "residual": settled.residual,
            "stable": -1 if settled.stable is None else int(settled.stable),
            "limit": np.full(3, np.nan) if settled.limit_pressure is None else settled.limit_pressure,
            "path_step": memory.step,
            "heading": memory.heading,
            "longest_step": memory.longest,
            "back": np.array([back for _, back in memory.earlier]),
        }
        earlier = [behind for behind, _ in memory.earlier]
        # NaN for states that were not found by volume control.
        arrays["pressures"] = np.array(
            [b.pressure if isinstance(b, VolumeState) else np.nan for b in earlier]
        )
        deformations = [state.deformation]
        deformations += [b.deformation if isinstance(b, VolumeState) else b for b in earlier]
        for k, deformation in enumerate(deformations):
            arrays |= {f"{name}_{k}": getattr(deformation, name) for name in _FIELDS}
        try:
            # The record comes first: a step is finished once the checkpoint names it.
            write_atomically(self._file(step), json.dumps(state_record(state)))
            with atomic_part(self.directory / "state.npz") as part, part.open("wb") as stream:
                np.savez(stream, **arrays)
        except OSError as error:
            raise RunError(
                f"run: got {error.strerror} in {str(self.directory)!r}, expected room for load step {step}; "
                "the steps before it are kept"
            ) from error

    def checkpoint(
        self, actuator: Actuator, loads: Sequence[ActuatorLoad]
    ) -> tuple[ActuatorState | None, int]:
        """Return the last saved state and the number of finished steps.

        Raises
        ------
        RunError
            If a file is damaged, or holds no state of this actuator.
        """
        file = self.directory / "state.npz"
        if not file.exists():
            return None, 0
        try:
            state, step = self._read(file, actuator, loads)
        except (
            OSError,
            AttributeError,
            EOFError,
            KeyError,
            TypeError,
            ValueError,
            zipfile.BadZipFile,
        ) as error:
            reason = " ".join(str(error).split())
            raise RunError(
                f"run: {file}: got {reason or type(error).__name__}, expected a state of this run; "
                "delete it to start the run again"
            ) from error
        if len(self.records()) < step:
            raise RunError(
                f"run: got {str(self.directory)!r} without the record of a step before {step}, expected all "
                "up to the step of state.npz; delete it to start the run again"
            )
        return state, step

    @staticmethod
    def _read(file: Path, actuator: Actuator, loads: Sequence[ActuatorLoad]) -> tuple[ActuatorState, int]:
        # numpy leaves its own stream open where the archive is damaged.
        with file.open("rb") as stream, np.load(stream) as stored:
            step = int(stored["step"])
            if not 1 <= step <= len(loads):
                raise ValueError(f"step {step} of {len(loads)}")
            _refuse_faults(stored, actuator)
            deformations = [
                Deformation(*(stored[f"{name}_{k}"] for name in _FIELDS))
                for k in range(len(stored["back"]) + 1)
            ]
            behind = [
                deformation if np.isnan(pressure) else VolumeState(deformation, float(pressure))
                for deformation, pressure in zip(deformations[1:], stored["pressures"], strict=True)
            ]
            earlier = list(zip(behind, (float(b) for b in stored["back"]), strict=True))
            settled = Settled(
                base_force=stored["base"][:3],
                base_moment=stored["base"][3:],
                iterations=int(stored["iterations"]),
                residual=float(stored["residual"]),
                stable=None if int(stored["stable"]) < 0 else bool(stored["stable"]),
                limit_pressure=None if np.isnan(stored["limit"]).any() else stored["limit"],
                memory=PathMemory(
                    float(stored["path_step"]), earlier, stored["heading"], float(stored["longest_step"])
                ),
            )
        return actuator.state(loads[step - 1], deformations[0], settled), step


# Arrays that may hold NaN or infinity.
_MAY_BE_OPEN = ("limit", "longest_step", "pressures")
_VECTORS = {"base": 6, "limit": 3}


def _refuse_faults(stored: Any, actuator: Actuator) -> None:
    """Raise a ValueError if the arrays of a checkpoint are not a state of this actuator."""
    rest = actuator.equations.rest()
    for name in stored.files:
        array = stored[name]
        if array.dtype.kind not in "fi" or (name not in _MAY_BE_OPEN and not np.isfinite(array).all()):
            raise ValueError(f"{name} that is not finite")
    for name, length in _VECTORS.items():
        if stored[name].shape != (length,):
            raise ValueError(f"{name} of shape {stored[name].shape}")
    for k in range(len(stored["back"]) + 1):
        for name in _FIELDS:
            shape, own = stored[f"{name}_{k}"].shape, getattr(rest, name).shape
            if shape != own:
                raise ValueError(f"{name} of shape {shape} for {own}")
