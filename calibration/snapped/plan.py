"""Plan of a sweep over a snapped sheet."""

from dataclasses import dataclass, field
from typing import Any

from calibration.snapped.paths import snapped_paths
from calibration.snapped.sheet import SnappedSheet
from calibration.snapped.tracing import SnappedTracer
from calibration.sweep import CellTracer, LoadingPath, RunPlan
from rodmodel import Domain

# Pressure step between loads of a path over the range of the chamber's pressure.
STEP = 0.2


@dataclass(frozen=True)
class SnappedPlan(RunPlan):
    """A run plan whose paths begin on a sheet, at the largest pressure of its chamber.

    The domain has the chamber's least pressure, and the largest of the two others.
    """

    sheet: SnappedSheet = field(kw_only=True)

    def design(self) -> tuple[LoadingPath, ...]:
        """Return the paths in the order in which to run them."""
        own = self.sheet.chamber - 1
        least, most = self.domain.pressure_min[own], self.domain.pressure_max[own]
        return snapped_paths(
            self.sheet,
            (least, most),
            self.domain.pressure_max[own - 1],
            self.domain.moment_axes,
            self.paths,
            self.seed,
            STEP * (most - least),
        )

    def tracer(self) -> SnappedTracer:
        """Return the factory of the continuation."""
        cell = CellTracer(self.actuator, self.level, self.end_compliance)
        most = self.domain.pressure_max[self.sheet.chamber - 1]
        return SnappedTracer(cell, self.sheet, most, self.domain.moment_max)

    def description(self) -> dict[str, Any]:
        """Return the plan for JSON."""
        sheet = {"chamber": self.sheet.chamber, "side": self.sheet.side}
        return {**super().description(), "snapped": sheet}


def sheet_domain(
    sheet: SnappedSheet, pressure: tuple[float, float], beside: float, moment: float, torque: float
) -> Domain:
    """Return the domain of a sheet.

    Parameters
    ----------
    sheet : sheet.
    pressure : least and largest pressure of its chamber [Pa].
    beside : largest pressure of each of the two others [Pa].
    moment, torque : largest bending moment and torque [N m].
    """
    least, most = pressure
    return Domain(
        pressure_max=sheet.pressure(most, beside, beside),
        pressure_sum_max=most + 2.0 * beside,
        moment_max=moment,
        torque_max=torque,
        pressure_min=sheet.pressure(least),
    )
