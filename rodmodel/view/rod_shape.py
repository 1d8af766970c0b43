"""Pose of a rod for its picture: axis, frames and colours. Lengths in mm."""

from typing import Any, NamedTuple, Protocol, runtime_checkable

import numpy as np
from matplotlib.colors import to_rgb

from rodmodel.actuator import Actuator
from rodmodel.view.scene import Faces, tube
from rodmodel.view.text import STRAIGHT

SILICONE, CAP = "#dcd8cf", "#8f8b84"
CHAMBER_COLOURS = ("#0072b2", "#e69f00", "#009e73")
# Half the angle of a chamber: 60 degrees less half a partition wall.
CHAMBER_HALF_WIDTH = np.radians(50.0)
# Stations along the rod, and faces around it.
_RINGS, _FACETS = 67, 48
# Depth of a chamber's colour without pressure and with the least; it is 1 at the largest pressure.
_EMPTY, _LOADED = 0.22, 0.45


@runtime_checkable
class Bent(Protocol):
    """Part of a solution that is drawn, of the compiled or the differentiable rod."""

    @property
    def bending_angle(self) -> Any:
        """θ [rad]."""

    @property
    def bending_plane(self) -> Any:
        """γ [rad]."""

    @property
    def tip_position(self) -> Any:
        """Centre of the cap's outer face [m], (3,)."""

    @property
    def error_estimate(self) -> Any:
        """Error bound of θ [rad]; NaN outside the calibration."""

    @property
    def converged(self) -> Any:
        """Whether the rod carries the full load."""

    @property
    def stats(self) -> Any:
        """Mapping with `load_fraction`, the fraction of the load that was reached."""

    def centreline(self, arc_length: Any) -> Any:
        """Return positions at arc lengths [m], (n, 3)."""

    def frames(self, arc_length: Any) -> Any:
        """Return frames at arc lengths, directors as columns, (n, 3, 3)."""


class Pose(NamedTuple):
    """Rod in millimetres, with the pressures as fractions of the largest in the picture."""

    centre: np.ndarray
    frames: np.ndarray
    in_cap: np.ndarray
    radius: float
    pressure_kpa: np.ndarray
    shade: np.ndarray
    angle_deg: float
    plane: float
    """γ [rad]; zero for a straight rod."""
    straight: bool
    tip: np.ndarray
    error_deg: float
    """NaN if unknown."""
    load_fraction: float

    @property
    def plane_deg(self) -> str:
        """γ as text."""
        # The modulus keeps a rounding below zero from reading 360.0.
        return "–" if self.straight else f"{np.degrees(self.plane) % 359.95:.1f}°"

    @property
    def length(self) -> float:
        """Length from base to the cap's outer face [mm]."""
        return float(np.linalg.norm(np.diff(self.centre, axis=0), axis=1).sum())

    def behind(self, station: int) -> "Pose":
        """Return the part of the rod from a station on."""
        return self._replace(
            centre=self.centre[station:], frames=self.frames[station:], in_cap=self.in_cap[station:]
        )

    def moved(self, by: np.ndarray) -> "Pose":
        """Return the rod moved by a vector [mm], with the label of its tip unchanged."""
        return self._replace(centre=self.centre + by)

    @property
    def pressures(self) -> str:
        """Pressures of the chambers as text."""
        return " / ".join(f"{p:.4g}" for p in self.pressure_kpa) + " kPa"


def pose_of(pressure: np.ndarray, largest: float, solution: Bent, actuator: Actuator) -> Pose:
    """Return the pose of a solution; raise a ValueError for a solution of bad input, which has no shape."""
    if not np.all(np.isfinite(solution.tip_position)):
        raise ValueError(
            "poses: got a solution without a shape, of bad input, expected one whose tip position is known"
        )
    arc_length = np.linspace(0.0, float(actuator.body_length + actuator.cap_length), _RINGS)
    straight = abs(float(solution.bending_angle)) < STRAIGHT
    frames = np.asarray(solution.frames(arc_length))
    return Pose(
        centre=1e3 * np.asarray(solution.centreline(arc_length)),
        frames=frames,
        in_cap=arc_length[:-1] > actuator.body_length - 1e-9,
        radius=float(0.5e3 * actuator.body_diameter),
        pressure_kpa=1e-3 * np.asarray(pressure, float),
        shade=np.asarray(pressure, float) / largest,
        angle_deg=float(np.degrees(solution.bending_angle)),
        plane=0.0 if straight else float(solution.bending_plane),
        straight=straight,
        tip=1e3 * np.asarray(solution.tip_position),
        error_deg=float(np.degrees(solution.error_estimate)),
        load_fraction=1.0 if solution.converged else float(solution.stats["load_fraction"]),
    )


def skin(pose: Pose) -> Faces:
    """Return the tube to scale, each chamber in the colour of its pressure."""
    middle = 2.0 * np.pi * (np.arange(_FACETS) + 0.5) / _FACETS
    around = np.tile(to_rgb(SILICONE), (_FACETS, 1))
    for chamber, colour in enumerate(tints(pose.shade)):
        offset = np.angle(np.exp(1j * (middle - 2.0 * np.pi / 3.0 * chamber)))
        around[np.abs(offset) < CHAMBER_HALF_WIDTH] = colour
    colours = np.repeat(around[None], len(pose.in_cap), axis=0)
    colours[pose.in_cap] = to_rgb(CAP)
    return tube(pose.centre, pose.frames, pose.radius, colours)


def tints(shade: np.ndarray) -> np.ndarray:
    """Return colours of the chambers, (3, 3): deeper for more pressure, near the silicone's for none."""
    depth = np.where(shade > 0.0, _LOADED + (1.0 - _LOADED) * shade, _EMPTY)[:, None]
    full = np.array([to_rgb(colour) for colour in CHAMBER_COLOURS])
    return np.asarray((1.0 - depth) * np.array(to_rgb(SILICONE)) + depth * full)
