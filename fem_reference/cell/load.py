"""Load of the period cell: pressures with a moment or a curvature, in SI units and in the body's."""

from dataclasses import dataclass

import numpy as np

from fem_reference.cell.problem import CellTarget
from fem_reference.geometry import Units, as_pressure, as_triple, as_vector


@dataclass(frozen=True)
class Load:
    """Load of the cell: pressures with either an external moment or an imposed curvature.

    Parameters
    ----------
    pressure : gauge pressure of each chamber, not negative [Pa].
    moment : external moment in the body frame [N m]; zero (free bending) by default.
    curvature : imposed curvature and twist u in the body frame [1/m], instead of a moment.

    Raises
    ------
    ValueError
        For anything but three finite numbers each, a negative pressure, or both a moment and a curvature.
    """

    pressure: tuple[float, float, float]
    moment: tuple[float, float, float] | None = None
    curvature: tuple[float, float, float] | None = None

    def __post_init__(self) -> None:
        as_pressure(self.pressure)
        if self.moment is not None and self.curvature is not None:
            raise ValueError("moment and curvature: got both, expected at most one of them")
        for name, unit in (("moment", "N m"), ("curvature", "1/m")):
            if getattr(self, name) is not None:
                as_vector(name, getattr(self, name), unit)

    @property
    def in_plane(self) -> bool:
        """Whether the load is its own mirror image in the plane y = 0."""
        bend = self.curvature or self.moment or (0.0, 0.0, 0.0)
        return self.pressure[1] == self.pressure[2] and bend[0] == bend[2] == 0.0

    def target(self, units: Units) -> CellTarget:
        """Return the load in the body's units."""
        pressure = np.asarray(self.pressure, float) / units.megapascal
        if self.curvature is not None:
            return CellTarget(pressure, curvature=np.asarray(self.curvature, float) / units.metre)
        given = (0.0, 0.0, 0.0) if self.moment is None else self.moment
        return CellTarget(pressure, moment=np.asarray(given, float) * units.metre / units.newton)


def load_of(target: CellTarget, units: Units) -> Load:
    """Return the load of a target in the body's units."""
    pressure = as_triple(target.pressure * units.megapascal)
    if target.curvature is not None:
        return Load(pressure, curvature=as_triple(target.curvature * units.metre))
    if target.moment is None:
        return Load(pressure)
    return Load(pressure, moment=as_triple(target.moment * units.newton / units.metre))
