"""Sparsity pattern, degrees of freedom, factorisation and elimination order."""

from fem_reference.algebra.dof_map import DofMap as DofMap
from fem_reference.algebra.factorisation import SingularMatrixError as SingularMatrixError
from fem_reference.algebra.factorisation import SymmetricSolver as SymmetricSolver
from fem_reference.algebra.factorisation import default_solver as default_solver
from fem_reference.algebra.negative_direction import negative_direction as negative_direction
from fem_reference.algebra.slab_ordering import SlabOrdering as SlabOrdering
from fem_reference.algebra.sparse_pattern import SparsePattern as SparsePattern
from fem_reference.algebra.sparse_pattern import scatter as scatter
