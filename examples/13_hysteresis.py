"""Hysteresis of chamber 2: its pressure up to 70 kPa and down again, along both branches of the rod.

Run as ``python examples/13_hysteresis.py [PICTURE]``. Lines are the rod, dashed where no branch is
calibrated: there each law goes on past its own pressures. Squares are the full actuator on the way up, open
once a wall has snapped. Diamonds are the mirror image of its run in chamber 3, which snaps later and to the
other side.
"""

import math
import sys
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
from figures.fem_points import Points, actuator_points
from figures.panels import ACTUATOR, EDGE, IMAGES, OPEN, save
from matplotlib.axes import Axes
from matplotlib.figure import Figure

import rodmodel
from rodmodel.view import changes_side, cycle_record, draw_cycle

TOP_KPA, STEPS = 70.0, 140
LAYOUT = rodmodel.Layout("double-helix", 0.0, 3e-3)
# Normal of chamber 2's plane, and the mirror image y → −y that takes chamber 3 to chamber 2.
ACROSS = np.array([-math.sin(2.0 * math.pi / 3.0), math.cos(2.0 * math.pi / 3.0), 0.0])
MIRROR = np.array([1.0, -1.0, 1.0])


def main(picture: Path) -> None:
    """Draw angle and lean of the cycle, and say where it jumps."""
    branches = rodmodel.load_branches(LAYOUT.name, LAYOUT.psi, LAYOUT.pitch)
    record = cycle(branches)
    tell(record)
    bend = np.array([state["bending_angle_deg"] for state in record["states"]], float)
    tip = np.array([state["tip_position_mm"] for state in record["states"]], float)
    second, third = (actuator_points(LAYOUT, way) for way in ((0.0, 1.0, 0.0), (0.0, 0.0, 1.0)))
    figure = Figure(figsize=(10.0, 5.0), layout="constrained")
    angle, lean = figure.subplots(1, 2)
    draw_cycle(angle, record, bend)
    draw_cycle(lean, record, tip @ ACROSS)
    draw_other_side(angle, lean, branches)
    draw_runs(angle, second, second.angle, third, third.angle)
    draw_runs(lean, second, second.tip @ ACROSS, third, (MIRROR * third.tip) @ ACROSS)
    angle.set_ylabel("bending angle [deg]")
    lean.set_ylabel("tip out of the chamber's plane [mm]")
    for panel in (angle, lean):
        panel.set_xlabel("pressure of chamber 2 [kPa]")
    figure.legend(
        *angle.get_legend_handles_labels(), loc="outside lower center", ncols=4, fontsize=8, frameon=False
    )
    save(figure, picture)


def cycle(branches: rodmodel.Branches) -> dict[str, Any]:
    """Pressure up from rest and down again, each state from the branch before it."""
    shares = np.concatenate([np.arange(STEPS + 1), np.arange(STEPS)[::-1]]) / STEPS
    pressure = 1e3 * TOP_KPA * shares[:, None] * [0.0, 1.0, 0.0]
    found, before = [], rodmodel.Branch()
    for row in pressure:
        found.append(branches.solve(row, before, throw=False))
        before = found[-1].branch
    return cycle_record(pressure, found)


def tell(record: dict[str, Any]) -> None:
    """The cycle's stretches on one branch or none, up and down, with the bends at their ends."""
    states = record["states"]
    where = [(n > STEPS, state["branch"] or "not calibrated") for n, state in enumerate(states)]
    starts = [n for n in range(len(states)) if n == 0 or where[n] != where[n - 1]]
    for first, after in pairwise([*starts, len(states)]):
        (low, high), (least, most) = (
            [states[n][key] for n in (first, after - 1)] for key in ("pressure_kpa", "bending_angle_deg")
        )
        down, name = where[first]
        print(
            f"{'down' if down else 'up':4s} {name:14s} {low[1]:5.1f} to {high[1]:5.1f} kPa, "
            f"{least:6.2f} to {most:6.2f} deg"
        )


def draw_other_side(angle: Axes, lean: Axes, branches: rodmodel.Branches) -> None:
    """Draw the branch to the side that the cycle does not take."""
    rod = branches.rod(rodmodel.Branch(2, -1))
    least, most = rod.domain.pressure_min[1], rod.domain.pressure_max[1]
    pressure = np.linspace(least, most, STEPS + 1)[:, None] * [0.0, 1.0, 0.0]
    found = rod.solve_many(pressure=pressure)
    bend = np.degrees(found["bending_angle"])
    bend[changes_side(np.degrees(found["bending_plane"]))] = np.nan
    for panel, values in (
        (angle, bend),
        (lean, 1e3 * found["tip_position"] @ ACROSS),
    ):
        panel.plot(1e-3 * pressure[:, 1], values, color="#009e73", lw=1.5, label="snapped to the other side")


def draw_runs(
    panel: Axes, second: Points, of_second: np.ndarray, third: Points, of_third: np.ndarray
) -> None:
    """Mark the two runs of the full actuator."""
    for points, values, marker, name in (
        (second, of_second, "s", "full actuator"),
        (third, of_third, "D", "its mirror image, chamber 3"),
    ):
        style = ACTUATOR | {"marker": marker, "color": "0.2"}
        upright = ~points.snapped
        panel.plot(points.pressure[upright], values[upright], label=name, **style, **EDGE)
        panel.plot(points.pressure[~upright], values[~upright], label=f"{name}, snapped", **style, **OPEN)


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else IMAGES / "hysteresis.png")
