"""Files of several commands, with errors in one line.

A design may name the CSV file of its silicone's test.
"""

from pathlib import Path
from typing import TYPE_CHECKING, Any

from calibration.cli._arguments import BadInputError

if TYPE_CHECKING:
    import rodmodel
    from fem_reference import Design
    from fem_reference.design import Silicone


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


def read_design_file(flag: str, file: str) -> "Design":
    """Read a design file, fitting its material's test if it names one.

    Raises
    ------
    BadInputError
        With one line on the first fault.
    """
    from fem_reference import DesignError, read_design

    try:
        return read_design(file, fit_silicone)
    except DesignError as error:
        raise BadInputError(f"{flag}: {error}") from error


def fit_silicone(file: Path) -> "Silicone":
    """Return the law that fits a uniaxial test best.

    Raises
    ------
    ValueError
        For a file that is no test, and a fit that is in doubt; the message begins with ``test:``.
    """
    from calibration.material import (
        MaterialFitError,
        MaterialTestError,
        Specimen,
        fit_material,
        read_material_test,
    )
    from fem_reference.design import Silicone

    try:
        fit = fit_material([read_material_test(file, "uniaxial", Specimen())])
    except (MaterialFitError, MaterialTestError) as error:
        raise ValueError(f"test: {error}") from error
    if fit.doubts:
        raise ValueError(f"test: got a fit in doubt ({'; '.join(fit.doubts)}), expected another test")
    return Silicone(fit.material, fit.source)
