"""Sweeps of the cell: design of paths, path tracing, run directory, dataset."""

from calibration.sweep.dataset import DatasetError as DatasetError
from calibration.sweep.dataset import attributes as attributes
from calibration.sweep.dataset import build_dataset as build_dataset
from calibration.sweep.dataset import load_dataset as load_dataset
from calibration.sweep.dataset import save_dataset as save_dataset
from calibration.sweep.design import HELD_OUT_EVERY as HELD_OUT_EVERY
from calibration.sweep.design import LoadingPath as LoadingPath
from calibration.sweep.design import Role as Role
from calibration.sweep.design import design_paths as design_paths
from calibration.sweep.design import edge as edge
from calibration.sweep.design import inside as inside
from calibration.sweep.design import walk as walk
from calibration.sweep.errors import SweepError as SweepError
from calibration.sweep.loading_sheet import STIFFER as STIFFER
from calibration.sweep.loading_sheet import Trace as Trace
from calibration.sweep.run_directory import RunError as RunError
from calibration.sweep.run_directory import RunPlan as RunPlan
from calibration.sweep.run_directory import open_run as open_run
from calibration.sweep.run_directory import usual_end_compliance as usual_end_compliance
from calibration.sweep.run_directory import usual_moments as usual_moments
from calibration.sweep.run_directory import whole_material as whole_material
from calibration.sweep.run_schema import domain_of_run as domain_of_run
from calibration.sweep.sweep import run_sweep as run_sweep
from calibration.sweep.tracing import CellTracer as CellTracer
from calibration.sweep.tracing import steps_over_a_snap as steps_over_a_snap
