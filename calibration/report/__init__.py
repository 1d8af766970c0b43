"""Tables and plots of the errors of laws and rods."""

from calibration.report.all_layouts import MapReport as MapReport
from calibration.report.all_layouts import report_map as report_map
from calibration.report.all_layouts import report_rods as report_rods
from calibration.report.error_table import error_table as error_table
from calibration.report.html_page import Section as Section
from calibration.report.html_page import page as page
from calibration.report.html_page import pairs as pairs
from calibration.report.law_plots import DOTS_PER_INCH as DOTS_PER_INCH
from calibration.report.law_plots import write_figures as write_figures
from calibration.report.law_report import judge as judge
from calibration.report.rod_error_plot import write_truth_figure as write_truth_figure
