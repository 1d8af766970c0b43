"""Picture of a cycle of pressures: bending angle and plane, up and down, with jumps."""

from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Bool, Float
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from rodmodel.io import atomic_part

# Where both are the same, the way down lies on the way up.
_UP: dict[str, Any] = {"color": "#56b4e9", "lw": 3.5}
_DOWN: dict[str, Any] = {"color": "#d55e00", "lw": 1.5}
_BEYOND: dict[str, Any] = {"ls": "--", "lw": 1.2}


def plot_cycle(record: dict[str, Any], file: str | Path) -> None:
    """Draw a cycle's record; the suffix of the file selects the format.

    Parameters
    ----------
    record : from `rodmodel.view.cycle_record`.
    file : path of the picture.
    """
    figure = Figure(figsize=(9.0, 4.0), layout="constrained")
    for axes, key, name in zip(
        figure.subplots(1, 2),
        ("bending_angle_deg", "bending_plane_deg"),
        ("bending angle [deg]", "bending plane [deg]"),
        strict=True,
    ):
        value = np.array([state[key] for state in record["states"]], float)
        if key == "bending_plane_deg":
            # A plane near 0 may be told as one near 360.
            known = np.isfinite(value)
            value[known] = np.unwrap(value[known], period=360.0)
        draw_cycle(axes, record, value)
        axes.set_ylabel(name)
    figure.axes[0].legend(frameon=False)
    with atomic_part(file) as written:
        figure.savefig(written, dpi=150, format=Path(file).suffix[1:])


def draw_cycle(axes: Axes, record: dict[str, Any], value: np.ndarray) -> None:
    """Draw a quantity of a cycle's states against their pressures.

    It is solid up and down inside the calibration, and dashed where no branch is calibrated.

    Parameters
    ----------
    axes : where to draw; a legend may follow.
    record : from `rodmodel.view.cycle_record`.
    value : quantity of each of the record's states; not a number where there is none.
    """
    states = record["states"]
    pressure = np.array([max(state["pressure_kpa"]) for state in states])
    inside = np.array([state["in_domain"] for state in states])
    # A jump to another branch is drawn; that of a plane on one branch is none of the tip.
    branch = [state["branch"] for state in states]
    stays = np.array([True, *(one == other for one, other in pairwise(branch))])
    turned = changes_side(np.array([state["bending_plane_deg"] for state in states], float)) & stays
    value = np.where(turned & inside, np.nan, value)
    top = int(np.argmax(pressure))
    # Dashed lines go to the calibrated states on either side.
    beyond = np.convolve(~inside, [True, True, True], "same")
    for part, style, label in ((slice(0, top + 1), _UP, "up"), (slice(top, None), _DOWN, "down")):
        axes.plot(pressure[part], np.where(inside, value, np.nan)[part], label=label, **style)
        axes.plot(pressure[part], np.where(beyond, value, np.nan)[part], **(style | _BEYOND))
    if not inside.all():
        axes.plot([], [], color="0.4", label="outside the calibration", **_BEYOND)
    axes.set_xlabel("largest pressure [kPa]")
    axes.grid(alpha=0.3)


def changes_side(plane: Float[np.ndarray, " n"]) -> Bool[np.ndarray, " n"]:
    """Return where the bending plane of successive states changes sides.

    A rod that is not planar passes half a turn beside the vertical: θ there goes on at 360° less itself, and
    a curve of it wants a gap.

    Parameters
    ----------
    plane : γ [deg]; not a number where there is none.
    """
    turn = np.abs(np.remainder(np.diff(plane, prepend=plane[:1]) + 180.0, 360.0) - 180.0)
    return np.asarray(turn > 90.0)
