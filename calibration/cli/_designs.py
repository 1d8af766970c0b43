"""Design files of the commands; a design may name the CSV file of its silicone's test."""

from pathlib import Path
from typing import TYPE_CHECKING

from calibration.cli._arguments import BadInputError

if TYPE_CHECKING:
    from fem_reference import Design
    from fem_reference.design import Silicone


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
