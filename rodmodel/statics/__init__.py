"""Statics of the rod: loads, ends, integration along the rod, shooting, stability, sensitivities."""

from rodmodel.actuator import Actuator, Domain
from rodmodel.error_bound import ErrorBound
from rodmodel.statics._as_pytree import register
from rodmodel.statics._ends import BENDING_AXES as BENDING_AXES
from rodmodel.statics._ends import base_turn as base_turn
from rodmodel.statics._ends import cap_centre as cap_centre
from rodmodel.statics._ends import tip_offset as tip_offset
from rodmodel.statics._ends import turns_little as turns_little
from rodmodel.statics._loads import Loads as Loads
from rodmodel.statics._loads import into_base as into_base
from rodmodel.statics._loads import shears_little as shears_little
from rodmodel.statics._shooting import ShootingState as ShootingState
from rodmodel.statics._solution import RESULTS as RESULTS
from rodmodel.statics._solution import Numbers as Numbers
from rodmodel.statics._solution import Solution as Solution
from rodmodel.statics._solution import result_of as result_of
from rodmodel.statics._solve import Adaptive as Adaptive
from rodmodel.statics._solve import FixedStep as FixedStep
from rodmodel.statics._solve import Solver as Solver
from rodmodel.statics._solve import solve_shape as solve_shape

register(Actuator)
register(Domain)
register(ErrorBound)
