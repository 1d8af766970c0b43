"""Symmetric indefinite LDLᵀ factorisation, by MKL PARDISO or SciPy's SuperLU.

MKL PARDISO (through `pypardiso`) is the default. Without MKL, SuperLU is used and a warning is logged: it is
many times slower.
"""

import ctypes
import logging
import os
import weakref
from collections.abc import Callable
from typing import Any, Protocol, runtime_checkable

import numpy as np
import scipy.sparse as sparse
from jaxtyping import Float, Int
from scipy.sparse.linalg import splu

_LOG = logging.getLogger(__name__)

# Relative residual of iterative refinement. A residual of 1e-5 breaks symmetries: near a second equilibrium
# a symmetric path may end on the other branch.
_ACCURACY = 1e-7
# The matrix is factorised in double precision if one step of refinement reduces the residual by less.
_CONTRACTION = 0.1

# PARDISO's phases.
_ANALYSE, _ANALYSE_AND_FACTORISE, _FACTORISE, _SOLVE = 11, 12, 22, 33
# Indices of its parameters, from one as in MKL's manual.
_PERMUTATION = 5
_PERTURBED_PIVOTS = 14
_PAIRED_PIVOTS = 21
_NEGATIVE_PIVOTS = 23
_SINGLE_PRECISION = 28
_PARAMETERS = {
    1: 1,  # no default values
    2: 2,  # ordering by METIS
    8: 0,  # no refinement by PARDISO itself
    10: 13,  # small pivots are perturbed to 1e-13
    11: 0,  # no scaling
    13: 0,  # no weighted matching
    18: 0,  # no count of the factors' entries
    _PAIRED_PIVOTS: 1,  # Bunch–Kaufman pivots
    24: 0,  # classic parallel factorisation
    27: 0,  # no check of the matrix
}


#: Returns the order in which unknowns are eliminated, from the pattern of the upper triangle.
Elimination = Callable[[sparse.csr_matrix], Int[np.ndarray, " n"]]


class SingularMatrixError(ArithmeticError):
    """The factorisation has a zero pivot, or the solution is not finite."""


@runtime_checkable
class SymmetricSolver(Protocol):
    """Direct solver for symmetric matrices, given by their upper triangle in CSR.

    ``factors`` counts factorisations, and so identifies the current factors.
    """

    factors: int

    def factorise(self, upper: sparse.csr_matrix, revision: int) -> int | None:
        """Factorise; return the number of negative pivots, or None if the solver does not know it.

        The symbolic analysis is reused while the ``revision`` of the sparsity pattern stays the same.
        """
        ...

    def solve(self, right: Float[np.ndarray, "n columns"]) -> Float[np.ndarray, "n columns"]:
        """Solve for every column."""
        ...


