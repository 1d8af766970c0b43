"""Robust fit of a law: a few states that no smooth law reaches count by less.

Where walls are about to lean over, the section changes within a kilopascal, and a law of some hundred ridges
cannot follow. In a sum of squares a few such states pull the law away from all others. So it is fitted in
rounds. A state whose residual r, the norm of all that the loss squares of it, is above a limit c has the
weight c/r in the next round. The sum is that of Huber's function then, square up to c and linear beyond.

References
----------
Huber (1964), Robust estimation of a location parameter, Ann. Math. Stat. 35, 73. Holland and Welsch (1977),
Robust regression using iteratively reweighted least-squares, Commun. Stat. A 6, 813.
"""

import math
from dataclasses import replace
from typing import TypeVar

import numpy as np
from jaxtyping import Float

from calibration.fit.any_law import AnyLaw
from calibration.fit.levenberg_marquardt import Fitted, Watch, fit, residuals
from calibration.fit.samples import Metric, Samples

Law = TypeVar("Law", bound=AnyLaw)

# Residual above which a state counts by less, in the units of the metric: degrees of bending angle, and
# hundredths of the volume's range.
LIMIT = 2.0
#: Rounds after the first, which weighs all states alike.
ROUNDS = 2


def robust_fit(
    law: Law,
    samples: Samples,
    scales: Metric,
    iterations: int,
    prior: float = 0.0,
    near: Law | None = None,
    watch: Watch = lambda iterations, loss: None,
) -> Fitted[Law]:
    """Fit a law in rounds; see `calibration.fit.fit` for the parameters.

    Returns
    -------
    fitted : of the last round, with the iterations of all.
    """
    found = fit(law, samples, scales, iterations, prior=prior, near=near, watch=watch)
    taken = found.iterations
    for _ in range(ROUNDS):
        # The loss is a mean over the states.
        weights = weights_of(math.sqrt(len(samples)) * residuals(found.law, samples, scales))
        weighted = replace(scales, gradient=scales.gradient * np.sqrt(weights)[:, None, None])
        found = fit(found.law, samples, weighted, iterations, prior=prior, near=near, watch=watch)
        taken += found.iterations
    return replace(found, iterations=taken)


def weights_of(residual: Float[np.ndarray, "n components"]) -> Float[np.ndarray, " n"]:
    """Return the weights of states in the next round, from their residuals in the units of the metric."""
    weights: np.ndarray = LIMIT / np.maximum(LIMIT, np.linalg.norm(residual, axis=1))
    return weights
