"""A direction of negative stiffness, by the factors at hand: Lanczos' method on the inverse.

References
----------
Ericsson and Ruhe (1980), The spectral transformation Lanczos method, Math. Comput. 35.
"""

import numpy as np
from jaxtyping import Float
from scipy.sparse.linalg import ArpackNoConvergence, LinearOperator, eigsh

from fem_reference.algebra.factorisation import SymmetricSolver

# Eigenvalues that are sought beside one for each constraint: of the inverse the most negative ones. And their
# relative accuracy: any downhill way will do.
_EIGENVALUES = 2
_ACCURACY = 1e-3
# Restarts of Lanczos' method: there may be fewer negative ones, and the rest lie dense above zero.
_RESTARTS = 10
# Share of an eigenvector in the unknowns, above which it is not one of the constraints'.
_OWN = 0.5


def negative_direction(
    solver: SymmetricSolver, size: int, constraints: int
) -> Float[np.ndarray, " unknowns"] | None:
    """Return a unit vector of unknowns along which a stiffness is negative; None if none is found.

    Parameters
    ----------
    solver : holds the factors of the stiffness, with the constraints' multipliers as the last unknowns.
    size : number of unknowns and multipliers.
    constraints : number of multipliers.
    """

    def solve(right: np.ndarray) -> np.ndarray:
        return solver.solve(right.reshape(-1, 1))[:, 0]

    inverse = LinearOperator((size, size), matvec=solve, dtype=float)
    start = np.random.default_rng(0).standard_normal(size)
    try:
        values, vectors = eigsh(
            inverse,
            k=_EIGENVALUES + constraints,
            which="SA",
            v0=start,
            tol=_ACCURACY,
            maxiter=_RESTARTS,
        )
    except ArpackNoConvergence as error:
        values, vectors = error.eigenvalues, error.eigenvectors
    unknowns = vectors[: size - constraints]
    norms = np.linalg.norm(unknowns, axis=0)
    own = np.flatnonzero((values < 0.0) & (norms > _OWN))
    if own.size == 0:
        return None
    # Of the stiffness, the one nearest zero: the direction of the least loss.
    chosen = own[np.argmin(values[own])]
    found: np.ndarray = unknowns[:, chosen] / norms[chosen]
    return found
