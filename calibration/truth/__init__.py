"""Runs of the full actuator, and the comparison of rods with them."""

from calibration.truth.cases import TruthCase as TruthCase
from calibration.truth.cases import cases as cases
from calibration.truth.cases import layout_of as layout_of
from calibration.truth.compare_rods import Verdict as Verdict
from calibration.truth.compare_rods import compare_with_truth as compare_with_truth
from calibration.truth.compare_rods import judgement as judgement
from calibration.truth.dataset import SHIPPED as SHIPPED
from calibration.truth.dataset import TruthError as TruthError
from calibration.truth.dataset import case_of as case_of
from calibration.truth.dataset import free_states as free_states
from calibration.truth.dataset import gather as gather
from calibration.truth.dataset import load_truth as load_truth
from calibration.truth.dataset import merged as merged
from calibration.truth.dataset import trace as trace
from calibration.truth.dataset import truth_level as truth_level
