"""Files of several commands, with errors in one line."""

from pathlib import Path
from typing import TYPE_CHECKING, Any

from calibration.cli._arguments import BadInputError

if TYPE_CHECKING:
    import rodmodel


def read_dataset(file: str) -> Any:
    """Read the dataset of a sweep."""
    from calibration.sweep.dataset import DatasetError, load_dataset

    try:
        return load_dataset(Path(file))
    except DatasetError as error:
        raise BadInputError(str(error)) from error


def read_truth(file: str | None) -> Any:
    """Read runs of the full actuator; without a file, the shipped ones."""
    from calibration.truth.dataset import SHIPPED, TruthError, load_truth

    try:
        return load_truth(SHIPPED if file is None else Path(file))
    except TruthError as error:
        raise BadInputError(str(error)) from error


def read_calibration_file(file: str) -> Any:
    """Read a calibration file."""
    from rodmodel import read_calibration

    try:
        return read_calibration(file)
    except ValueError as error:
        raise BadInputError(str(error)) from error


def write_calibration_file(calibration: "rodmodel.Calibration", file: str) -> None:
    """Write a calibration file; an old file stays if the new one cannot be written, or is not valid."""
    from rodmodel import save_calibration

    try:
        save_calibration(calibration, file)
    except OSError as error:
        raise BadInputError(
            f"{file}: got {error.strerror or error}, expected a file that can be written"
        ) from error
    except ValueError as error:
        raise BadInputError(f"{error}; nothing is written") from error
