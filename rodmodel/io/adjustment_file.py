"""Adjustment files, the former output of `rodmodel-calibrate fit-measured`.

    {"schema": "rodmodel-adjustment", "version": 1,
     "layout": {"name", "psi_rad", "pitch_m"},
     "wall": {"radius_m", "thickness_m", "shear_modulus_pa"},
     "parameters": {"stiffness_scale",
                    "pressure_gain_1" ..., "pressure_offset_1_pa" ..., "wall_variation_1" ...},
     "standard_errors": {the same; null where held},
     "provenance": {...}}

They adjust a shipped calibration: the file does not say which other one it refers to.
"""

import warnings

import numpy as np

from rodmodel.io.adjustment import Adjustment, OuterWall, adjusted
from rodmodel.io.calibration_file import Calibration
from rodmodel.io.json_record import CalibrationFileError, Record
from rodmodel.io.loading import find

_CHAMBERS = (1, 2, 3)


def adjusted_calibration(record: Record) -> Calibration:
    """Return the calibration of an adjustment file, with a warning that no later release reads it.

    Raises
    ------
    CalibrationFileError
        For a bad file; the one-line message names the file, the key, the value and what is expected.
    """
    record.take("version", "version 1", lambda value: type(value) is int and value == 1)
    layout, wall = record.record("layout"), record.record("wall")
    parameters, errors = record.record("parameters"), record.record("standard_errors")

    def of_chambers(name: str, unit: str = "") -> np.ndarray:
        return np.array([parameters.number(f"{name}_{k}{unit}") for k in _CHAMBERS])

    adjustment = Adjustment(
        parameters.number("stiffness_scale"),
        of_chambers("pressure_gain"),
        of_chambers("pressure_offset", "_pa"),
        of_chambers("wall_variation"),
        OuterWall(wall.number("radius_m"), wall.number("thickness_m"), wall.number("shear_modulus_pa")),
    )
    name, psi, pitch = layout.word("name"), layout.number_or_null("psi_rad"), layout.number("pitch_m")
    note = {"parameters": parameters.content, "standard_errors": errors.content, "wall": wall.content}
    note |= record.record("provenance").content
    try:
        made = adjusted(find(name, psi or 0.0, pitch), adjustment, {}, note)
    except ValueError as error:
        raise CalibrationFileError(f"{record.file}: {error}") from error
    warnings.warn(
        f"{record.file}: an adjustment file, which the next release will not read; its error bound is that "
        "of the map: run `rodmodel-calibrate fit-measured` again for a calibration file with its own",
        FutureWarning,
        stacklevel=3,
    )
    return made
