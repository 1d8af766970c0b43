"""Which parameters measurements can tell, and which they cannot tell apart."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

# A combination held at its default, and in truth one plausible spread off it, moves the estimates of the
# others by at most this part of their standard errors.
TOLD = 1.0 / 3.0

# Shares of a combination that are named beside its largest.
_NAMED = 0.25


@dataclass(frozen=True)
class Held:
    """A parameter that is held at its default, and why: the combination that the data leave open.

    Attributes
    ----------
    name : of the parameter.
    combination : what the data cannot tell apart: parameters and their shares, in units of the plausible
        spread, the largest ±1; itself alone where the data do not depend on it enough.
    uncertainty : standard error of the combination over its plausible spread; infinite where the data do not
        depend on it at all.
    """

    name: str
    combination: dict[str, float]
    uncertainty: float


def identify(
    jacobian: np.ndarray, names: Sequence[str], spread: np.ndarray, keep_first: Sequence[int]
) -> tuple[list[int], list[Held]]:
    """Parameters that the data determine, and those to hold.

    With the columns of the weighted Jacobian times the plausible spread of each parameter, a singular value σ
    is the inverse of the standard error of its combination, counted in plausible spreads. Where σ < 1/3 the
    data say far less about the combination than is known without them, and what it is in truth hardly moves
    the estimates of the others. One of its parameters is then held: of
    those with at least half of the largest share the one last in `keep_first`; and so on without it.

    Parameters
    ----------
    jacobian : of the residuals, each over its noise, by the parameters: (residuals, parameters).
    names : of the parameters.
    spread : by how much each may plausibly differ from its default.
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
        if alone.min() < TOLD:
            # What the data do not see by itself is no matter of combinations, which a null space mixes.
            shares = np.eye(len(free))[np.argmin(alone)]
            size = float(alone.min())
        elif sizes[-1] < TOLD:
            shares, size = rows[-1] / rows[-1][np.argmax(np.abs(rows[-1]))], float(sizes[-1])
        else:
            break
        large = [n for n in range(len(free)) if abs(shares[n]) >= 0.5]
        goes = max(large, key=lambda n: (keep_first[free[n]], abs(shares[n])))
        combination = {
            names[free[n]]: float(shares[n]) for n in np.argsort(-np.abs(shares)) if abs(shares[n]) >= _NAMED
        }
        # Below the rounding of a decomposition there is nothing.
        uncertainty = 1.0 / size if size > 1e-9 else float("inf")
        held.append(Held(names[free[goes]], combination, uncertainty))
        del free[goes]
    return free, held
