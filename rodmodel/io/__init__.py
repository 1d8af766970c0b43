"""Calibrations: their file, which of them serves a winding layout, and rods made of them. Imports no JAX."""

from rodmodel.io.atomic import write_atomically as write_atomically
from rodmodel.io.calibration_file import Calibration as Calibration
from rodmodel.io.calibration_file import read_calibration as read_calibration
from rodmodel.io.calibration_file import save_calibration as save_calibration
from rodmodel.io.calibration_text import calibration_record as calibration_record
from rodmodel.io.calibration_text import calibration_text as calibration_text
from rodmodel.io.json_record import CalibrationFileError as CalibrationFileError
from rodmodel.io.law_arrays import RidgeArrays as RidgeArrays
from rodmodel.io.loading import CalibrationNotFoundError as CalibrationNotFoundError
from rodmodel.io.loading import Found as Found
from rodmodel.io.loading import find as find
from rodmodel.io.loading import find_among as find_among
from rodmodel.io.loading import load as load
from rodmodel.io.loading import load_core as load_core
from rodmodel.io.loading import load_oriented as load_oriented
from rodmodel.io.loading import shipped_calibrations as shipped_calibrations
from rodmodel.io.ranges import RANGES as RANGES
from rodmodel.io.ranges import ranges_table as ranges_table
