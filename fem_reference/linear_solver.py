"""Symmetric indefinite LDLᵀ factorisation behind one small interface.

MKL PARDISO (through `pypardiso`) is the default. Where MKL is not to be had, SciPy's SuperLU takes over, with
a message: it is many times slower.
"""

import logging
import os
import weakref
from typing import Protocol, runtime_checkable

import numpy as np
import scipy.sparse as sparse
from jaxtyping import Float
from scipy.sparse.linalg import splu

_LOG = logging.getLogger(__name__)


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
    """

    def __init__(self, definite: bool = False) -> None:
        import pypardiso

        self._definite = definite
        self.factors = 0
        self._error = pypardiso.pardiso_wrapper.PyPardisoError
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
        # MKL holds the factors outside Python's sight.
        weakref.finalize(self, self._pardiso.free_memory, everything=True).atexit = False

    def factorise(self, upper: sparse.csr_matrix, revision: int) -> int:
        """See `SymmetricSolver.factorise`."""
        self.factors += 1
        if revision != self._revision and self._upper is not None:
            self._pardiso.free_memory()
        analysed = revision == self._revision
        self._upper, self._revision = upper, revision
        if self._definite:
            if self._pivots(upper, analysed, pairs=False):
                return int(self._pardiso.get_iparm(23))
            analysed = True
        if not self._pivots(upper, analysed, pairs=True):
            raise SingularMatrixError("the matrix is singular: PARDISO perturbed a pivot")
        return int(self._pardiso.get_iparm(23))

    def _pivots(self, upper: sparse.csr_matrix, analysed: bool, pairs: bool) -> bool:
        """Factorise with single pivots or pairs; whether all of them were large enough."""
        self._pardiso.set_iparm(21, int(pairs))
        self._pardiso.set_phase(22 if analysed else 12)
        try:
            self._pardiso._call_pardiso(upper, np.zeros((upper.shape[0], 1), order="F"))
        except self._error as error:
            raise SingularMatrixError(str(error)) from error
        return bool(self._pardiso.get_iparm(14) == 0)

    def solve(self, right: Float[np.ndarray, "n columns"]) -> Float[np.ndarray, "n columns"]:
        """See `SymmetricSolver.solve`."""
        if self._upper is None:
            raise RuntimeError("solve: called before factorise; expected a factorised matrix")
        self._pardiso.set_phase(33)
        solution = self._pardiso._call_pardiso(self._upper, np.asfortranarray(right))
        if not np.all(np.isfinite(solution)):
            raise SingularMatrixError("the solution of the linear system is not finite")
        return solution


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


def default_solver(definite: bool = False) -> SymmetricSolver:
    """PARDISO where MKL is installed, else SuperLU with a warning in the log; ``definite``: see there."""
    try:
        return PardisoSolver(definite)
    except ImportError as error:
        _LOG.warning("MKL PARDISO is not available (%s); SuperLU takes over and is many times slower", error)
        return SuperLuSolver()
