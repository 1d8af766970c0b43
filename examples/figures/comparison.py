"""The rod beside finite elements under rising pressures, for the figures and their tables.

Like stands beside like. The cell has no ends, so 60 mm of the rod's section are compared with it. The full
actuator has ends, and is compared with the whole rod, whose curves are drawn.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import jax
import jax.numpy as jnp
import numpy as np

import rodmodel
from figures.fem_points import Points, actuator_points, cell_points
from rodmodel.view import changes_side

# Steps of a curve over its branch's pressures.
_STEPS = 280


@dataclass(frozen=True)
class Winding:
    """A layout, and its rods where a calibration ships: differentiable, and compiled on all branches."""

    layout: rodmodel.Layout
    rod: rodmodel.Rod | None
    branches: rodmodel.Branches | None


@dataclass(frozen=True)
class Curve:
    """The whole rod on one branch: pressures in kPa, angle and plane in degrees."""

    pressure: np.ndarray
    angle: np.ndarray
    plane: np.ndarray
    snapped: bool


@dataclass(frozen=True)
class Series:
    """One chamber or pair: points of cell and full actuator, the rod's curves, and its errors [deg].

    Errors are not a number after a snap, outside the rod's domain, and where there is no calibration.
    """

    label: str
    cell: Points
    cell_error: np.ndarray
    actuator: Points
    actuator_error: np.ndarray
    curves: tuple[Curve, ...]


def winding(name: str, psi_deg: float = 0.0, pitch_mm: float = 3.0) -> Winding:
    """Return a layout with the rods that ship for it."""
    layout = rodmodel.Layout(name, math.radians(psi_deg), 1e-3 * pitch_mm)
    try:
        return Winding(
            layout,
            rodmodel.load(name, layout.psi, layout.pitch),
            rodmodel.load_branches(name, layout.psi, layout.pitch),
        )
    except rodmodel.CalibrationNotFoundError:
        return Winding(layout, None, None)


def series(
    points: str,
    label: str,
    wound: Winding,
    chambers: Sequence[float],
    turned_deg: float = 0.0,
    mirrored: bool = False,
) -> Series:
    """Return a path of finite elements beside the rod.

    Parameters
    ----------
    points, turned_deg, mirrored : see `cell_points`.
    label : of the series.
    wound : winding of the rod and of the full actuator.
    chambers : shares of the largest pressure in each chamber.
    """
    way = np.array(chambers)
    cell, actuator = cell_points(points, turned_deg, mirrored), actuator_points(wound.layout, chambers)
    of_cell, of_actuator = np.full(cell.angle.shape, np.nan), np.full(actuator.angle.shape, np.nan)
    curves: list[Curve] = []
    if wound.rod is not None and wound.branches is not None:
        of_cell = _section_angle(wound.rod, way, cell.pressure)
        of_actuator = _rod_angle(wound.branches.loading, way, actuator.pressure)
        named = {rodmodel.Branch(): wound.branches.loading, **wound.branches.snapped}
        curves = [_curve(rod, way, bool(branch.chamber)) for branch, rod in named.items()]
    return Series(
        label,
        cell,
        np.where(cell.snapped, np.nan, of_cell - cell.angle),
        actuator,
        np.where(actuator.snapped, np.nan, of_actuator - actuator.angle),
        tuple(curve for curve in curves if curve.pressure.size),
    )


def _section_angle(rod: rodmodel.Rod, way: np.ndarray, kpa: np.ndarray) -> np.ndarray:
    """Angle [deg] of 60 mm of section; not a number outside the domain."""

    def bend(pressure: jax.Array) -> jax.Array:
        curvature = rod.actuator.body_length * rod.section.free_curvature(pressure)
        return jnp.where(rod.domain.covers_pressure(pressure), jnp.hypot(*curvature[:2]), jnp.nan)

    return np.degrees(jax.jit(jax.vmap(bend))(jnp.asarray(1e3 * kpa[:, None] * way)))


def _rod_angle(rod: rodmodel.CoreRod, way: np.ndarray, kpa: np.ndarray) -> np.ndarray:
    """Angle [deg] of the whole rod; not a number outside the domain."""
    found = rod.solve_many(pressure=1e3 * kpa[:, None] * way)
    return np.where(found["in_domain"] != 0, np.degrees(found["bending_angle"]), np.nan)


def _curve(rod: rodmodel.CoreRod, way: np.ndarray, snapped: bool) -> Curve:
    """The rod over all of its domain in the direction of the pressures."""
    pressure = np.linspace(0.0, 1.0, _STEPS + 1)[1:, None] * rod.domain.reach(way) * way
    pressure = pressure[rod.domain.covers_pressure(pressure.T)]
    found = rod.solve_many(pressure=pressure)
    angle, plane = np.degrees(found["bending_angle"]), np.degrees(found["bending_plane"])
    turned = changes_side(plane)
    angle[turned] = plane[turned] = np.nan
    return Curve(1e-3 * pressure.max(axis=1), angle, plane, snapped)


def print_table(drawn: Sequence[Series], at_kpa: Sequence[float]) -> None:
    """Angles of finite elements, and in brackets the rod's less theirs, at some pressures."""
    cells = [(one.label, one.cell, one.cell_error) for one in drawn]
    runs = [(one.label, one.actuator, one.actuator_error) for one in drawn if one.actuator.angle.size]
    _print_rows("angle of the FEM (rod − FEM) [deg]", cells, at_kpa, "()")
    if runs:
        _print_rows("full actuator [rod − actuator] [deg]", runs, at_kpa, "[]")
    print("* walls have snapped on the way; no error where the rod's domain has ended")


def _print_rows(
    head: str, rows: Sequence[tuple[str, Points, np.ndarray]], at_kpa: Sequence[float], brackets: str
) -> None:
    print(f"{head:36s}" + "".join(f"{p:>11g} kPa" for p in at_kpa))
    before, after = brackets
    for label, points, error in rows:
        cells = []
        for p in at_kpa:
            row = np.flatnonzero(np.isclose(points.pressure, p))
            if not row.size:
                cells.append(f"{'':>15s}")
                continue
            k = row[0]
            off = "" if np.isnan(error[k]) else f"{before}{error[k]:+.2f}{after}"
            cells.append(f"{points.angle[k]:7.2f}{'*' if points.snapped[k] else ' '}{off:>7s}")
        print(f"{label:36s}" + "".join(cells))
