"""The differentiable rod: solve, Jacobian, stacks of rods, rods of all orientations of a winding."""

from rodmodel.rod._jacobian import Jacobian as Jacobian
from rodmodel.rod._jacobian import PoseDerivative as PoseDerivative
from rodmodel.rod._oriented_rod import OrientedRod as OrientedRod
from rodmodel.rod._rod import Rod as Rod
from rodmodel.rod._stack import stack as stack
