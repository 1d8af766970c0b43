"""Factors in single precision, and what they lack by iteration.

To factorise in single precision takes half the time and half the memory. The factors of a slender, nearly
incompressible body miss its few softest motions, bending, by up to half, and all others by little, so with
them as preconditioner GMRES needs a handful of products with the matrix itself. It minimises the error as
the factors see it, a displacement, in which soft motions count for what they are. Where it does not converge,
double precision takes over.

Soft motions may be negative to the factors alone, or to the matrix alone. The first Ritz values of the
preconditioned matrix tell how many, and the matrix' curvature in the directions of negative pivots, which of
the two; so the inertia is that in double precision, where there are few negative pivots.

References
----------
Saad and Schultz (1986), GMRES: a generalized minimal residual algorithm, algorithm 4. Arioli and Duff (2009),
Using FGMRES to obtain backward stability in mixed precision.
"""

import ctypes
import logging
import weakref
from collections.abc import Callable, Iterator

import numpy as np
import scipy.sparse as sparse
from jaxtyping import Float

from fem_reference.linear_solver import PardisoSolver, SingularMatrixError, options

_LOG = logging.getLogger(__name__)

# Share of a solution that may be missing, as the factors see it: what Newton's method then contracts by.
_ACCURACY = 1e-5
# GMRES goes on from what it truly leaves after every pass: rounding in the factors' solutions adds to it.
_OF_A_PASS, _MOST_PRODUCTS, _MOST_PASSES = 1e-3, 25, 8
# Negative pivots that are looked at one by one, and products with which others are searched for.
_FEW, _SEARCH = 10, 8


class MixedSolver:
    """MKL PARDISO in single precision, refined in double; for matrices that are definite as a rule."""

    def __init__(self) -> None:
        self._factors = _SingleFactors()
        self._upper: sparse.csr_matrix | None = None
        self._revision = 0
        self._double: PardisoSolver | None = None

    def factorise(self, upper: sparse.csr_matrix, revision: int, roughly: bool = False) -> int:
        """See `SymmetricSolver.factorise`."""
        self._double, self._upper, self._revision = None, upper, revision
        self._diagonal = upper.diagonal()
        negative = self._factors.factorise(upper, self._diagonal, revision)
        if roughly or negative > _FEW:
            return negative
        curvatures = [x @ self._product(x) for x in self._factors.negative_directions()] if negative else []
        mistaken = sum(bool(curvature >= 0.0) for curvature in curvatures)
        return negative - 2 * mistaken + self._sign_changes()

    def _sign_changes(self) -> int:
        """Motions that are negative to the factors alone, or to the matrix alone.

        They are negative eigenvalues of the matrix preconditioned with the factors, which has a cluster at
        one and few others; these are the first that Arnoldi's method finds.
        """
        start = self._factors.solve(np.random.default_rng(0).standard_normal(len(self._diagonal)))
        if not np.isfinite(start).all() or not start.any():
            return 0
        _, hessenberg = self._arnoldi(start / np.linalg.norm(start), _SEARCH)
        steps = hessenberg.shape[1]
        return int((np.linalg.eigvals(hessenberg[:steps]).real < 0.0).sum())

    def solve(self, right: Float[np.ndarray, "n columns"]) -> Float[np.ndarray, "n columns"]:
        """See `SymmetricSolver.solve`."""
        if self._upper is None:
            raise RuntimeError("solve: called before factorise; expected a factorised matrix")
        if self._double is None:
            columns = [self._refined(column) for column in right.T]
            solved = [column for column in columns if column is not None]
            if len(solved) == len(columns):
                return np.column_stack(solved)
            _LOG.debug("single precision does not do: the matrix is factorised in double")
            self._double = PardisoSolver(definite=True)
            self._double.factorise(self._upper, self._revision)
        return self._double.solve(right)

    def _product(self, x: Float[np.ndarray, " n"]) -> Float[np.ndarray, " n"]:
        assert self._upper is not None
        return self._upper @ x + self._upper.T @ x - self._diagonal * x

    def _refined(self, right: Float[np.ndarray, " n"]) -> Float[np.ndarray, " n"] | None:
        """The solution, refined; None where that does not converge."""
        solution, lacking, goal = np.zeros_like(right), right, 0.0
        for _ in range(_MOST_PASSES):
            first = self._factors.solve(lacking)
            size = float(np.linalg.norm(first))
            if not np.isfinite(size):
                return None
            goal = goal or _ACCURACY * size
            if size <= goal:
                return solution
            step = self._reduced(first, size, max(_OF_A_PASS, 0.5 * goal / size))
            if step is None:
                return None
            solution = solution + step
            lacking = right - self._product(solution)
        return None

    def _reduced(
        self, first: Float[np.ndarray, " n"], size: float, share: float
    ) -> Float[np.ndarray, " n"] | None:
        """What GMRES, with the factors on the left, adds to leave a ``share`` of ``first``."""
        weights, left = np.zeros(0), np.inf

        def enough(hessenberg: Float[np.ndarray, "_ k"]) -> bool:
            nonlocal weights, left
            target = np.zeros(len(hessenberg))
            target[0] = size
            weights = np.linalg.lstsq(hessenberg, target)[0]
            left = float(np.linalg.norm(target - hessenberg @ weights))
            return left <= share * size

        basis, _ = self._arnoldi(first / size, _MOST_PRODUCTS, enough)
        return (
            np.einsum("k,kn->n", weights, np.array(basis[: len(weights)])) if left <= share * size else None
        )

    def _arnoldi(
        self,
        start: Float[np.ndarray, " n"],
        products: int,
        enough: Callable[[Float[np.ndarray, "_ k"]], bool] = lambda hessenberg: False,
    ) -> tuple[list[Float[np.ndarray, " n"]], Float[np.ndarray, "_ k"]]:
        """Basis of the space that the matrix with the factors on its left spans from a unit vector on."""
        basis, hessenberg = [start], np.zeros((products + 1, products))
        for k in range(products):
            new = self._factors.solve(self._product(basis[k]))
            for i, other in enumerate(basis):
                hessenberg[i, k] = other @ new
                new -= hessenberg[i, k] * other
            hessenberg[k + 1, k] = np.linalg.norm(new)
            found = hessenberg[: k + 2, : k + 1]
            # The space is exhausted where nothing is left but the rounding of the factors' solutions.
            if enough(found) or not hessenberg[k + 1, k] > 0.0:
                break
            basis.append(new / hessenberg[k + 1, k])
        return basis, found


