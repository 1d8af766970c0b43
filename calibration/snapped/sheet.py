"""Which wall has snapped, and to which side.

The partition wall opposite a chamber under high pressure folds, and the section bends out of the
plane in which it stood. There is such a sheet of states to either side of each chamber.
"""

import math
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from fem_reference import Load


@dataclass(frozen=True)
class SnappedSheet:
    """A sheet of states of a section that leans to one side.

    Parameters
    ----------
    chamber : number of the chamber with the high pressure, from 1.
    side : +1 if the bending plane's angle γ is larger than that of the upright section, −1 if smaller.

    Raises
    ------
    ValueError
        For another chamber or side.
    """

    chamber: int
    side: int

    def __post_init__(self) -> None:
        if self.chamber not in (1, 2, 3):
            raise ValueError(f"chamber: got {self.chamber!r}, expected 1, 2 or 3")
        if self.side not in (-1, 1):
            raise ValueError(f"side: got {self.side!r}, expected 1 or -1")

    @property
    def _azimuth(self) -> float:
        return 2.0 * math.pi / 3.0 * (self.chamber - 1)

    @property
    def bending_axis(self) -> Float[np.ndarray, "3"]:
        """Axis about which the chamber alone bends an upright section, body frame."""
        return np.array([math.sin(self._azimuth), -math.cos(self._azimuth), 0.0])

    @property
    def aside_axis(self) -> Float[np.ndarray, "3"]:
        """Axis about which a section that leans to this side bends too, body frame."""
        return self.side * np.array([math.cos(self._azimuth), math.sin(self._azimuth), 0.0])

    def aside(self, curvature: Float[np.ndarray, "3"]) -> float:
        """Angle between the bending plane of a curvature and the upright section's; positive to this side."""
        return math.atan2(float(self.aside_axis @ curvature), float(self.bending_axis @ curvature))

    def pressure(self, own: float, before: float = 0.0, after: float = 0.0) -> tuple[float, float, float]:
        """Pressures of the three chambers, from those of the chamber and of the ones before and after it."""
        three = [0.0, 0.0, 0.0]
        for shift, value in ((0, own), (-1, before), (1, after)):
            three[(self.chamber - 1 + shift) % 3] = value
        return three[0], three[1], three[2]

    def approach(self, own: float, moment: float, steps: int) -> list[Load]:
        """Loads that lead onto the sheet from rest: pressure, with a moment aside that goes again.

        Parameters
        ----------
        own : pressure at which the path ends on the sheet [Pa].
        moment : moment to this side on the upper half of the way [N m].
        steps : number of steps.
        """
        push = (moment * self.aside_axis).tolist()
        loads = [
            Load(self.pressure(own * n / steps), (push[0], push[1], push[2]) if 2 * n >= steps else None)
            for n in range(1, steps + 1)
        ]
        return [*loads, Load(self.pressure(own))]
