"""What a law is told of a section that gives way sideways while its curvature is imposed.

The cell's lateral stiffness falls through zero to minus infinity, because its walls lean over all along the
rod. In an actuator the neighbouring sections, base and cap keep them from it for some kilopascals more, and
a section law knows no neighbours. So of these states a law learns all but what happens sideways: there it is
to stand where it stood when the cell gave way, with a stiffness that is a part of the others. How far that
serves is for the runs of the full actuator to say.
"""

import numpy as np
from jaxtyping import Bool, Float

# Lateral stiffness of such a section relative to the median of its three.
UPRIGHT = 0.5


def stood_upright(
    gradient: Float[np.ndarray, "n 6"],
    hessian: Float[np.ndarray, "n 6 6"],
    applied: Float[np.ndarray, "n 3"],
    held: Bool[np.ndarray, " n"],
) -> tuple[Float[np.ndarray, "n 6"], Float[np.ndarray, "n 6 6"]]:
    """Return gradients and Hessians with the soft direction of the held states replaced.

    Parameters
    ----------
    gradient, hessian : of Π in (u, p) [SI].
    applied : moment of the path at the state, which the section is to bear [N m].
    held : states at an imposed curvature, beyond the loss of lateral stability.

    Returns
    -------
    gradient, hessian : along the softest direction of a held state, if its stiffness is below `UPRIGHT` of
        the median: that stiffness, the applied moment, and no coupling to the pressures. All else stays.
    """
    gradient, hessian = gradient.copy(), hessian.copy()
    for n in np.flatnonzero(held):
        value, frame = np.linalg.eigh(hessian[n, :3, :3])
        if value[0] >= UPRIGHT * np.median(value):
            continue
        v = frame[:, 0]
        gradient[n, :3] += v * (v @ (applied[n] - gradient[n, :3]))
        hessian[n, :3, :3] += (UPRIGHT * np.median(value) - value[0]) * np.outer(v, v)
        coupling = np.outer(v, v @ hessian[n, :3, 3:])
        hessian[n, :3, 3:] -= coupling
        hessian[n, 3:, :3] -= coupling.T
    return gradient, hessian