class _SingleFactors:
    """LDLᵀ factors of a matrix, scaled to a diagonal of ones, in single precision."""

    def __init__(self) -> None:
        import pypardiso

        self._pardiso = pypardiso.PyPardisoSolver(mtype=-2)
        # Pivots below 1e-8 count as too small; single precision.
        for index, value in (*options(), (10, 8), (18, 0), (28, 1)):
            self._pardiso.set_iparm(index, value)
        self._revision: int | None = None
        weakref.finalize(self, self._pardiso.free_memory, everything=True).atexit = False

    def factorise(self, upper: sparse.csr_matrix, diagonal: Float[np.ndarray, " n"], revision: int) -> int:
        """Number of negative pivots."""
        if not np.isfinite(upper.data).all():
            raise SingularMatrixError("the matrix is not finite")
        analysed = revision == self._revision
        if not analysed:
            self._rows = np.repeat(np.arange(upper.shape[0]), np.diff(upper.indptr))
            self._starts, self._columns = upper.indptr + np.int32(1), upper.indices + np.int32(1)
        size = np.abs(diagonal)
        self._scale = 1.0 / np.sqrt(np.where(size > 0.0, size, 1.0))
        self._data = (upper.data * self._scale[self._rows] * self._scale[upper.indices]).astype(np.float32)
        if not analysed:
            if self._revision is not None:
                self._pardiso.free_memory()
            self._revision = None
            self._call(11)
            self._revision = revision
        # Single pivots; pairs where one of them was too small.
        for pairs in (0, 1):
            self._pardiso.set_iparm(21, pairs)
            self._call(22)
            if self._pardiso.get_iparm(14) == 0:
                return int(self._pardiso.get_iparm(23))
        raise SingularMatrixError("the matrix is singular: PARDISO perturbed a pivot")

    def negative_directions(self) -> Iterator[Float[np.ndarray, " n"]]:
        """Directions x in which xᵀ A x is a negative pivot: with A = L D Lᵀ, x = L⁻ᵀ e."""
        probe = np.random.default_rng(0).uniform(1.0, 2.0, len(self._scale)).astype(np.float32)
        for place in np.flatnonzero(self._call(332, probe) < 0.0):
            unit = np.zeros(len(self._scale), np.float32)
            unit[place] = 1.0
            yield self._scale * self._call(333, unit)

    def solve(self, right: Float[np.ndarray, " n"]) -> Float[np.ndarray, " n"]:
        """Solution to single precision."""
        return self._scale * self._call(33, (right * self._scale).astype(np.float32))

    def _call(self, phase: int, right: Float[np.ndarray, " n"] | None = None) -> Float[np.ndarray, " n"]:
        """Call MKL; pypardiso's own call takes double precision only."""
        solver = self._pardiso
        right = np.zeros(len(self._scale), np.float32) if right is None else right
        found, error = np.zeros_like(right), ctypes.c_int32(0)

        def whole(number: int) -> object:
            return ctypes.byref(ctypes.c_int32(number))

        def of(array: np.ndarray, kind: type) -> object:
            return array.ctypes.data_as(ctypes.POINTER(kind))

        solver._mkl_pardiso(
            *(of(solver.pt, solver._pt_type[0]), whole(1), whole(1), whole(solver.mtype), whole(phase)),
            *(whole(len(self._scale)), of(self._data, ctypes.c_float)),
            *(of(self._starts, ctypes.c_int32), of(self._columns, ctypes.c_int32)),
            *(of(solver.perm, ctypes.c_int32), whole(1), of(solver.iparm, ctypes.c_int32), whole(0)),
            *(of(right, ctypes.c_float), of(found, ctypes.c_float), ctypes.byref(error)),
        )
        if error.value != 0:
            raise SingularMatrixError(f"PARDISO: error {error.value} in phase {phase}")
        return found.astype(float)
