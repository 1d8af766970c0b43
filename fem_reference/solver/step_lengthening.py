"""Longer steps where each step with a corrected matrix is a fixed multiple of the one before."""

import logging

import numpy as np
from jaxtyping import Float

from fem_reference.solver.options import DEFAULT, StepLengtheningOptions

_LOG = logging.getLogger(__name__)


class StepLengthening:
    """Factor by which a step is lengthened to the sum of the steps that would follow.

    If the next step is shorter by a share λ, the sum is 1/λ of the step. Away from a saddle λ < 0, and the
    step is lengthened by as much as towards a minimum.

    Parameters
    ----------
    options : when steps are alike, and how far one may be lengthened.
    """

    def __init__(self, options: StepLengtheningOptions = DEFAULT.step_lengthening) -> None:
        self._options = options
        self._last: np.ndarray | None = None
        self._begin_row()

    def _begin_row(self) -> None:
        """Count alike steps anew, from the last one on."""
        self._row, self._factor, self._most = 0, 1.0, self._options.most

    def factor(self, step: Float[np.ndarray, "..."]) -> float:
        """Factor of this step, which follows the last one asked about; 1 where they are not alike."""
        options = self._options
        last, self._last = self._last, step
        if last is None:
            return 1.0
        square, before = float(np.vdot(step, step)), float(np.vdot(last, last))
        ratio = np.sqrt(square / before)
        alike = float(np.vdot(step, last)) > options.alike * np.sqrt(square * before)
        # A lengthened step may leave a much shorter one.
        in_range = options.least_ratio < ratio < options.greatest_ratio
        if not alike or (self._factor == 1.0 and not in_range):
            self._begin_row()
            return 1.0
        self._row += 1
        share, self._factor = (1.0 - ratio) / self._factor, 1.0
        if self._row < options.row:
            return 1.0
        farther = min(1.0 / max(abs(share), 1.0 / self._most), options.longest / float(np.abs(step).max()))
        if farther <= 1.0:
            return 1.0
        _LOG.debug(
            "the next step is shorter by a share of %.3f: %.3g steps are taken at once", share, farther
        )
        self._factor, self._most = farther, 2.0 * self._most
        return farther

    def forget(self) -> None:
        """Count anew, as the next step does not follow the last one."""
        self._last = None
        self._begin_row()
