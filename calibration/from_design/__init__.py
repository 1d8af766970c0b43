"""From a design file to a calibration: range, mesh, sweep, fit, ends, judge runs, bound and report."""

from calibration.from_design.findings import Findings as Findings
from calibration.from_design.findings import report as report
from calibration.from_design.near_law import design_of as design_of
from calibration.from_design.pipeline import calibrate as calibrate
from calibration.from_design.stage_record import StageError as StageError
from calibration.from_design.task import Budget as Budget
from calibration.from_design.task import Meshes as Meshes
from calibration.from_design.task import Task as Task
