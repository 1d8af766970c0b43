"""Weight and tip load of the actuator, with the tip load's own stiffness (N, mm)."""

from typing import NamedTuple

import numpy as np
import scipy.sparse as sparse
from jaxtyping import Float

from fem_reference.actuator.load import ActuatorTarget
from fem_reference.elements import TipFace


class LoadResponse(NamedTuple):
    """Load at every point [N], and the tip load's stiffness.

    The stiffness is ``columns`` times ``rows``, over the unknowns: of rank three, and not symmetric. They are
    None without a tip load.
    """

    force: Float[np.ndarray, "points 3"]
    columns: Float[np.ndarray, "q 3"] | None = None
    rows: Float[np.ndarray, "3 q"] | None = None


class ExternalLoad:
    """Loads on the body's points.

    Parameters
    ----------
    mass : that each point stands for [tonne].
    tip : face that carries the tip load.
    fold : sums components of all points to unknowns; see `DofMap`.
    """

    def __init__(self, mass: Float[np.ndarray, " points"], tip: TipFace, fold: sparse.csr_matrix) -> None:
        self._mass, self._tip, self._fold = mass, tip, fold

    def response(self, positions: Float[np.ndarray, "points 3"], target: ActuatorTarget) -> LoadResponse:
        """Load and stiffness at these positions."""
        load = self._mass[:, None] * target.gravity
        if not (target.tip_force.any() or target.tip_moment.any()):
            return LoadResponse(load)
        tip, fold = self._tip, self._fold
        frame = tip.frame(positions)
        turn = frame.rotation if target.follower else np.eye(3)
        resultant = (turn @ target.tip_force, turn @ target.tip_moment)
        load[tip.nodes] += tip.forces(frame, *resultant)
        columns, rows = np.zeros((*positions.shape, 3)), np.zeros((3, *positions.shape))
        columns[tip.nodes] = tip.stiffness_columns(frame, *resultant, target.follower)
        rows[:, tip.nodes] = tip.rotation_rows(frame)
        return LoadResponse(load, fold @ columns.reshape(-1, 3), (fold @ rows.reshape(3, -1).T).T)
