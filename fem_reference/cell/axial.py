"""Energy of the strain itself: the core's bending, and the spring along it that the closed ends make."""

from typing import NamedTuple

import numpy as np
from jaxtyping import Float


class AxialEnergy(NamedTuple):
    """Energy per length at rest [N], and its first and second derivatives in the strain (u, λ)."""

    value: float
    first: Float[np.ndarray, "4"]
    second: Float[np.ndarray, "4 4"]


class AxialStiffness:
    """EI/2 (u1² + u2²)/λ + k/2 (λ − 1)² per length at rest.

    Parameters
    ----------
    bending : EI of the core [N mm²].
    spring : k, the axial stiffness of the ends times the body's length [N]; None if the ends do not give.
    """

    def __init__(self, bending: float, spring: float | None) -> None:
        self._bending, self._spring = bending, spring

    def energy(self, strain: Float[np.ndarray, "4"]) -> AxialEnergy:
        """Energy and derivatives at a strain."""
        bend, stretch = strain[:2], strain[3]
        square = float(bend @ bend)
        first, second = np.zeros(4), np.zeros((4, 4))
        first[:2] = bend / stretch
        first[3] = -0.5 * square / stretch**2
        second[[0, 1], [0, 1]] = 1.0 / stretch
        second[:2, 3] = second[3, :2] = -bend / stretch**2
        second[3, 3] = square / stretch**3
        value = 0.5 * self._bending * square / stretch
        first *= self._bending
        second *= self._bending
        if self._spring is not None:
            value += 0.5 * self._spring * (stretch - 1.0) ** 2
            first[3] += self._spring * (stretch - 1.0)
            second[3, 3] += self._spring
        return AxialEnergy(value, first, second)
