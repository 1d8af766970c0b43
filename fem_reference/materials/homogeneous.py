"""Stress of an incompressible solid under uniaxial, planar and equibiaxial stretch, and Drucker's stability.

A test stretches one or two directions by λ and leaves the third free of stress. Plain NumPy: curves and
fits need no compilation. Stresses have the unit of the material's constants (Pa).

References
----------
Ogden (1972), Proc. R. Soc. A 326, eq. 9 to 19: the three tests. Drucker (1959), J. Appl. Mech. 26: stability.
"""

from collections.abc import Mapping
from typing import Protocol, runtime_checkable

import numpy as np
from jaxtyping import Float

#: Principal stretches are powers of λ, by the mode of the test; the last direction is free of stress.
MODES: Mapping[str, tuple[float, float, float]] = {
    "uniaxial": (1.0, -0.5, -0.5),
    "planar": (1.0, 0.0, -1.0),
    "biaxial": (1.0, 1.0, -2.0),
}
# Points at which stability is looked at: a tenth of a per cent apart for a stretch of up to 1.5.
_POINTS = 401


@runtime_checkable
class PrincipalLaw(Protocol):
    """First and second derivatives of an isochoric energy by ln λ_i, at stretches (…, 3)."""

    def slope(self, stretches: Float[np.ndarray, "*points 3"]) -> Float[np.ndarray, "*points 3"]:
        """Return ∂W/∂(ln λ_i), up to a pressure."""
        ...

    def curvature(self, stretches: Float[np.ndarray, "*points 3"]) -> Float[np.ndarray, "*points 3 3"]:
        """Return ∂²W/∂(ln λ_i) ∂(ln λ_j)."""
        ...


def principal_stretches(
    mode: str, stretch: float | Float[np.ndarray, "*points"]
) -> Float[np.ndarray, "*points 3"]:
    """Return the principal stretches of a test.

    Parameters
    ----------
    mode : one of `MODES`.
    stretch : λ, positive.

    Raises
    ------
    ValueError
        For an unknown mode, or a stretch that is not positive.
    """
    if mode not in MODES:
        raise ValueError(f"mode: got {mode!r}, expected one of {', '.join(MODES)}")
    lam = np.asarray(stretch, float)
    if not (lam > 0.0).all():
        raise ValueError(f"stretch: got {lam.min():g}, expected positive numbers")
    return np.power(lam[..., None], MODES[mode])


def nominal_stress(
    law: PrincipalLaw, mode: str, stretch: float | Float[np.ndarray, "*points"]
) -> Float[np.ndarray, "*points"]:
    """Return the force over the area at rest, in a stretched direction [unit of the constants].

    Parameters
    ----------
    law : material.
    mode : one of `MODES`.
    stretch : λ of the stretched directions.
    """
    slope = law.slope(principal_stretches(mode, stretch))
    return np.asarray((slope[..., 0] - slope[..., 2]) / np.asarray(stretch, float))


def true_stress(
    law: PrincipalLaw, mode: str, stretch: float | Float[np.ndarray, "*points"]
) -> Float[np.ndarray, "*points"]:
    """Return the Cauchy stress, the force over the area as it is, of `nominal_stress`."""
    return np.asarray(np.asarray(stretch, float) * nominal_stress(law, mode, stretch))


def drucker_matrix(
    law: PrincipalLaw, stretches: Float[np.ndarray, "*points 3"]
) -> Float[np.ndarray, "*points 2 2"]:
    """Return ∂(τ_1, τ_2)/∂(ε_1, ε_2) with the third direction free of stress, [unit of the constants].

    The strains ε = ln λ change ε_3 by their negative sum. The solid is stable by Drucker, dτ_1 dε_1 +
    dτ_2 dε_2 > 0 for all changes, where this symmetric matrix is positive definite.
    """
    h = law.curvature(stretches)
    across = h[..., :2, 2]
    return h[..., :2, :2] - across[..., :, None] - across[..., None, :] + h[..., 2, 2, None, None]


def first_instability(law: PrincipalLaw, mode: str, least: float, most: float) -> float | None:
    """Return the stretch nearest to one from which the solid is not stable by Drucker, or None.

    Parameters
    ----------
    law : material.
    mode : one of `MODES`.
    least, most : range of λ.
    """
    stretch = np.exp(np.linspace(np.log(min(least, 1.0)), np.log(max(most, 1.0)), _POINTS))
    drucker = drucker_matrix(law, principal_stretches(mode, stretch))
    stable = (drucker[:, 0, 0] > 0.0) & (np.linalg.det(drucker) > 0.0)
    if stable.all():
        return None
    unstable = stretch[~stable]
    return float(unstable[np.abs(np.log(unstable)).argmin()])
