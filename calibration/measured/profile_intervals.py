"""Profile-likelihood intervals of fitted parameters, for nonlinear models.

Standard errors of the linearised model are too small where the model is nonlinear within them. The profile
of a parameter is the least sum of squares at each of its values. It rises by the square of the quantile at
the ends of the interval, which do not depend on the parametrisation.

Bates and Watts (1988), Nonlinear regression analysis and its applications, section 6.1.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

_TRIALS = 12  # values tried for one end of an interval
_STEPS = 20  # Gauss–Newton steps for one value
_CLOSE = 0.02  # tolerance of an end, relative to the half width
_CONVERGED = 1e-3  # expected decrease of the squares at convergence, relative to the rise
_LOWER = 1e-2  # decrease below the minimum, relative to the rise, that shows another minimum

#: Residuals (m,), NaN where there are none, and their slopes (m, n) at parameters (n,).
Residuals = Callable[[np.ndarray], tuple[np.ndarray, np.ndarray]]


class LowerMinimumError(ValueError):
    """Error for a local minimum: the squares are lower near `parameters` (n,)."""

    def __init__(self, parameters: np.ndarray) -> None:
        super().__init__(f"found: got a local minimum of the squares, which are less at {parameters}")
        self.parameters = parameters


def profile_intervals(
    residuals: Residuals, found: np.ndarray, rise: float, least: np.ndarray, most: np.ndarray
) -> np.ndarray:
    """Find the ends of each parameter's interval, where its profile has risen.

    Parameters
    ----------
    residuals : residuals over their noise; parameters should be of similar size.
    found : minimum (n,).
    rise : rise of the sum of squares at the ends.
    least, most : bounds of the parameters (n,).

    Returns
    -------
    ends : intervals (n, 2), to a fiftieth of the half width; the bound if the rise is not reached before it,
        infinite if the profile cannot be followed so far.

    Raises
    ------
    LowerMinimumError
        If a profile leads to a lower sum of squares than at `found`.
    """
    residual, slopes = residuals(found)
    profile = _Profile(residuals, found, float(residual @ residual), np.linalg.pinv(slopes.T @ slopes), rise)
    sides = ((-1.0, least), (1.0, most))
    return np.array([[profile.end(n, sign, bound[n]) for sign, bound in sides] for n in range(len(found))])


@dataclass(frozen=True)
class _Profile:
    residuals: Residuals
    found: np.ndarray
    smallest: float
    covariance: np.ndarray
    rise: float

    def end(self, n: int, sign: float, bound: float) -> float:
        """Return the value of parameter `n` at which the squares have risen, on one side."""
        width = abs(bound - self.found[n])
        # Change of the other parameters along the profile of the linearised model.
        follow = self.covariance[n] / self.covariance[n, n]
        reach = min(math.sqrt(self.rise * self.covariance[n, n]), width)
        start, good, bad = self.found + sign * reach * follow, (0.0, 0.0), math.inf
        for _ in range(_TRIALS):
            start[n] = self.found[n] + sign * reach
            risen, least = self._minimise(start, n)
            if risen < -_LOWER * self.rise:
                raise LowerMinimumError(least)
            share = math.sqrt(max(risen, 0.0) / self.rise)
            if abs(share - 1.0) < _CLOSE or (share < 1.0 and reach == width):
                return float(start[n])
            if not math.isfinite(share):
                bad, following = reach, 0.5 * (good[0] + reach)
            else:
                slope = (share - good[1]) / (reach - good[0])
                following = reach + (1.0 - share) / slope if slope > 0.0 else 2.0 * reach
                following = float(np.clip(following, 0.5 * reach, 2.0 * reach))
                following = following if following < bad else 0.5 * (reach + bad)
                good, start = (reach, share), least
            following = min(following, width)
            start = self.found + (following / reach) * (start - self.found)
            reach = following
        return sign * math.inf

    def _minimise(self, start: np.ndarray, n: int) -> tuple[float, np.ndarray]:
        """Return the least rise of the squares at fixed parameter `n`, and where; infinite if not found."""
        others = [k for k in range(len(start)) if k != n]
        here, step, damping = start.copy(), np.zeros(len(start)), 1.0
        best = math.inf
        for _ in range(_STEPS):
            residual, slopes = self.residuals(here + damping * step)
            squares = float(residual @ residual)
            if not squares <= best:  # larger, or no residuals there
                if not math.isfinite(best):
                    break
                damping *= 0.5
                continue
            here, best, damping = here + damping * step, squares, 1.0
            by = slopes[:, others]
            step[others] = -np.linalg.lstsq(by, residual, rcond=None)[0]
            if float(np.sum((by @ step[others]) ** 2)) < _CONVERGED * self.rise:
                return best - self.smallest, here
        return math.inf, here
