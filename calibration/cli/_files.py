"""Files that several commands read, refused in one line."""

from pathlib import Path
from typing import Any

from calibration.cli._arguments import BadInputError


def read_dataset(file: str) -> Any:
    """The dataset of a sweep."""
    from calibration.dataset import DatasetError, load_dataset

    try:
        return load_dataset(Path(file))
    except DatasetError as error:
        raise BadInputError(str(error)) from error


def read_truth(file: str) -> Any:
    """The gathered runs of the full actuator."""
    from calibration.truth import TruthError, load_truth

    try:
        return load_truth(Path(file))
    except TruthError as error:
        raise BadInputError(str(error)) from error


def read_calibration_file(file: str) -> Any:
    """A calibration."""
    from rodmodel import read_calibration

    try:
        return read_calibration(file)
    except ValueError as error:
        raise BadInputError(str(error)) from error
