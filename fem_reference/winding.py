"""Winding layouts: each yields the thread's polylines, in the reference configuration."""

import abc
import math
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float


@dataclass(frozen=True)
class Thread:
    """Elastic data of the thread.

    The paper's table has lost the modulus; 31 067 MPa and a radius of 0.0889 mm are the values of this
    literature (Soft Robotics Toolkit; Connolly et al. 2015), so that EA = 771 N: inextensible beside the
    silicone.

    Parameters
    ----------
    young_modulus : [Pa].
    radius : [m].
    """

    young_modulus: float = 31067e6
    radius: float = 0.0889e-3

    def __post_init__(self) -> None:
        for name in ("young_modulus", "radius"):
            value = getattr(self, name)
            if not (math.isfinite(value) and value > 0.0):
                raise ValueError(f"{name}: got {value!r}, expected a positive finite number")

    @property
    def axial_stiffness(self) -> float:
        """EA [N]."""
        return self.young_modulus * math.pi * self.radius**2


class Winding(abc.ABC):
    """A layout of thread on a cylinder: geometry only."""

    #: Name of the layout on the command line and in calibration files.
    name: str

    @property
    @abc.abstractmethod
    def period(self) -> float:
        """Axial length after which the layout repeats [m]."""

    @abc.abstractmethod
    def polylines(
        self, radius: float, length: float, points_per_turn: int
    ) -> list[Float[np.ndarray, "points 3"]]:
        """Return the threads between z = 0 and z = ``length`` on a cylinder of ``radius`` [m].

        Each thread is an array of points [m]; consecutive points are joined by straight segments.
        """


@dataclass(frozen=True)
class DoubleHelix(Winding):
    """Two threads of opposite hand, θ±(z) = ψ ± 2πz/pitch.

    They cross at azimuth ψ and ψ + 180°, every pitch.

    Parameters
    ----------
    psi : winding orientation ψ, from the centre of chamber 1 [rad].
    pitch : axial advance per turn [m].
    """

    psi: float = 0.0
    pitch: float = 3e-3
    name = "double-helix"

    def __post_init__(self) -> None:
        if not math.isfinite(self.psi):
            raise ValueError(f"psi: got {self.psi!r}, expected a finite angle in radians")
        if not (math.isfinite(self.pitch) and self.pitch > 0.0):
            raise ValueError(f"pitch: got {self.pitch!r}, expected a positive finite length in metres")

    @property
    def period(self) -> float:
        """Axial length after which the layout repeats: one pitch [m]."""
        return self.pitch

    def polylines(
        self, radius: float, length: float, points_per_turn: int
    ) -> list[Float[np.ndarray, "points 3"]]:
        """Return both threads between z = 0 and z = ``length`` [m]; see `Winding.polylines`."""
        segments = max(1, round(points_per_turn * length / self.pitch))
        z = np.linspace(0.0, length, segments + 1)
        threads = []
        for hand in (+1.0, -1.0):
            azimuth = self.psi + hand * 2.0 * math.pi * z / self.pitch
            threads.append(np.column_stack([radius * np.cos(azimuth), radius * np.sin(azimuth), z]))
        return threads
