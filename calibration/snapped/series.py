"""A snapped section in series with an upright one: what a length of an actuator makes of a snap.

Base and cap hold the sections next to them upright, so that only a part of the length snaps. Sections in
series bear the same moment and pressures, and their curvatures and volumes are averaged. In terms of the
complementary potential Γ(m, p) = m·u − Π, with ∂Γ/∂m = u and ∂Γ/∂p = −∂Π/∂p, the series connection is the
weighted mean of the two Γ.
"""

from dataclasses import replace

import numpy as np
from jaxtyping import Float

from calibration.fit import Samples


def in_series(snapped: Samples, upright: Samples, share: float) -> Samples:
    """Return the states of sections of which a share stands upright.

    Parameters
    ----------
    snapped, upright : states under the same pressures and moments, one row each.
    share : length that is upright over all, from 0 to 1.

    Raises
    ------
    ValueError
        For another share.
    """
    if not 0.0 <= share <= 1.0:
        raise ValueError(f"share: got {share}, expected a number from 0 to 1")

    def mean(of_snapped: np.ndarray, of_upright: np.ndarray) -> np.ndarray:
        return (1.0 - share) * of_snapped + share * of_upright

    gradient = snapped.gradient.copy()
    gradient[:, 3:] = mean(snapped.gradient[:, 3:], upright.gradient[:, 3:])
    second = mean(_complementary(snapped.hessian), _complementary(upright.hessian))
    return replace(
        snapped,
        curvature=mean(snapped.curvature, upright.curvature),
        energy=np.full(len(snapped), np.nan),
        gradient=gradient,
        # The transformation is its own inverse.
        hessian=_complementary(second),
    )


def _complementary(hessian: Float[np.ndarray, "n 6 6"]) -> Float[np.ndarray, "n 6 6"]:
    """Second derivatives of Γ in (m, p) from those of Π in (u, p), and back: Legendre's transformation."""
    inner = np.linalg.inv(hessian[:, :3, :3])
    coupling = -inner @ hessian[:, :3, 3:]
    result = np.empty_like(hessian)
    result[:, :3, :3] = inner
    result[:, :3, 3:] = coupling
    result[:, 3:, :3] = np.swapaxes(coupling, 1, 2)
    result[:, 3:, 3:] = -hessian[:, 3:, 3:] - hessian[:, 3:, :3] @ coupling
    return result
