"""Winding layouts and the thread: polylines on a cylinder about z, in the reference configuration.

Azimuths, ψ among them, are counted from the centre of chamber 1.
"""

import abc
import math
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from jaxtyping import Float

from fem_reference.geometry.paper import paper_number
from fem_reference.geometry.plausible import refuse_implausible

#: How a thread may be coupled to the body.
COUPLINGS = ("axis", "circumference")
#: Pitch of the paper's double helix [m].
PITCH = paper_number("winding", "pitch_mm", -3)
# Round-off of heights, as a share of the length.
_ROUND_OFF = 1e-9


@dataclass(frozen=True)
class Thread:
    """Elastic constants of the thread, and how it is tied to the silicone.

    The paper's table has lost the modulus; the defaults are the values of this literature (Soft Robotics
    Toolkit; Connolly et al. 2015), so that EA = 771 N: inextensible beside the silicone.

    Parameters
    ----------
    young_modulus : [Pa].
    radius : [m].
    coupling : how the thread is tied to the silicone. ``circumference``: a thread point follows the mean
        displacement of the silicone around the thread's cross-section; the result converges with the mesh.
        ``axis``: it follows the silicone on the thread's centre line; the silicone is then indented the
        more, the smaller the elements are.
    bends : include the bending stiffness of a solid round wire. False suits yarn.
    slack_share : axial stiffness in compression over that in tension: 1 for a truss, about 1e-4 for yarn
        that goes slack.
    """

    young_modulus: float = 31067e6
    radius: float = paper_number("thread", "radius_mm", -3)
    coupling: str = "circumference"
    bends: bool = False
    slack_share: float = 1.0

    def __post_init__(self) -> None:
        for name in ("young_modulus", "radius"):
            value = getattr(self, name)
            if not (math.isfinite(value) and value > 0.0):
                raise ValueError(f"{name}: got {value!r}, expected a positive finite number")
            refuse_implausible(name, value)
        if not 0.0 < self.slack_share <= 1.0:
            raise ValueError(
                f"slack_share: got {self.slack_share!r}, expected a number above 0 and at most 1"
            )
        if self.coupling not in COUPLINGS:
            raise ValueError(f"coupling: got {self.coupling!r}, expected one of {', '.join(COUPLINGS)}")

    @property
    def diameter(self) -> float:
        """Diameter [m]."""
        return 2.0 * self.radius

    @property
    def axial_stiffness(self) -> float:
        """EA [N]."""
        return self.young_modulus * math.pi * self.radius**2

    @property
    def bending_stiffness(self) -> float:
        """EI of a solid wire [N m²]."""
        return self.young_modulus * math.pi * self.radius**4 / 4.0


@dataclass(frozen=True)
class Winding(abc.ABC):
    """A layout of threads on a cylinder; it has no stiffness of its own."""

    #: Name of the layout on the command line and in calibration files.
    name: ClassVar[str]

    @property
    @abc.abstractmethod
    def period(self) -> float:
        """Smallest axial length after which the layout repeats [m]; infinite where there is no smallest."""

    def cell_length(self, body_diameter: float) -> float:
        """Return the length of a period cell [m] of a body with this diameter [m]: a period."""
        return self.period

    @property
    @abc.abstractmethod
    def interval(self) -> float:
        """Axial distance from one crossing of threads to the next, or from ring to ring [m]."""

    @property
    @abc.abstractmethod
    def mirror_symmetric(self) -> bool:
        """True if the mirror image in chamber 1's mid-plane is the layout itself, shifted along z."""

    @property
    @abc.abstractmethod
    def mirror_in_place(self) -> bool:
        """True if that image is the layout itself without a shift: half of a body then tells the whole."""

    @abc.abstractmethod
    def refuse_overlap(self, thread: Thread) -> None:
        """Raise a ValueError that names the argument if neighbouring turns of the thread overlap."""

    @abc.abstractmethod
    def polylines(
        self, radius: float, length: float, points_per_turn: int, start: float = 0.0
    ) -> list[Float[np.ndarray, "_ 3"]]:
        """Return the threads on a cylinder of ``radius`` [m] between z = ``start`` and ``start + length``.

        Each thread is an array of points [m] that straight segments join. A closed thread ends on its first
        point. The length need not be a multiple of the period. The points of a helix are those that it has
        when it starts at z = 0; the first one not below ``start`` begins the thread.

        Raises
        ------
        ValueError
            For fewer than three points per turn, or a length too short for the layout.
        """


