"""Identifiability: which parameters, and combinations of them, measurements determine."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

# Least singular value of a determined combination. One held at its default although its true value is one
# spread away changes the estimates of the others by at most this fraction of their standard errors.
IDENTIFIED = 1.0 / 3.0

# Least share of a parameter that is named in a combination, relative to the largest.
_NAMED = 0.25


@dataclass(frozen=True)
class Held:
    """Parameter held at its default, with the undetermined combination that is the reason.

    Attributes
    ----------
    name : name of the parameter.
    combination : shares of the parameters in the undetermined combination, in units of their spreads, the
        largest ±1; only the parameter itself if the data do not depend on it enough.
    uncertainty : standard error of the combination over its spread; infinite if the data do not depend on
        it at all.
    """

    name: str
    combination: dict[str, float]
    uncertainty: float


def identify(
    jacobian: np.ndarray, names: Sequence[str], spread: np.ndarray, keep_first: Sequence[int]
) -> tuple[list[int], list[Held]]:
    """Split parameters into those that the data determine and those to hold.

    The columns of the weighted Jacobian are scaled by the plausible spreads. A singular value σ is then the
    inverse standard error of its combination, in spreads. If σ < 1/3, the data say far less about the
    combination than the prior, and its value hardly affects the estimates of the others. One of its
    parameters is then held: among those with at least half of the largest share, the one last in
    `keep_first`. The procedure repeats without it.

    Parameters
    ----------
    jacobian : derivatives of the residuals over their noise, (residuals, parameters).
    names : names of the parameters.
    spread : plausible spread of each parameter about its default.
    keep_first : rank of each parameter; 0 is held last.

    Returns
    -------
    free : indices of the parameters to estimate.
    held : the others, with the reason.
    """
    scaled = jacobian * spread
    free = list(range(len(names)))
    held = []
    while free:
        _, sigma, rows = np.linalg.svd(scaled[:, free], full_matrices=True)
        sizes = np.concatenate([sigma, np.zeros(len(free) - len(sigma))])
        alone = np.linalg.norm(scaled[:, free], axis=0)
        if alone.min() < IDENTIFIED:
            # Handled before combinations, because a null space would mix it with others.
            shares = np.eye(len(free))[np.argmin(alone)]
            size = float(alone.min())
        elif sizes[-1] < IDENTIFIED:
            shares, size = rows[-1] / rows[-1][np.argmax(np.abs(rows[-1]))], float(sizes[-1])
        else:
            break
        large = [n for n in range(len(free)) if abs(shares[n]) >= 0.5]
        goes = max(large, key=lambda n: (keep_first[free[n]], abs(shares[n])))
        combination = {
            names[free[n]]: float(shares[n]) for n in np.argsort(-np.abs(shares)) if abs(shares[n]) >= _NAMED
        }
        # Smaller values are round-off of the decomposition.
        uncertainty = 1.0 / size if size > 1e-9 else float("inf")
        held.append(Held(names[free[goes]], combination, uncertainty))
        del free[goes]
    return free, held
