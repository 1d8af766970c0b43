"""Figures of a calibration's report, as PNG in memory."""

import io
from collections.abc import Sequence

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from calibration.from_design.judge_stage import RodErrors
from calibration.from_design.pressure_range import ANGLE, GIVEN, SOLVER, STABILITY, STRETCH, PathEnd
from calibration.report import DOTS_PER_INCH
from rodmodel import ErrorBound

_KPA = 1e-3
_WORDS = {
    ANGLE: "the wanted angle",
    STABILITY: "loss of stability",
    STRETCH: "the tested stretch",
    SOLVER: "the solver",
    GIVEN: "the design's pressure",
}


def png(figure: Figure) -> bytes:
    """Return a figure as PNG, and close it."""
    content = io.BytesIO()
    figure.set_dpi(DOTS_PER_INCH)
    FigureCanvasAgg(figure).print_png(content)
    plt.close(figure)
    return content.getvalue()


def range_figure(ends: Sequence[PathEnd]) -> Figure:
    """Plot the cell's angle over the pressure of one chamber and of two, with the end of each path."""
    figure, axis = plt.subplots(figsize=(7, 4.2), layout="constrained")
    for number, end in enumerate(ends):
        pressure = [0.0, *(_KPA * p for p in end.pressures)]
        angle = [0.0, *np.rad2deg(end.angles)]
        dashes = "-" if len(end.chambers) == 1 else "--"
        axis.plot(
            pressure, angle, f"C{number}", ls=dashes, marker=".", label=f"{end.title}: {_WORDS[end.reason]}"
        )
        axis.plot(_KPA * end.pressure, np.rad2deg(end.angle), f"C{number}o", ms=8, mfc="none")
    axis.set(xlabel="pressure of each chamber [kPa]", ylabel="bending angle over the body's length [deg]")
    axis.legend(title="ends at the ring", fontsize="small")
    return figure


def rod_figure(errors: RodErrors, bound: ErrorBound | None) -> Figure:
    """Plot the angles of rod and full actuator over the largest pressure, and the rod's errors.

    Errors are those of judged states, with what the sweep's mesh adds; crosses are the bound there.
    """
    figure, (angles, off) = plt.subplots(1, 2, figsize=(11, 4.4), layout="constrained")
    for number, case in enumerate(dict.fromkeys(errors.case)):
        rows = errors.case == case
        pressure = _KPA * errors.pressure[rows].max(axis=1)
        angles.plot(pressure, np.rad2deg(errors.angle[rows]), f"C{number}o", ms=5, label=case)
        angles.plot(pressure, np.rad2deg(errors.rod_angle[rows]), f"C{number}-", lw=1)
        rows = rows & errors.judged
        style = "o" if (errors.role[rows] == "judge").any() else "."
        off.plot(np.rad2deg(errors.angle[rows]), np.rad2deg(errors.angle_off[rows]), f"C{number}{style}")
    rows = errors.of("judge")
    if bound is not None and rows.any():
        stated, _ = bound.at(
            errors.pressure[rows].sum(axis=1),
            errors.base_moment[rows],
            bending_angle=errors.rod_angle[rows],
        )
        off.plot(np.rad2deg(errors.angle[rows]), np.rad2deg(np.asarray(stated)), "kx", label="stated bound")
    off.plot([], [], "o", color="0.5", label="runs that judge")
    off.plot([], [], ".", color="0.5", label="runs for the ends")
    off.legend()
    angles.set(xlabel="largest pressure [kPa]", ylabel="bending angle [deg]")
    angles.legend(title="dots: actuator, lines: rod", fontsize="small")
    off.set(xlabel="bending angle of the full actuator [deg]", ylabel="bending angle, off by [deg]")
    return figure
