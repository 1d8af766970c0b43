"""Symmetric indefinite LDLᵀ factorisation behind one small interface.

MKL PARDISO (through `pypardiso`) is the default. Where MKL is not to be had, SciPy's SuperLU takes over, with
a message: it is many times slower.
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

# Relative residual that a solution is refined to. Steps that leave 1e-5 break symmetries: where two
# equilibria are near, a path that should stay symmetric then ends in the other.
_ACCURATE = 1e-7
# How fast it must shrink, or factors of single precision are not worth refining.
_CONTRACTION = 0.1


#: Gives the unknowns in the order in which they are to be eliminated, by the pattern of the upper triangle.
Elimination = Callable[[sparse.csr_matrix], Int[np.ndarray, " n"]]


class SingularMatrixError(ArithmeticError):
    """The factorisation met a zero pivot or left values that are not finite."""


@runtime_checkable
class SymmetricSolver(Protocol):
    """Factorise once, solve often. The matrix comes as the upper triangle in CSR.

    ``factors`` names the factors at hand: it grows with each factorisation.
    """

    factors: int

    def factorise(self, upper: sparse.csr_matrix, revision: int) -> int | None:
        """Factorise; return the number of negative pivots, or None where the solver does not tell.

        The analysis of the sparsity pattern is kept as long as its ``revision`` stays the same.
        """
        ...

    def solve(self, right: Float[np.ndarray, "n columns"]) -> Float[np.ndarray, "n columns"]:
        """Solve for every column."""
        ...


class PardisoSolver:
    """MKL PARDISO, matrix type −2 (real symmetric indefinite), with inertia.

    Parameters
    ----------
    definite : whether matrices are positive definite as a rule. Pivots are then single ones, which takes 30 %
        less time, until one of them is too small: the matrix is then factorised with pairs of pivots.
    single : whether factors are of single precision, which takes 40 % less time. Solutions are refined with
        the matrix itself, which must stay as it is for as long (Higham 2002, Accuracy and Stability of
        Numerical Algorithms, §12); one for which that does not converge is factorised in double precision.
    elimination : called for each new pattern; nested dissection by PARDISO if none.
    """

    def __init__(
        self, definite: bool = False, single: bool = False, elimination: Elimination | None = None
    ) -> None:
        import pypardiso

        self._definite, self._single, self._elimination = definite, single, elimination
        self.factors = 0
        self._pardiso = pypardiso.PyPardisoSolver(mtype=-2)
        # Where the library was found: searching for it anew takes a third of a second for each solver.
        os.environ.setdefault("PYPARDISO_MKL_RT", self._pardiso.libmkl._name)
        for index, value in (
            (1, 1),
            (2, 2),
            (8, 0),
            (10, 13),
            (11, 0),
            (13, 0),
            (18, 0),
            (21, 1),
            (24, 0),
            (27, 0),
        ):
            self._pardiso.set_iparm(index, value)
        self._upper: sparse.csr_matrix | None = None
        self._revision: int | None = None
        # The matrix as PARDISO reads it: values in the precision of the factors, rows and columns from one.
        self._values, self._rows, self._columns = np.zeros(0), np.zeros(1, np.int32), np.zeros(0, np.int32)
        # Unknowns in the order of elimination, from one.
        self._order = np.zeros(0, np.int32)
        # MKL holds the factors outside Python's sight.
        weakref.finalize(self, self._pardiso.free_memory, everything=True).atexit = False

    def factorise(self, upper: sparse.csr_matrix, revision: int) -> int:
        """See `SymmetricSolver.factorise`."""
        self.factors += 1
        if self._single and self._factorise(upper, revision, np.float32):
            return int(self._pardiso.get_iparm(23))
        if not self._factorise(upper, revision, np.float64):
            raise SingularMatrixError("the matrix is singular: PARDISO perturbed a pivot")
        return int(self._pardiso.get_iparm(23))

    def _factorise(self, upper: sparse.csr_matrix, revision: int, precision: type) -> bool:
        """Factorise in a precision; whether all pivots were large enough."""
        analysed = revision == self._revision and self._values.dtype == precision
        if not analysed and self._upper is not None:
            # All of it: factors of one precision are not to be found in the place of the other's.
            self._pardiso.free_memory(everything=True)
        if revision != self._revision:
            self._order = np.zeros(upper.shape[0], np.int32)
            if self._elimination is not None:
                self._pardiso.set_iparm(5, 1)
                self._order = self._elimination(upper).astype(np.int32) + 1
        self._upper, self._revision = upper, revision
        self._values = upper.data.astype(precision, copy=False)
        if not analysed:
            self._rows, self._columns = upper.indptr.astype(np.int32) + 1, upper.indices.astype(np.int32) + 1
            self._pardiso.set_iparm(28, int(precision is np.float32))
        if self._definite:
            if self._pivots(analysed, pairs=False):
                return True
            analysed = True
        return self._pivots(analysed, pairs=True)

    def _pivots(self, analysed: bool, pairs: bool) -> bool:
        """Factorise with single pivots or pairs; whether all of them were large enough."""
        self._pardiso.set_iparm(21, int(pairs))
        self._call(22 if analysed else 12, np.zeros((len(self._rows) - 1, 1)))
        return bool(self._pardiso.get_iparm(14) == 0)

    def solve(self, right: Float[np.ndarray, "n columns"]) -> Float[np.ndarray, "n columns"]:
        """See `SymmetricSolver.solve`."""
        if self._upper is None or self._revision is None:
            raise RuntimeError("solve: called before factorise; expected a factorised matrix")
        if self._values.dtype == np.float64:
            solution = self._call(33, right)
        else:
            found = self._refined(right)
            if found is None:
                _LOG.debug("factors of single precision do not serve")
                if not self._factorise(self._upper, self._revision, np.float64):
                    raise SingularMatrixError("the matrix is singular: PARDISO perturbed a pivot")
                return self.solve(right)
            solution = found
        if not np.all(np.isfinite(solution)):
            raise SingularMatrixError("the solution of the linear system is not finite")
        return solution

    def _refined(self, right: Float[np.ndarray, "n columns"]) -> Float[np.ndarray, "n columns"] | None:
        """Solution by factors of single precision; None where its residual does not shrink to this."""
        scale = np.linalg.norm(right, axis=0)
        scale[scale == 0.0] = 1.0
        scaled = right / scale
        solution, residual, largest = np.zeros_like(scaled), scaled, 1.0
        while largest > _ACCURATE:
            # In single precision nothing much smaller than one can be told.
            correction = self._call(33, residual / largest)
            solution += largest * correction
            residual = scaled - self._times(solution)
            before, largest = largest, float(np.linalg.norm(residual, axis=0).max())
            # Written so that what is not a number ends it too.
            if not largest <= _CONTRACTION * before:
                return None
        return solution * scale

    def _times(self, vectors: Float[np.ndarray, "n columns"]) -> Float[np.ndarray, "n columns"]:
        """The matrix, whose upper triangle is at hand, times vectors."""
        upper = self._upper
        assert upper is not None
        diagonal = upper.data[upper.indptr[:-1]]
        return upper @ vectors + upper.T @ vectors - diagonal[:, None] * vectors

    def _dissect(self, upper: sparse.csr_matrix) -> Int[np.ndarray, " n"]:
        """Analyse a pattern alone, and give PARDISO's order of elimination."""
        self._values, self._order = upper.data.astype(np.float64), np.zeros(upper.shape[0], np.int32)
        self._rows, self._columns = upper.indptr.astype(np.int32) + 1, upper.indices.astype(np.int32) + 1
        self._pardiso.set_iparm(5, 2)
        self._call(11, np.zeros((upper.shape[0], 1)))
        return self._order - 1

    def _call(self, phase: int, right: Float[np.ndarray, "n columns"]) -> Float[np.ndarray, "n columns"]:
        """Run a phase of PARDISO; the solution, if it solves. `pypardiso`'s own is for double precision."""
        # PARDISO reads values of the factors' precision, whatever the array holds.
        right = np.asfortranarray(right, dtype=self._values.dtype)
        pardiso, solution, error = self._pardiso, np.zeros_like(right), ctypes.c_int32(0)
        whole = [ctypes.c_int32(i) for i in (1, 1, -2, phase, len(self._rows) - 1, right.shape[1], 0)]
        factors, number, kind, phase_, size, columns, silent = map(ctypes.byref, whole)

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
    """Order of elimination by METIS, which comes with PARDISO, for the pattern of an upper triangle.

    Its rows' entries are sorted, with the diagonal's among them.
    """
    return PardisoSolver()._dissect(upper)


def default_solver(
    definite: bool = False, single: bool = False, elimination: Elimination | None = None
) -> SymmetricSolver:
    """PARDISO where MKL is installed, else SuperLU with a warning in the log; for the choices see there."""
    try:
        return PardisoSolver(definite, single, elimination)
    except ImportError as error:
        _LOG.warning("MKL PARDISO is not available (%s); SuperLU takes over and is many times slower", error)
        return SuperLuSolver()
