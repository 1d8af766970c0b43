"""Fit of the law to measurements of a real actuator: CSV file, fit, intervals, report."""

from calibration.measured.adjusted_law import NAMES as NAMES
from calibration.measured.adjusted_law import AdjustedLaw as AdjustedLaw
from calibration.measured.adjusted_law import adjusted_rod as adjusted_rod
from calibration.measured.adjustment_file import calibration_of_fit as calibration_of_fit
from calibration.measured.csv_file import ANGLE as ANGLE
from calibration.measured.csv_file import PLANE as PLANE
from calibration.measured.csv_file import POSITIONS as POSITIONS
from calibration.measured.csv_file import PRESSURES as PRESSURES
from calibration.measured.csv_file import Measured as Measured
from calibration.measured.csv_file import read_measured as read_measured
from calibration.measured.fit import MeasuredFit as MeasuredFit
from calibration.measured.fit import MeasuredFitError as MeasuredFitError
from calibration.measured.fit import fit_measured as fit_measured
from calibration.measured.report import fit_record as fit_record
from calibration.measured.report import fit_text as fit_text
from calibration.measured.report import residual_plot as residual_plot
from calibration.measured.residuals import Noise as Noise
from calibration.measured.text import MeasuredError as MeasuredError
from calibration.measured.text import read_text as read_text
from calibration.measured.text import with_point as with_point
