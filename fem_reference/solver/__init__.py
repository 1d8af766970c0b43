"""Newton's method, continuation and relaxation; knows no geometry."""

from fem_reference.solver.continuation import PathError as PathError
from fem_reference.solver.continuation import PathFollower as PathFollower
from fem_reference.solver.continuation import PathMemory as PathMemory
from fem_reference.solver.convergence import admissible_part as admissible_part
from fem_reference.solver.equations import Linear as Linear
from fem_reference.solver.equations import Linearisation as Linearisation
from fem_reference.solver.extrapolation import weights as weights
from fem_reference.solver.newton import solve_equilibrium as solve_equilibrium
from fem_reference.solver.options import SolverOptions as SolverOptions
from fem_reference.solver.problem import Contact as Contact
from fem_reference.solver.problem import Equilibrium as Equilibrium
from fem_reference.solver.problem import Problem as Problem
from fem_reference.solver.problem import Tolerances as Tolerances
