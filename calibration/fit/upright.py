"""What a law is told of a section that gives way sideways.

The cell's lateral stiffness falls through zero to minus infinity, because its walls lean over all along the
rod. In an actuator the neighbouring sections, base and cap keep them from it for some kilopascals more, and
a section law knows no neighbours. So a law is told that the section stands: sideways it has at least a part
of its other stiffnesses. Of states beyond the cell's loss of stability it learns nothing else of what happens
sideways: there the section is to stand where it stood when the cell gave way. How far that serves is for the
runs of the full actuator to say.
"""

import numpy as np
from jaxtyping import Bool, Float

from calibration.sweep import STIFFER

# Least lateral stiffness of a section relative to the median of its three.
UPRIGHT = 0.5
# Share of a section's softest direction that lies across its bending plane, above which it is lateral.
_ACROSS = 0.8
# Curvature below which a section has no bending plane [1/m].
_STRAIGHT = 1.0


def stood_upright(
    gradient: Float[np.ndarray, "n 6"],
    hessian: Float[np.ndarray, "n 6 6"],
    applied: Float[np.ndarray, "n 3"],
    held: Bool[np.ndarray, " n"],
    curvature: Float[np.ndarray, "n 3"],
) -> tuple[Float[np.ndarray, "n 6"], Float[np.ndarray, "n 6 6"]]:
    """Return gradients and Hessians with the soft direction of sections that give way replaced.

    Parameters
    ----------
    gradient, hessian : of Π in (u, p) [SI].
    applied : moment of the path at the state, which the section is to bear [N m].
    held : states beyond the cell's loss of lateral stability.
    curvature : u, body frame [1/m].

    Returns
    -------
    gradient, hessian : along the softest direction, if its stiffness is below `UPRIGHT` of the median and it
        is lateral: that stiffness, and for a held state the applied moment and no coupling to the pressures.
        All else stays.
    """
    gradient, hessian = gradient.copy(), hessian.copy()
    value, frames = np.linalg.eigh(hessian[:, :3, :3])
    least = UPRIGHT * np.median(value, axis=1)
    soft = (value[:, 0] < least) & (held | _lateral(frames[:, :, 0], curvature))
    for n in np.flatnonzero(soft):
        v = frames[n, :, 0]
        hessian[n, :3, :3] += (least[n] - value[n, 0]) * np.outer(v, v)
        if held[n]:
            gradient[n, :3] += v * (v @ (applied[n] - gradient[n, :3]))
            coupling = np.outer(v, v @ hessian[n, :3, 3:])
            hessian[n, :3, 3:] -= coupling
            hessian[n, 3:, :3] -= coupling.T
    return gradient, hessian


def leaned_over(
    hessian: Float[np.ndarray, "n 6 6"], held: Bool[np.ndarray, " n"], path: np.ndarray
) -> Bool[np.ndarray, " n"]:
    """Return which states beyond the cell's loss of stability have leaned over, though they were held.

    On the way up an upright section becomes softer and softer sideways. One that was soft and is stiffer
    again has walls that have folded; so have the states after it.

    Parameters
    ----------
    hessian, held : see `stood_upright`.
    path : name of each state's path; a path's states are in order.
    """
    value = np.linalg.eigvalsh(hessian[:, :3, :3])
    softness = value[:, 0] / np.median(value, axis=1)
    leaned = np.zeros(len(held), dtype=bool)
    for name in np.unique(path[held]):
        rows = np.flatnonzero((path == name) & held)
        least = np.minimum.accumulate(softness[rows])
        again = (least < UPRIGHT) & (softness[rows] > least + STIFFER)
        leaned[rows] = np.maximum.accumulate(again)
    return leaned


def _lateral(direction: Float[np.ndarray, "n 3"], curvature: Float[np.ndarray, "n 3"]) -> np.ndarray:
    """Whether directions are across the bending planes."""
    bend = np.hypot(curvature[:, 0], curvature[:, 1])
    across = np.stack([-curvature[:, 1], curvature[:, 0]], axis=1) / np.maximum(bend, _STRAIGHT)[:, None]
    share: np.ndarray = np.abs((direction[:, :2] * across).sum(axis=1))
    return share > _ACROSS