@dataclass(frozen=True)
class _CrossedHelices(Winding):
    """Threads in pairs of opposite hand, θ±(z) = ψ + 360° k/pairs ± 2πz/pitch for k = 0 … pairs − 1."""

    psi: float = 0.0
    pitch: float = PITCH
    _pairs: ClassVar[int]

    def __post_init__(self) -> None:
        if not math.isfinite(self.psi):
            raise ValueError(f"psi: got {self.psi!r}, expected a finite angle in radians")
        refuse_implausible("psi", self.psi)
        _refuse_bad_length("pitch", self.pitch)

    @property
    def period(self) -> float:
        """Axial length after which the layout repeats [m].

        A shift along z turns the threads of one hand forwards and those of the other backwards. Both sets
        first coincide with themselves when this turn leads from one pair to the next: after pitch/pairs.
        """
        return self.pitch / self._pairs

    @property
    def interval(self) -> float:
        """Half a period: each thread crosses one of the other hand on either side; see `Winding.interval`."""
        return 0.5 * self.period

    @property
    def mirror_symmetric(self) -> bool:
        """The mirror image is the layout at −ψ; a shift by half a period turns it by 180°/pairs."""
        return _is_multiple(self.psi, 0.5 * math.pi / self._pairs)

    @property
    def mirror_in_place(self) -> bool:
        """Threads at ψ and −ψ are the same ones if twice ψ leads from one pair to another."""
        return _is_multiple(self.psi, math.pi / self._pairs)

    def refuse_overlap(self, thread: Thread) -> None:
        """See `Winding.refuse_overlap`; threads of one hand follow each other every period."""
        smallest = self._pairs * thread.diameter
        _refuse_close("pitch", self.pitch, smallest, thread)

    def polylines(
        self, radius: float, length: float, points_per_turn: int, start: float = 0.0
    ) -> list[Float[np.ndarray, "_ 3"]]:
        """Return the threads; see `Winding.polylines`. A helix may end within a turn."""
        _refuse_coarse(points_per_turn)
        segments = max(1, round(points_per_turn * length / self.pitch))
        skipped = math.ceil(start * segments / length - _ROUND_OFF)
        z = np.linspace(0.0, length, segments + 1) + skipped * length / segments
        threads = []
        for first in self.psi + 2.0 * math.pi / self._pairs * np.arange(self._pairs):
            for hand in (+1.0, -1.0):
                azimuth = first + hand * 2.0 * math.pi * z / self.pitch
                threads.append(np.column_stack([radius * np.cos(azimuth), radius * np.sin(azimuth), z]))
        return threads


@dataclass(frozen=True)
class DoubleHelix(_CrossedHelices):
    """Two threads of opposite hand, θ±(z) = ψ ± 2πz/pitch.

    They cross at azimuth ψ (at heights 0, pitch, 2 pitch …) and ψ + 180° (half a pitch further).

    Parameters
    ----------
    psi : winding orientation ψ, from the centre of chamber 1 [rad].
    pitch : axial advance per turn [m].
    """

    name = "double-helix"
    _pairs = 1


@dataclass(frozen=True)
class SixHelix(_CrossedHelices):
    """Three double helices, 120° apart: θ±(z) = ψ + 120° k ± 2πz/pitch.

    Threads cross at azimuths ψ, ψ + 120° and ψ + 240° (at heights 0, pitch/3 …), and midway between them (a
    sixth of a pitch further), so that the layouts of ψ and ψ + 60° are the same but for that shift. The
    layout repeats after a third of the pitch.

    Parameters
    ----------
    psi : winding orientation ψ, from the centre of chamber 1 [rad].
    pitch : axial advance per turn of each thread [m].
    """

    name = "six-helix"
    _pairs = 3


