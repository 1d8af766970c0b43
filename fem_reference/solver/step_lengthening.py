"""How much farther to go than a step with another matrix says."""

import logging

import numpy as np
from jaxtyping import Float

_LOG = logging.getLogger(__name__)

# Steps alike: cosine of the angle between two of them, their ratio's bounds, and how many in a row; by how
# much the last is then lengthened at most, twice as much each time that the next is alike again, and to what
# displacement [mm].
_ALIKE, _SLOWEST, _FASTEST, _ROW = 0.95, 0.7, 1.6, 2
_FARTHEST, _LONGEST = 8.0, 1.0


class StepLengthening:
    """How much farther to go than a step with another matrix says.

    A step whose next is shorter by a share λ of it is the first of a sum of 1/λ such steps. Away from a
    saddle, where λ < 0, as much farther as towards a minimum.
    """

    def __init__(self) -> None:
        self._last: np.ndarray | None = None
        self._begin_row()

    def _begin_row(self) -> None:
        """The last step is the first of its kind, was not lengthened, and one may be so by little."""
        self._row, self._factor, self._most = 0, 1.0, _FARTHEST

    def factor(self, step: Float[np.ndarray, "..."]) -> float:
        """Of this step, the next after the one that was asked about last; 1 where they are not alike."""
        last, self._last = self._last, step
        if last is None:
            return 1.0
        square, before = float(np.vdot(step, step)), float(np.vdot(last, last))
        ratio = np.sqrt(square / before)
        alike = float(np.vdot(step, last)) > _ALIKE * np.sqrt(square * before)
        # After one that was lengthened, the next may well be much shorter.
        if not alike or (self._factor == 1.0 and not _SLOWEST < ratio < _FASTEST):
            self._begin_row()
            return 1.0
        self._row += 1
        share, self._factor = (1.0 - ratio) / self._factor, 1.0
        if self._row < _ROW:
            return 1.0
        farther = min(1.0 / max(abs(share), 1.0 / self._most), _LONGEST / float(np.abs(step).max()))
        if farther <= 1.0:
            return 1.0
        _LOG.debug("a step makes the next shorter by %.3f of it: %.3g of them at once", share, farther)
        self._factor, self._most = farther, 2.0 * self._most
        return farther

    def forget(self) -> None:
        """The next step does not follow from the last."""
        self._last = None
        self._begin_row()