class PardisoSolver:
    """MKL PARDISO for real symmetric indefinite matrices (type −2), with inertia.

    Parameters
    ----------
    definite : whether most matrices are positive definite. 1×1 pivots are then tried first, which takes 30 %
        less time; if one is too small, the matrix is factorised again with 2×2 pivots.
    single : whether to factorise in single precision, which takes 40 % less time. Solutions are refined with
        the matrix itself, which must not change meanwhile (Higham 2002, Accuracy and Stability of Numerical
        Algorithms, §12). If refinement does not converge, the matrix is factorised in double precision.
    elimination : elimination order for each new pattern; PARDISO's nested dissection if None.
    """

    def __init__(
        self, definite: bool = False, single: bool = False, elimination: Elimination | None = None
    ) -> None:
        import pypardiso

        self._definite, self._single, self._elimination = definite, single, elimination
        self.factors = 0
        self._pardiso = pypardiso.PyPardisoSolver(mtype=-2)
        # Remember the library's path: the search takes a third of a second for each solver.
        os.environ.setdefault("PYPARDISO_MKL_RT", self._pardiso.libmkl._name)
        for index, value in _PARAMETERS.items():
            self._pardiso.set_iparm(index, value)
        self._upper: sparse.csr_matrix | None = None
        self._revision: int | None = None
        # The matrix for PARDISO: values in the factors' precision, rows and columns numbered from one.
        self._values, self._rows, self._columns = np.zeros(0), np.zeros(1, np.int32), np.zeros(0, np.int32)
        # Unknowns in the order of elimination, numbered from one.
        self._order = np.zeros(0, np.int32)
        # MKL owns the factors' memory; Python does not free it.
        weakref.finalize(self, self._pardiso.free_memory, everything=True).atexit = False

    def factorise(self, upper: sparse.csr_matrix, revision: int) -> int:
        """See `SymmetricSolver.factorise`."""
        self.factors += 1
        if not (self._single and self._factorise(upper, revision, np.float32)):
            self._factorise_in_double(upper, revision)
        return int(self._pardiso.get_iparm(_NEGATIVE_PIVOTS))

    def _factorise_in_double(self, upper: sparse.csr_matrix, revision: int) -> None:
        if not self._factorise(upper, revision, np.float64):
            raise SingularMatrixError("the matrix is singular: PARDISO perturbed a pivot")

    def _factorise(self, upper: sparse.csr_matrix, revision: int, precision: type) -> bool:
        """Factorise in a precision; return whether all pivots were large enough."""
        analysed = revision == self._revision and self._values.dtype == precision
        if not analysed and self._upper is not None:
            # PARDISO would look for factors of the other precision in the same memory.
            self._pardiso.free_memory(everything=True)
        if revision != self._revision:
            self._order = np.zeros(upper.shape[0], np.int32)
            if self._elimination is not None:
                self._pardiso.set_iparm(_PERMUTATION, 1)
                self._order = self._elimination(upper).astype(np.int32) + 1
        self._upper, self._revision = upper, revision
        self._values = upper.data.astype(precision, copy=False)
        if not analysed:
            self._rows, self._columns = upper.indptr.astype(np.int32) + 1, upper.indices.astype(np.int32) + 1
            self._pardiso.set_iparm(_SINGLE_PRECISION, int(precision is np.float32))
        if self._definite:
            if self._pivots(analysed, pairs=False):
                return True
            analysed = True
        return self._pivots(analysed, pairs=True)

    def _pivots(self, analysed: bool, pairs: bool) -> bool:
        """Factorise with 1×1 pivots or with pairs; return whether all of them were large enough."""
        self._pardiso.set_iparm(_PAIRED_PIVOTS, int(pairs))
        self._call(_FACTORISE if analysed else _ANALYSE_AND_FACTORISE, np.zeros((len(self._rows) - 1, 1)))
        return bool(self._pardiso.get_iparm(_PERTURBED_PIVOTS) == 0)

    def solve(self, right: Float[np.ndarray, "n columns"]) -> Float[np.ndarray, "n columns"]:
        """See `SymmetricSolver.solve`."""
        if self._upper is None or self._revision is None:
            raise RuntimeError("solve: called before factorise; expected a factorised matrix")
        solution = self._solve_refined(right) if self._values.dtype == np.float32 else None
        if solution is None:
            if self._values.dtype == np.float32:
                _LOG.debug("refinement does not converge; factorising in double precision")
                self._factorise_in_double(self._upper, self._revision)
            solution = self._call(_SOLVE, right)
        if not np.all(np.isfinite(solution)):
            raise SingularMatrixError("the solution of the linear system is not finite")
        return solution

    def _solve_refined(self, right: Float[np.ndarray, "n columns"]) -> Float[np.ndarray, "n columns"] | None:
        """Solve by iterative refinement of single precision; None if it does not converge."""
        scale = np.linalg.norm(right, axis=0)
        scale[scale == 0.0] = 1.0
        scaled = right / scale
        solution, residual, largest = np.zeros_like(scaled), scaled, 1.0
        while largest > _ACCURACY:
            # Scaled to one: small residuals underflow in single precision.
            correction = self._call(_SOLVE, residual / largest)
            solution += largest * correction
            residual = scaled - self._times(solution)
            before, largest = largest, float(np.linalg.norm(residual, axis=0).max())
            # This form of the comparison also stops at NaN.
            if not largest <= _CONTRACTION * before:
                return None
        return solution * scale

    def _times(self, vectors: Float[np.ndarray, "n columns"]) -> Float[np.ndarray, "n columns"]:
        """Multiply the matrix, stored as its upper triangle, by vectors."""
        upper = self._upper
        assert upper is not None
        diagonal = upper.data[upper.indptr[:-1]]
        return upper @ vectors + upper.T @ vectors - diagonal[:, None] * vectors

    def _dissect(self, upper: sparse.csr_matrix) -> Int[np.ndarray, " n"]:
        """Analyse a pattern and return PARDISO's elimination order."""
        self._values, self._order = upper.data.astype(np.float64), np.zeros(upper.shape[0], np.int32)
        self._rows, self._columns = upper.indptr.astype(np.int32) + 1, upper.indices.astype(np.int32) + 1
        self._pardiso.set_iparm(_PERMUTATION, 2)
        self._call(_ANALYSE, np.zeros((upper.shape[0], 1)))
        return self._order - 1

    def _call(self, phase: int, right: Float[np.ndarray, "n columns"]) -> Float[np.ndarray, "n columns"]:
        """Run a phase of PARDISO, also in single precision, which `pypardiso` lacks; return the solution."""
        # PARDISO reads the right-hand side in the factors' precision.
        right = np.asfortranarray(right, dtype=self._values.dtype)
        pardiso, solution, error = self._pardiso, np.zeros_like(right), ctypes.c_int32(0)
        values = [ctypes.c_int32(i) for i in (1, 1, -2, phase, len(self._rows) - 1, right.shape[1], 0)]
        factors, number, kind, phase_, size, columns, silent = map(ctypes.byref, values)

        def integers(array: np.ndarray) -> Any:
            return array.ctypes.data_as(ctypes.POINTER(ctypes.c_int32))

        def numbers(array: np.ndarray) -> Any:
            return array.ctypes.data_as(ctypes.c_void_p)

        pardiso._mkl_pardiso(
            pardiso.pt.ctypes.data_as(ctypes.POINTER(ctypes.c_int64)),
            *(factors, number, kind, phase_, size),
            *(numbers(self._values), integers(self._rows), integers(self._columns), integers(self._order)),
            *(columns, integers(pardiso.iparm), silent, numbers(right), numbers(solution)),
            ctypes.byref(error),
        )
        if error.value != 0:
            raise SingularMatrixError(f"PARDISO ended with error {error.value}")
        return np.ascontiguousarray(solution)


