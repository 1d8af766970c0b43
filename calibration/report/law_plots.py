"""Plots of a law against the states of its dataset."""

from pathlib import Path

import jax
import jax.numpy as jnp
import matplotlib.pyplot as plt
import numpy as np
from matplotlib.figure import Figure

from calibration.fit import NO_MOMENT, AnyLaw, Deviations, Samples
from rodmodel import OrientedNetwork, SectionLaw
from rodmodel.io import atomic_part

KPA, MM2 = 1e3, 1e-6
DOTS_PER_INCH = 130


def write_figures(
    directory: Path, law: AnyLaw, everything: Samples, held_out: Samples, off: Deviations, length: float
) -> list[Path]:
    """Write all plots as PNG; angles against pressure only for a law of one orientation.

    Parameters
    ----------
    directory : directory for the plots; created if missing.
    law : fitted law.
    everything, held_out : all states inside the domain, and the held-out ones.
    off : deviations at the held-out states.
    length : body length for the bending angle [m].
    """
    directory.mkdir(parents=True, exist_ok=True)
    drawn = {
        "parity.png": parity(held_out, off, length),
        "error-over-states.png": error_over_states(held_out, off, length),
        "moment-curvature.png": moment_curvature(held_out, off, length),
    }
    if not isinstance(law, OrientedNetwork):
        drawn["angle-against-pressure.png"] = angle_against_pressure(law, everything, length)
    for name, figure in drawn.items():
        with atomic_part(directory / name) as part:
            figure.savefig(part, dpi=DOTS_PER_INCH, format="png")
        plt.close(figure)
    return [directory / name for name in drawn]


def angle_against_pressure(law: SectionLaw, samples: Samples, length: float) -> Figure:
    """Plot bending angle and volume over the pressure of each single chamber, law and cell."""
    figure, (angles, volumes) = plt.subplots(1, 2, figsize=(10, 4), layout="constrained")
    free = np.linalg.norm(samples.moment, axis=1) <= NO_MOMENT
    for k in range(3):
        others = [n for n in range(3) if n != k]
        alone = free & (samples.pressure[:, k] > 0) & np.all(samples.pressure[:, others] == 0, axis=1)
        pressure = samples.pressure[alone, k]
        curve = np.zeros((200, 3))
        curve[:, k] = np.linspace(0.0, pressure.max() if alone.any() else samples.pressure[:, k].max(), 200)
        u = jax.vmap(law.free_curvature)(jnp.asarray(curve))
        volume = jax.vmap(law.volume)(u, jnp.asarray(curve))
        colour = f"C{k}"
        angles.plot(
            curve[:, k] / KPA,
            _degrees(np.asarray(u), length),
            colour,
            label=f"chamber {k + 1}",
            ls=_DASHES[k],
        )
        angles.plot(
            pressure / KPA, _degrees(samples.curvature[alone], length), colour, marker="o", ls="", ms=4
        )
        volumes.plot(curve[:, k] / KPA, np.asarray(volume)[:, k] / MM2, colour, ls=_DASHES[k])
        volumes.plot(pressure / KPA, samples.volume[alone, k] / MM2, colour, marker="o", ls="", ms=4)
    angles.set(
        xlabel="pressure of one chamber [kPa]", ylabel=f"bending angle over {1e3 * length:.0f} mm [deg]"
    )
    volumes.set(xlabel="pressure of one chamber [kPa]", ylabel="its volume per length [mm²]")
    angles.legend(title="line: law, dots: cell")
    return figure


def parity(held_out: Samples, off: Deviations, length: float) -> Figure:
    """Plot the law's angle, twist and volume against the cell's, at held-out states."""
    figure, axes = plt.subplots(1, 3, figsize=(13, 4.2), layout="constrained")
    twist = np.rad2deg(length)
    for axis, cell, law, name in (
        (
            axes[0],
            _degrees(held_out.curvature, length),
            _degrees(off.curvature, length),
            "bending angle [deg]",
        ),
        (axes[1], twist * held_out.curvature[:, 2], twist * off.curvature[:, 2], "twist [deg]"),
        (
            axes[2],
            held_out.volume.ravel() / MM2,
            (held_out.volume + off.volume).ravel() / MM2,
            "volume [mm²]",
        ),
    ):
        ends = [cell.min(), cell.max()]
        axis.plot(ends, ends, color="0.7", lw=1)
        axis.plot(cell, law, "C0.", ms=4)
        axis.set(xlabel=f"cell: {name}", ylabel=f"law: {name}")
    figure.suptitle(f"{len(held_out)} held-out states, {1e3 * length:.0f} mm; volume per length")
    return figure


def error_over_states(held_out: Samples, off: Deviations, length: float) -> Figure:
    """Plot errors of bending vector and volume over pressure and bending angle, at held-out states."""
    figure, axes = plt.subplots(1, 2, figsize=(11, 4.5), layout="constrained")
    volume = 100.0 * np.abs(off.volume).max(axis=1) / np.ptp(held_out.volume)
    for axis, error, name in (
        (axes[0], np.rad2deg(off.bend), "error of the bending vector [deg]"),
        (axes[1], volume, "volume error [% of range]"),
    ):
        order = np.argsort(error)
        dots = axis.scatter(
            held_out.pressure.sum(axis=1)[order] / KPA,
            _degrees(held_out.curvature, length)[order],
            c=error[order],
            cmap="viridis",
            s=18,
        )
        figure.colorbar(dots, ax=axis, label=name)
        axis.set(xlabel="sum of pressures [kPa]", ylabel=f"bending angle over {1e3 * length:.0f} mm [deg]")
    return figure


def moment_curvature(held_out: Samples, off: Deviations, length: float) -> Figure:
    """Plot the moment over bend and twist along held-out paths with a moment.

    Pressures rise along a path while the moment moves between random values, so that curves turn back: line
    and dots should agree.
    """
    figure, axes = plt.subplots(1, 3, figsize=(13, 4.4), layout="constrained")
    moved = np.linalg.norm(held_out.moment, axis=1) > NO_MOMENT
    paths = [path for path in np.unique(held_out.path) if moved[held_out.path == path].any()][:_PATHS_SHOWN]
    for number, path in enumerate(paths):
        rows = held_out.path == path
        pressure = " ".join(f"{p:.0f}" for p in held_out.pressure[rows][-1] / KPA)
        for axis, k in zip(axes, range(3), strict=True):
            turn, moment = np.rad2deg(length), 1e3 * held_out.moment[rows, k]
            axis.plot(turn * off.curvature[rows, k], moment, f"C{number}-", lw=1)
            axis.plot(
                turn * held_out.curvature[rows, k], moment, f"C{number}o", ms=3, label=f"to {pressure} kPa"
            )
    for axis, name in zip(axes, ("bend about x", "bend about y", "twist"), strict=True):
        axis.set(
            xlabel=f"{name} over {1e3 * length:.0f} mm [deg]", ylabel="moment about the same axis [N mm]"
        )
    axes[2].legend(title="line: law, dots: cell", fontsize="small")
    return figure


_DASHES = ("-", "-", "--")
_PATHS_SHOWN = 6


def _degrees(curvature: np.ndarray, length: float) -> np.ndarray:
    return np.rad2deg(length * np.linalg.norm(curvature[:, :2], axis=1))
