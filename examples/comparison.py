"""What the figures share: finite-element points, the rod's curve, and its error underneath."""

import json
import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

import rodmodel

POINTS = Path(__file__).parent / "data" / "cell_points.json"
IMAGES = Path(__file__).parents[1] / "docs" / "images"
COLOURS = ("#0072b2", "#e69f00", "#009e73")


@dataclass(frozen=True)
class Series:
    """Points of the cell and the rod under the same pressures: pressures in kPa, angles in degrees.

    The rod's are not a number outside its domain, or where there is no calibration. `turned` : how far the
    plane of the points is turned to that of the chambers that they stand for [deg].
    """

    label: str
    pressure: np.ndarray
    angle: np.ndarray
    plane: np.ndarray
    jumped: np.ndarray
    rod_angle: np.ndarray
    rod_plane: np.ndarray
    curve_pressure: np.ndarray
    curve_angle: np.ndarray
    curve_plane: np.ndarray

    @property
    def error(self) -> np.ndarray:
        """Of the rod's angle, before the cell jumps [deg]."""
        before = np.cumsum(self.jumped) == 0
        return np.where(before, self.rod_angle - self.angle, np.nan)


def series(
    name: str,
    label: str,
    rod: rodmodel.Rod | None,
    chambers: Sequence[float],
    turned_deg: float = 0.0,
    mirrored: bool = False,
) -> Series:
    """Points of a path of the cell beside a rod.

    Parameters
    ----------
    name : of the path in the file of points.
    label : of the series.
    rod : of the winding; None where no calibration ships.
    chambers : shares of the pressure in each chamber of the rod.
    turned_deg, mirrored : where the path is another chamber's: its plane is turned, after a mirror.
    """
    held = json.loads(POINTS.read_text())[name]
    pressure = np.array(held["pressure_kpa"])
    plane = np.array(held["plane_deg"])
    plane = ((-plane if mirrored else plane) + turned_deg) % 360.0
    fine = np.linspace(0.5, pressure.max(), 100)
    way = np.array(chambers)
    nothing = (np.full(len(pressure), np.nan),) * 2, (np.full(len(fine), np.nan),) * 2
    (at, at_plane), (along, along_plane) = (
        nothing if rod is None else (_bends(rod, way, pressure), _bends(rod, way, fine))
    )
    jumped = np.array(held["jumped"], dtype=bool)
    return Series(
        label, pressure, np.array(held["angle_deg"]), plane, jumped, at, at_plane, fine, along, along_plane
    )


def rod_of(layout: str, psi_deg: float = 0.0, pitch_mm: float = 3.0) -> rodmodel.Rod | None:
    """The shipped rod of a winding, or None."""
    try:
        return rodmodel.load(layout, math.radians(psi_deg), 1e-3 * pitch_mm)
    except rodmodel.CalibrationNotFoundError:
        return None


def _bends(rod: rodmodel.Rod, way: np.ndarray, kpa: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """θ and γ [deg] of 60 mm of section, as the points are; not a number outside the domain."""
    length = rod.actuator.body_length

    def bend(pressure: jax.Array) -> jax.Array:
        curvature = length * rod.section.free_curvature(pressure)
        return jnp.where(rod.domain.covers_pressure(pressure), curvature, jnp.nan)

    u = np.asarray(jax.jit(jax.vmap(bend))(jnp.asarray(1e3 * kpa[:, None] * way)))
    angle, plane = np.hypot(u[:, 0], u[:, 1]), np.arctan2(u[:, 0], -u[:, 1])
    return np.degrees(angle), np.degrees(plane) % 360.0


def draw_angles(panels: tuple[Axes, Axes], drawn: Sequence[Series], title: str) -> None:
    """Angle against pressure, and the rod's error underneath."""
    above, below = panels
    for colour, one in zip(COLOURS, drawn, strict=False):
        after = np.cumsum(one.jumped) > 0
        above.plot(one.curve_pressure, one.curve_angle, color=colour, lw=1.5, label=one.label)
        above.plot(one.pressure[~after], one.angle[~after], "o", color=colour, ms=4)
        above.plot(one.pressure[after], one.angle[after], "o", color=colour, ms=4, mfc="none")
        below.plot(one.pressure, one.error, "o-", color=colour, ms=3, lw=0.8)
    above.set_title(title, fontsize=10)
    above.grid(alpha=0.3)
    below.axhline(0.0, color="0.5", lw=0.8)
    below.grid(alpha=0.3)
    below.set_xlabel("pressure [kPa]")


def angle_figure(columns: int) -> tuple[Figure, list[tuple[Axes, Axes]]]:
    """Columns of two panels: angle, and error."""
    figure = Figure(figsize=(2.6 * columns + 1.2, 5.0), layout="constrained")
    axes = figure.subplots(2, columns, sharex=True, sharey="row", height_ratios=(3, 1), squeeze=False)
    axes[0, 0].set_ylabel("bending angle of 60 mm [deg]")
    axes[1, 0].set_ylabel("rod − FEM [deg]")
    return figure, [(axes[0, k], axes[1, k]) for k in range(columns)]


def save(figure: Figure, file: Path) -> None:
    """Write a figure and say so."""
    file.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(file, dpi=130)
    print(f"wrote {file}")


def print_table(drawn: Sequence[Series], at_kpa: Sequence[float]) -> None:
    """Angle of the cell, and the rod's less the cell's in brackets, at some pressures."""
    print(f"{'angle of the FEM (rod − FEM) [deg]':36s}" + "".join(f"{p:>11g} kPa" for p in at_kpa))
    for one in drawn:
        cells = []
        for p in at_kpa:
            row = np.flatnonzero(np.isclose(one.pressure, p))
            if not row.size:
                cells.append(f"{'':>15s}")
                continue
            k = row[0]
            mark = "*" if one.jumped[: k + 1].any() else " "
            off = "" if np.isnan(one.error[k]) else f"({one.error[k]:+.2f})"
            cells.append(f"{one.angle[k]:7.2f}{mark}{off:>7s}")
        print(f"{one.label:36s}" + "".join(cells))
    print("* walls have snapped on the way; no error where the rod's domain has ended")