class SuperLuSolver:
    """SciPy's SuperLU with a symmetric ordering, for machines without MKL."""

    def __init__(self) -> None:
        self._factor = None
        self.factors = 0

    def factorise(self, upper: sparse.csr_matrix, revision: int) -> None:
        """See `SymmetricSolver.factorise`; the inertia is not available."""
        self.factors += 1
        full = (upper + sparse.triu(upper, 1).T).tocsc()
        try:
            self._factor = splu(full, permc_spec="MMD_AT_PLUS_A", options={"SymmetricMode": True})
        except RuntimeError as error:
            raise SingularMatrixError(str(error)) from error

    def solve(self, right: Float[np.ndarray, "n columns"]) -> Float[np.ndarray, "n columns"]:
        """See `SymmetricSolver.solve`."""
        if self._factor is None:
            raise RuntimeError("solve: called before factorise; expected a factorised matrix")
        return self._factor.solve(np.ascontiguousarray(right))


def nested_dissection_order(upper: sparse.csr_matrix) -> Int[np.ndarray, " n"]:
    """Return the elimination order of METIS, as part of PARDISO, for the pattern of an upper triangle.

    The entries of each row are sorted and include the diagonal.
    """
    return PardisoSolver()._dissect(upper)


def default_solver(
    definite: bool = False, single: bool = False, elimination: Elimination | None = None
) -> SymmetricSolver:
    """Return a `PardisoSolver` if MKL is installed, else SuperLU with a warning in the log."""
    try:
        return PardisoSolver(definite, single, elimination)
    except ImportError as error:
        _LOG.warning("MKL PARDISO is not available (%s); SuperLU takes over and is many times slower", error)
        return SuperLuSolver()
