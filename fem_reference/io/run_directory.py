"""A path of loads on disk: every load step is kept as soon as it is found, and a killed run goes on from it.

The directory holds ``run.json`` (what was asked for), ``step_0001.json`` … (records) and the checkpoint of
the last step, ``state.npz``. Each is written so that its name stands for a whole file at any time.
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
    """The directory cannot be used for this run; the message says why."""


class ActuatorRun:
    """A path of loads and its directory.

    Parameters
    ----------
    directory : made if it is not there; of the same run, if it is.
    description : everything that the results depend on, as JSON would hold it; loads included.

    Raises
    ------
    RunError
        Where the directory holds another run, or cannot be written to.
    """

    def __init__(self, directory: str | Path, description: dict[str, Any]) -> None:
        self.directory = Path(directory)
        file = self.directory / "run.json"
        try:
            self.directory.mkdir(parents=True, exist_ok=True)
            # Of this run's own killed processes: a directory belongs to one run.
            drop_parts(self.directory)
            if not file.exists():
                write_atomically(file, json.dumps(description, indent=1))
            held = read_record(file, {})
        except (OSError, RecordError) as error:
            raise RunError(
                f"run: got {str(directory)!r}, expected a directory for this run: {error}"
            ) from error
        # Through JSON, so that tuples and lists compare as equal.
        if held != json.loads(json.dumps(description)):
            differ = [key for key in {*held, *description} if held.get(key) != description.get(key)]
            raise RunError(
                f"run: got {str(directory)!r}, which holds a run with another {', '.join(sorted(differ))}; "
                "expected a new directory, or the same run"
            )

    def _file(self, step: int) -> Path:
        return self.directory / f"step_{step:04d}.json"

    def records(self) -> list[dict[str, Any]]:
        """Records of the steps that are finished.

        Raises
        ------
        RunError
            Where one of them is damaged.
        """
        found: list[dict[str, Any]] = []
        while (file := self._file(len(found) + 1)).exists():
            try:
                found.append(read_record(file, RECORD_KEYS))
            except RecordError as error:
                raise RunError(f"run: {error}; delete it and state.npz to begin anew") from error
        return found

    def states(self, actuator: Actuator, loads: Sequence[ActuatorLoad]) -> Iterator[ActuatorState]:
        """Follow the loads that are not finished, keeping each state before it is yielded.

        Where all are finished, the last state is yielded again.

        Raises
        ------
        ActuatorError
            When a load is not reached; what was found before is kept.
        RunError
            Where the directory holds a damaged file, or a state cannot be written to it.
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
        # NaN for states of a path that was not led by volume.
        arrays["pressures"] = np.array(
            [b.pressure if isinstance(b, VolumeState) else np.nan for b in earlier]
        )
        deformations = [state.deformation]
        deformations += [b.deformation if isinstance(b, VolumeState) else b for b in earlier]
        for k, deformation in enumerate(deformations):
            arrays |= {f"{name}_{k}": getattr(deformation, name) for name in _FIELDS}
        try:
            # The record first: a step counts as done once its checkpoint names it.
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
        """The last state that was kept, and how many steps it closes.

        Raises
        ------
        RunError
            Where a file is damaged, or is no state of this actuator.
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
            told = " ".join(str(error).split())
            raise RunError(
                f"run: {file}: got {told or type(error).__name__}, expected a state of this run; "
                "delete it to begin anew"
            ) from error
        if len(self.records()) < step:
            raise RunError(
                f"run: got {str(self.directory)!r} without the record of a step before {step}, expected all "
                "that state.npz closes; delete it to begin anew"
            )
        return state, step

    @staticmethod
    def _read(file: Path, actuator: Actuator, loads: Sequence[ActuatorLoad]) -> tuple[ActuatorState, int]:
        # numpy leaves its own stream open where the archive is damaged.
        with file.open("rb") as stream, np.load(stream) as held:
            step = int(held["step"])
            if not 1 <= step <= len(loads):
                raise ValueError(f"step {step} of {len(loads)}")
            _refuse_faults(held, actuator)
            deformations = [
                Deformation(*(held[f"{name}_{k}"] for name in _FIELDS)) for k in range(len(held["back"]) + 1)
            ]
            behind = [
                deformation if np.isnan(pressure) else VolumeState(deformation, float(pressure))
                for deformation, pressure in zip(deformations[1:], held["pressures"], strict=True)
            ]
            earlier = list(zip(behind, (float(b) for b in held["back"]), strict=True))
            settled = Settled(
                base_force=held["base"][:3],
                base_moment=held["base"][3:],
                iterations=int(held["iterations"]),
                residual=float(held["residual"]),
                stable=None if int(held["stable"]) < 0 else bool(held["stable"]),
                limit_pressure=None if np.isnan(held["limit"]).any() else held["limit"],
                memory=PathMemory(
                    float(held["path_step"]), earlier, held["heading"], float(held["longest_step"])
                ),
            )
        return actuator.state(loads[step - 1], deformations[0], settled), step


# Numbers that may be without a value: limits, longest steps, pressures of states that have none.
_OPEN = ("limit", "longest_step", "pressures")
_VECTORS = {"base": 6, "limit": 3}


def _refuse_faults(held: Any, actuator: Actuator) -> None:
    """Raise a ValueError where arrays of a checkpoint are not those of a state of this actuator."""
    rest = actuator.equations.rest()
    for name in held.files:
        array = held[name]
        if array.dtype.kind not in "fi" or (name not in _OPEN and not np.isfinite(array).all()):
            raise ValueError(f"{name} that is not finite")
    for name, length in _VECTORS.items():
        if held[name].shape != (length,):
            raise ValueError(f"{name} of shape {held[name].shape}")
    for k in range(len(held["back"]) + 1):
        for name in _FIELDS:
            shape, own = held[f"{name}_{k}"].shape, getattr(rest, name).shape
            if shape != own:
                raise ValueError(f"{name} of shape {shape} for {own}")
