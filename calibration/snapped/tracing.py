"""Continuation of the cell on a snapped sheet."""

from dataclasses import dataclass

from calibration.snapped.sheet import SnappedSheet
from calibration.sweep import CellTracer, Trace
from fem_reference import CellError, CellState, PeriodCell, follow

# A section leans to a side if its bending plane is this far from the upright one's [rad].
LEANING = 0.05
# Steps of the way onto the sheet: some 3 kPa each.
STEPS = 24
# Moment that leads to the side, over the largest moment of the sweep.
PUSH = 0.1


@dataclass(frozen=True)
class SnappedTracer:
    """Picklable factory of a continuation that begins on a snapped sheet, and ends where it does.

    Parameters
    ----------
    cell : factory of the cell.
    sheet : sheet.
    pressure : pressure of the chamber at which the sheet is reached [Pa].
    moment_max : largest bending moment of the sweep [N m].
    """

    cell: CellTracer
    sheet: SnappedSheet
    pressure: float
    moment_max: float

    def __call__(self) -> Trace:
        """Build the cell, lead it onto the sheet, and return its continuation from there.

        Raises
        ------
        CellError
            If the section stands upright at that pressure, or leans to the other side.
        """
        cell = PeriodCell.of(self.cell.actuator, self.cell.level, self.cell.end_compliance)
        begin = snapped_state(
            lambda loads, start: follow(cell, loads, start=start), self.sheet, self.pressure, self.moment_max
        )
        return lambda loads, start: follow(cell, loads, start=start or begin, jumps=False)


def snapped_state(trace: Trace, sheet: SnappedSheet, pressure: float, moment_max: float) -> CellState:
    """Return the state on a sheet under the pressure of its chamber alone.

    Parameters
    ----------
    trace : continuation of the cell, which may jump.
    sheet, pressure, moment_max : see `SnappedTracer`.

    Raises
    ------
    CellError
        See `SnappedTracer`.
    """
    *_, state = trace(sheet.approach(pressure, PUSH * moment_max, STEPS), None)
    aside = sheet.aside(state.curvature)
    if aside < LEANING or state.stable is False:
        raise CellError(
            f"the section does not lean to side {sheet.side:+d} under {pressure:g} Pa in chamber "
            f"{sheet.chamber}: its bending plane is {aside:.3g} rad aside, expected {LEANING} or more",
            state,
        )
    return state
