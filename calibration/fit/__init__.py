"""Fit of a section law to a dataset, its stable domain and its held-out error."""

from calibration.fit.any_law import AnyLaw as AnyLaw
from calibration.fit.held_out_error import NO_MOMENT as NO_MOMENT
from calibration.fit.held_out_error import Deviations as Deviations
from calibration.fit.held_out_error import deviations as deviations
from calibration.fit.held_out_error import figures as figures
from calibration.fit.initial_law import Scales as Scales
from calibration.fit.initial_law import initial_law as initial_law
from calibration.fit.initial_law import initial_oriented as initial_oriented
from calibration.fit.join_sweeps import UnlikeError as UnlikeError
from calibration.fit.join_sweeps import joined as joined
from calibration.fit.levenberg_marquardt import HESSIAN_WEIGHT as HESSIAN_WEIGHT
from calibration.fit.levenberg_marquardt import fit as fit
from calibration.fit.pipeline import Judged as Judged
from calibration.fit.pipeline import begin_near as begin_near
from calibration.fit.pipeline import fit_and_judge as fit_and_judge
from calibration.fit.pipeline import prepare as prepare
from calibration.fit.samples import Metric as Metric
from calibration.fit.samples import Samples as Samples
from calibration.fit.samples import loading_samples as loading_samples
from calibration.fit.samples import on_loading_branch as on_loading_branch
from calibration.fit.stable_domain import narrowed as narrowed
from calibration.fit.to_calibration import calibration_of as calibration_of