@dataclass(frozen=True)
class Ring(Winding):
    """Closed rings, square to the rod.

    The first ring lies half a spacing above z = 0, the others follow every spacing up to z = length. A
    length of whole spacings has a ring in the middle of each.

    Parameters
    ----------
    spacing : axial distance from ring to ring [m]. The default is half the default pitch of the double
        helix, which needs about as much thread per length.
    """

    spacing: float = 0.5 * PITCH
    name = "ring"

    def __post_init__(self) -> None:
        _refuse_bad_length("spacing", self.spacing)

    @property
    def period(self) -> float:
        """Axial length after which the layout repeats: one spacing [m]."""
        return self.spacing

    @property
    def interval(self) -> float:
        """See `Winding.interval`."""
        return self.spacing

    @property
    def mirror_symmetric(self) -> bool:
        """A ring is its own mirror image in every plane through the axis."""
        return True

    @property
    def mirror_in_place(self) -> bool:
        """See `mirror_symmetric`."""
        return True

    def refuse_overlap(self, thread: Thread) -> None:
        """See `Winding.refuse_overlap`."""
        _refuse_close("spacing", self.spacing, thread.diameter, thread)

    def polylines(
        self, radius: float, length: float, points_per_turn: int, start: float = 0.0
    ) -> list[Float[np.ndarray, "_ 3"]]:
        """Return the rings; see `Winding.polylines`."""
        _refuse_coarse(points_per_turn)
        if self.spacing > length * (1.0 + _ROUND_OFF):
            raise ValueError(
                f"spacing: got {self.spacing * 1e3:g} mm, expected at most the length of {length * 1e3:g} mm"
            )
        azimuth = np.linspace(0.0, 2.0 * math.pi, points_per_turn + 1)
        circle = radius * np.column_stack([np.cos(azimuth), np.sin(azimuth)])
        circle[-1] = circle[0]
        end = start + length
        first = math.ceil(start / self.spacing - 0.5 - _ROUND_OFF)
        last = math.floor(end / self.spacing - 0.5 + _ROUND_OFF)
        heights = np.clip(self.spacing * (np.arange(first, last + 1) + 0.5), start, end)
        return [np.column_stack([circle, np.full(len(circle), z)]) for z in heights]


@dataclass(frozen=True)
class NoWinding(Winding):
    """No thread at all: the bare silicone body, which balloons at a few kPa."""

    name = "none"

    @property
    def period(self) -> float:
        """See `Winding.period`; every length is one."""
        return math.inf

    def cell_length(self, body_diameter: float) -> float:
        """Return a quarter of the diameter [m], about a pitch of a helix, as every length is a period."""
        return body_diameter / 4.0

    @property
    def interval(self) -> float:
        """See `Winding.interval`; there are no crossings."""
        return math.inf

    @property
    def mirror_symmetric(self) -> bool:
        """The section alone is symmetric."""
        return True

    @property
    def mirror_in_place(self) -> bool:
        """See `mirror_symmetric`."""
        return True

    def refuse_overlap(self, thread: Thread) -> None:
        """Nothing overlaps."""

    def polylines(
        self, radius: float, length: float, points_per_turn: int, start: float = 0.0
    ) -> list[Float[np.ndarray, "_ 3"]]:
        """Return an empty list."""
        return []


#: Names of all layouts.
LAYOUTS = (DoubleHelix.name, Ring.name, SixHelix.name, NoWinding.name)
#: Layouts that a turn from one chamber to the next takes to themselves.
ALIKE_LAYOUTS = (Ring.name, SixHelix.name, NoWinding.name)


def layout(name: str, psi: float = 0.0, pitch: float = PITCH, spacing: float | None = None) -> Winding:
    """Return the layout of that name.

    Parameters
    ----------
    name : one of `LAYOUTS`.
    psi : winding orientation of the helices [rad]. Rings, and no winding, have none.
    pitch : of the helices [m].
    spacing : of the rings [m]; by default half the pitch, which needs about the thread of a double helix.

    Raises
    ------
    ValueError
        For an unknown name, a spacing without rings, and what the layout itself refuses.
    """
    if name not in LAYOUTS:
        raise ValueError(f"layout: got {name!r}, expected one of {', '.join(LAYOUTS)}")
    if spacing is not None and name != Ring.name:
        raise ValueError(
            f"spacing: got {spacing * 1e3:g} mm for the layout {name}, expected it for rings only"
        )
    if name == Ring.name:
        _refuse_bad_length("pitch", pitch)
        return Ring(0.5 * pitch if spacing is None else spacing)
    if name == NoWinding.name:
        return NoWinding()
    return DoubleHelix(psi, pitch) if name == DoubleHelix.name else SixHelix(psi, pitch)


def _is_multiple(angle: float, step: float) -> bool:
    steps = angle / step
    return bool(abs(steps - round(steps)) < 1e-9)


def _refuse_bad_length(name: str, value: float) -> None:
    if not (math.isfinite(value) and value > 0.0):
        raise ValueError(f"{name}: got {value!r}, expected a positive finite length in metres")
    refuse_implausible(name, value)


def _refuse_close(name: str, value: float, smallest: float, thread: Thread) -> None:
    if value <= smallest:
        raise ValueError(
            f"{name}: got {value * 1e3:g} mm, expected more than {smallest * 1e3:g} mm: turns of a thread of "
            f"{thread.diameter * 1e3:g} mm overlap"
        )


def _refuse_coarse(points_per_turn: int) -> None:
    if points_per_turn < 3:
        raise ValueError(f"points_per_turn: got {points_per_turn}, expected at least 3")
