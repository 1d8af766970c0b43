"""Loads of the full actuator: `ActuatorLoad` in SI units, `ActuatorTarget` in the body's own `Units`."""

import math
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from fem_reference.geometry import SI, Units, as_pressure, as_triple, as_vector, refuse_implausible

# Changes of load that strain the actuator about equally: 1 kPa, 2 mN, 0.05 N mm and 2 m/s².
_UNITS = (1e-3, 2e-3, 0.05, 2e3)


@dataclass(frozen=True)
class ActuatorTarget:
    """Loads in N, mm and MPa.

    Parameters
    ----------
    pressure : of the chambers [MPa].
    tip_force, tip_moment : on the cap's outer face [N, N mm].
    gravity : acceleration [mm/s²].
    follower : whether force and moment turn with the cap.
    """

    pressure: Float[np.ndarray, "3"]
    tip_force: Float[np.ndarray, "3"]
    tip_moment: Float[np.ndarray, "3"]
    gravity: Float[np.ndarray, "3"]
    follower: bool

    def _vectors(self) -> tuple[np.ndarray, ...]:
        return self.pressure, self.tip_force, self.tip_moment, self.gravity

    def between(self, other: "ActuatorTarget", fraction: float) -> "ActuatorTarget":
        """The target a fraction of the way from this one to ``other``."""
        mixed = [a + fraction * (b - a) for a, b in zip(self._vectors(), other._vectors(), strict=True)]
        pressure, tip_force, tip_moment, gravity = mixed
        return ActuatorTarget(pressure, tip_force, tip_moment, gravity, other.follower)

    def differs_by_pressure(self, other: "ActuatorTarget") -> bool:
        """Whether the loads differ by their pressures alone."""
        pairs = zip(self._vectors()[1:], other._vectors()[1:], strict=True)
        return self.follower == other.follower and all(bool((a == b).all()) for a, b in pairs)

    def to(self, other: "ActuatorTarget") -> Float[np.ndarray, " loads"]:
        """Change of load in units that strain the actuator about equally."""
        pairs = zip(self._vectors(), other._vectors(), _UNITS, strict=True)
        return np.concatenate([(b - a) / unit for a, b, unit in pairs])


@dataclass(frozen=True)
class ActuatorLoad:
    """Load of the actuator.

    Parameters
    ----------
    pressure : gauge pressure of each chamber, not negative [Pa].
    tip_force, tip_moment : on the cap's outer face, at its centre [N, N m], world frame at rest.
    gravity : acceleration, world frame [m/s²].
    follower : whether tip force and moment turn with the cap, instead of keeping their direction.

    Raises
    ------
    ValueError
        For anything but three finite numbers each, a negative pressure, and a gravity in another unit.
    """

    pressure: tuple[float, float, float] = (0.0, 0.0, 0.0)
    tip_force: tuple[float, float, float] = (0.0, 0.0, 0.0)
    tip_moment: tuple[float, float, float] = (0.0, 0.0, 0.0)
    gravity: tuple[float, float, float] = (0.0, 0.0, 0.0)
    follower: bool = False

    def __post_init__(self) -> None:
        as_pressure(self.pressure)
        for name, unit in (("tip_force", "N"), ("tip_moment", "N m"), ("gravity", "m/s²")):
            as_vector(name, getattr(self, name), unit)
        refuse_implausible("gravity", math.hypot(*self.gravity))

    @property
    def in_plane(self) -> bool:
        """Whether the load is its own mirror image in the plane y = 0."""
        _, second, third = self.pressure
        across = (self.tip_force[1], self.gravity[1], self.tip_moment[0], self.tip_moment[2])
        return second == third and not any(across)

    def target(self, units: Units = SI) -> ActuatorTarget:
        """The load in a body's units."""
        return ActuatorTarget(
            pressure=np.asarray(self.pressure, float) / units.megapascal,
            tip_force=np.asarray(self.tip_force, float) / units.newton,
            tip_moment=np.asarray(self.tip_moment, float) * units.metre / units.newton,
            gravity=np.asarray(self.gravity, float) * units.acceleration,
            follower=self.follower,
        )

    @classmethod
    def of(cls, target: ActuatorTarget, units: Units) -> "ActuatorLoad":
        """Return the load of a target in a body's units."""
        return cls(
            as_triple(target.pressure * units.megapascal),
            as_triple(target.tip_force * units.newton),
            as_triple(target.tip_moment * units.newton / units.metre),
            as_triple(target.gravity / units.acceleration),
            target.follower,
        )
