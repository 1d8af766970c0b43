"""The rod compiled from C99: NumPy arrays in and out, microseconds a solve. Imports no JAX."""

from rodmodel.core._branches import BranchChoice as BranchChoice
from rodmodel.core._handle import Handle as Handle
from rodmodel.core._inputs import numbers_of as numbers_of
from rodmodel.core._inputs import rows_of as rows_of
from rodmodel.core._inputs import shape_of as shape_of
from rodmodel.core._law_data import LawData as LawData
from rodmodel.core._law_data import law_data as law_data
from rodmodel.core._law_data import linear_law_data as linear_law_data
from rodmodel.core._native import ffi as ffi
from rodmodel.core._native import lib as lib
from rodmodel.core._rod import CoreJacobian as CoreJacobian
from rodmodel.core._rod import CoreRod as CoreRod
from rodmodel.core._rod import Numbers as Numbers
from rodmodel.core._rod import checked_steps as checked_steps
from rodmodel.core._solution import CoreSolution as CoreSolution
from rodmodel.core._solution import Result as Result
from rodmodel.core._structs import INPUT as INPUT
from rodmodel.core._structs import INVERSE as INVERSE
from rodmodel.core._structs import JACOBIAN as JACOBIAN
from rodmodel.core._structs import SOLUTION as SOLUTION
from rodmodel.core._structs import TARGET as TARGET
from rodmodel.core._threads import in_parts as in_parts
from rodmodel.core._variants import VARIANTS as VARIANTS
