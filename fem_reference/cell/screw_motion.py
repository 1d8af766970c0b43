"""The rigid motions exp(s·(λ e3, u)) in SE(3), with first and second derivatives in the strain (u, λ).

s is the body's length at rest, and λ its stretch along the core: λs is the core's arc length, as the core is
inextensible. Over one pitch s|u| stays well below one. The exponential's series then reaches round-off in a
few terms; it is exact at u = 0 and has polynomial derivatives.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from fem_reference.rotations import cross_matrix

_TERMS = 22
_LIMIT = 2.0


@dataclass(frozen=True)
class ScrewSeries:
    """Coefficients of exp(sΞ) = Σ_k s^k C_k, and their derivatives in y = (u, λ).

    Parameters
    ----------
    value : C_k, (k, 4, 4).
    first : ∂C_k/∂y_i, (k, 4, 4, 4).
    second : ∂²C_k/∂y_i∂y_j, (k, 4, 4, 4, 4).
    """

    value: Float[np.ndarray, "terms 4 4"]
    first: Float[np.ndarray, "terms 4 4 4"]
    second: Float[np.ndarray, "terms 4 4 4 4"]

    def at(
        self, s: float
    ) -> tuple[Float[np.ndarray, "4 4"], Float[np.ndarray, "4 4 4"], Float[np.ndarray, "4 4 4 4"]]:
        """exp(sΞ) and its first and second derivatives in (u, λ), as homogeneous matrices [R c; 0 1]."""
        powers = s ** np.arange(_TERMS)
        return (
            np.tensordot(powers, self.value, 1),
            np.tensordot(powers, self.first, 1),
            np.tensordot(powers, self.second, 1),
        )


def screw_series(curvature: Float[np.ndarray, "3"], length: float, stretch: float = 1.0) -> ScrewSeries:
    """Series of exp(sΞ(u, λ)) for 0 ≤ |s| ≤ ``length``.

    Parameters
    ----------
    curvature : u, body frame, per length at rest [1/mm].
    length : largest |s| at which the series is used [mm].
    stretch : λ.

    Raises
    ------
    ValueError
        When ``length``·|u| is so large that the series is not exact.
    """
    angle = length * float(np.linalg.norm(curvature))
    if not angle <= _LIMIT:
        raise ValueError(
            f"curvature: got {angle:.3g} rad of bending over {length:g} mm, expected at most {_LIMIT} rad"
        )
    xi = np.zeros((4, 4))
    xi[:3, :3] = cross_matrix(curvature)
    xi[2, 3] = stretch
    d_xi = np.zeros((4, 4, 4))
    d_xi[3, 2, 3] = 1.0
    for i in range(3):
        d_xi[i, :3, :3] = cross_matrix(np.eye(3)[i])
    value = np.zeros((_TERMS, 4, 4))
    first = np.zeros((_TERMS, 4, 4, 4))
    second = np.zeros((_TERMS, 4, 4, 4, 4))
    value[0] = np.eye(4)
    for k in range(1, _TERMS):
        value[k] = xi @ value[k - 1] / k
        first[k] = (d_xi @ value[k - 1] + xi @ first[k - 1]) / k
        cross = d_xi[:, None] @ first[k - 1][None, :]
        second[k] = (cross + cross.transpose(1, 0, 2, 3) + xi @ second[k - 1]) / k
    return ScrewSeries(value, first, second)
