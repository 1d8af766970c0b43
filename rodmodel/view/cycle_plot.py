"""Picture of a cycle of pressures: bending angle and plane, up and down, with jumps."""

from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from rodmodel.io import atomic_part

_UP, _DOWN = "#0072b2", "#d55e00"


def plot_cycle(record: dict[str, Any], file: str | Path) -> None:
    """Draw a cycle's record; the suffix of the file selects the format.

    Parameters
    ----------
    record : from `rodmodel.view.cycle_record`.
    file : path of the picture.
    """
    states = record["states"]
    pressure = np.array([max(state["pressure_kpa"]) for state in states])
    top = int(np.argmax(pressure))
    outside = np.array([not state["in_domain"] for state in states])
    figure = Figure(figsize=(9.0, 4.0), layout="constrained")
    for axes, key, name in zip(
        figure.subplots(1, 2),
        ("bending_angle_deg", "bending_plane_deg"),
        ("bending angle [deg]", "bending plane [deg]"),
        strict=True,
    ):
        value = np.array([np.nan if state[key] is None else state[key] for state in states])
        if key == "bending_plane_deg":
            # A plane near 0 may be told as one near 360.
            known = np.isfinite(value)
            value[known] = np.unwrap(value[known], period=360.0)
        for part, colour, label in ((slice(0, top + 1), _UP, "up"), (slice(top, None), _DOWN, "down")):
            axes.plot(pressure[part], value[part], color=colour, label=label, marker=".", markersize=4)
        axes.plot(pressure[outside], value[outside], ls="none", marker="o", mfc="white", color="0.4", ms=5)
        axes.set_xlabel("largest pressure [kPa]")
        axes.set_ylabel(name)
        axes.grid(alpha=0.3)
    if outside.any():
        figure.axes[0].plot([], [], "o", mfc="white", color="0.4", ms=5, label="outside the calibration")
    figure.axes[0].legend(frameon=False)
    with atomic_part(file) as written:
        figure.savefig(written, dpi=150, format=Path(file).suffix[1:])
