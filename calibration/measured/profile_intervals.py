"""Intervals of fitted parameters from the profile of the sum of squares, for models that are not linear.

Standard errors of the linearised model are too small where the model bends within them. The profile of one
parameter, the least sum of squares at each of its values, rises by the square of the wanted quantile at the
ends of its interval; a change of parameters does not move them.

Bates and Watts (1988), Nonlinear regression analysis and its applications, section 6.1.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

_TRIALS = 12
_STEPS = 20
_CLOSE = 0.02  # of the half width, at which an end of an interval is found
_SETTLED = 1e-3  # decrease still to come, of the squares' rise to the end of an interval
_LOWER = 1e-2  # of that rise: below the minimum by more than rounding and what was still to come

#: Residuals (m,), NaN where there are none, and their slopes (m, n) at parameters (n,).
Residuals = Callable[[np.ndarray], tuple[np.ndarray, np.ndarray]]


class LowerMinimumError(ValueError):
    """The squares are less elsewhere than at what was given as their minimum: near `parameters` (n,)."""

    def __init__(self, parameters: np.ndarray) -> None:
        super().__init__(f"found: got a local minimum of the squares, which are less at {parameters}")
        self.parameters = parameters


def profile_intervals(
    residuals: Residuals, found: np.ndarray, rise: float, least: np.ndarray, most: np.ndarray
) -> np.ndarray:
    """Find where the profile of each parameter has risen.

    Parameters
    ----------
    residuals : over their noise; parameters of like size serve best.
    found : the minimum (n,).
    rise : of the sum of squares, at the ends.
    least, most : bounds of the parameters (n,).

    Returns
    -------
    ends (n, 2), to a fiftieth of the half width: the bound where the rise is not reached inside it, infinite
    where the profile cannot be followed so far.

    Raises
    ------
    LowerMinimumError
        Where a profile leads to less squares than at `found`.
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
        """Value of parameter `n` on one side of the minimum at which the squares have risen."""
        width = abs(bound - self.found[n])
        # Of the linearised model: the parameter's own way, and how the others follow.
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
        """Least rise of the squares with parameter `n` as it is; infinite where there is no way to it."""
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
            if float(np.sum((by @ step[others]) ** 2)) < _SETTLED * self.rise:
                return best - self.smallest, here
        return math.inf, here
