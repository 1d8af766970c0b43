"""A twin experiment: an actuator with one wall a tenth thicker is measured, and the map adjusted to it.

Run as ``python examples/12_twin.py [PICTURE]``. The actuator is a finite-element one (points/twin_points.py),
so that its bending is known without noise; what is measured of it has 3 % of noise. The map that ships is of
equal walls. Told are its errors against the actuator itself, before and after `fit-measured` has seen the
noisy measurements.
"""

import csv
import json
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path

import jax
import numpy as np
from figures.panels import COLOURS, IMAGES, save
from matplotlib.figure import Figure

import rodmodel
from calibration.measured import (
    ANGLE,
    NAMES,
    PLANE,
    POSITIONS,
    PRESSURES,
    Measured,
    MeasuredFit,
    Noise,
    fit_measured,
    read_measured,
)

POINTS = Path(__file__).parent / "data" / "twin_points.json"
NOISE = 0.03  # of a bending angle, of a way of the tip; and of a bending plane [rad]
LENGTH_MM = 66.0  # of body and cap
DRAWS = 5
MIRRORED = {"chamber2": "chamber3"}


@dataclass(frozen=True)
class Twin:
    """Errors against the actuator itself, of map and adjusted map: angles [deg], tips [mm].

    `path`, `pressure` : names, and largest pressure [kPa], of the states.
    """

    path: np.ndarray
    pressure: np.ndarray
    angle: tuple[np.ndarray, np.ndarray]
    tip: tuple[np.ndarray, np.ndarray]
    fit: MeasuredFit

    def ratios(self) -> tuple[float, float]:
        """Root mean square adjusted over that of the map, of angles and of tips."""
        first, second = (
            float(np.sqrt(np.mean(after**2) / np.mean(before**2))) for before, after in (self.angle, self.tip)
        )
        return first, second


def states() -> tuple[list[str], np.ndarray, np.ndarray]:
    """Path of each state, pressures [kPa], and angle [deg], plane [deg] and tip [mm] without noise."""
    held = json.loads(POINTS.read_text())
    names = [name for name, path in held.items() for _ in path["pressure_kpa"]]
    pressure = np.concatenate([path["pressure_kpa"] for path in held.values()])
    values = np.concatenate(
        [np.column_stack([path["angle_deg"], path["plane_deg"], path["tip_mm"]]) for path in held.values()]
    )
    # The actuator is its own mirror image in the plane of chamber 1.
    own = np.flatnonzero(pressure[:, 1] != pressure[:, 2])
    names += [MIRRORED[names[n]] for n in own]
    return (
        names,
        np.concatenate([pressure, pressure[own][:, [0, 2, 1]]]),
        np.concatenate([values, values[own] * [1.0, -1.0, 1.0, -1.0, 1.0]]),
    )


def measure(
    pressure: np.ndarray, values: np.ndarray, noise: float, seed: int, domain: rodmodel.Domain
) -> Measured:
    """A file of measurements, as `rodmodel-calibrate fit-measured` reads it."""
    off = noise * np.random.default_rng(seed).normal(size=values.shape)
    way = np.linalg.norm(values[:, 2:] - [0.0, 0.0, LENGTH_MM], axis=1)
    size = np.column_stack([values[:, 0], np.full(len(values), np.rad2deg(1.0)), way, way, way])
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "measured.csv"
        with file.open("w", newline="") as stream:
            writer = csv.writer(stream)
            writer.writerow([*PRESSURES, ANGLE, PLANE, *POSITIONS])
            writer.writerows(np.column_stack([pressure, values + size * off]).tolist())
        return read_measured(file, domain)


def run(seed: int) -> Twin:
    """Measure, adjust the map, and hold both against the actuator itself."""
    rod = rodmodel.load("double-helix")
    names, pressure, values = states()
    measured = measure(pressure, values, NOISE, seed, rod.domain)
    fit = fit_measured(rod, measured, Noise(estimate=True))
    # What was predicted is what was measured less the residual; the actuator itself stands in for that.
    exact = measure(pressure, values, 0.0, seed, rod.domain).values
    before, after = (exact - (measured.values - residual) for residual in (fit.of_map, fit.adjusted))
    return Twin(
        np.array(names),
        pressure.max(axis=1),
        (np.rad2deg(before[:, 0]), np.rad2deg(after[:, 0])),
        (1e3 * np.linalg.norm(before[:, 2:], axis=1), 1e3 * np.linalg.norm(after[:, 2:], axis=1)),
        fit,
    )


def draw(twin: Twin, file: Path) -> None:
    """Errors over the pressure, before and after."""
    figure = Figure(figsize=(8.6, 3.6), layout="constrained")
    axes = figure.subplots(1, 2)
    for axis, (before, after), what in zip(
        axes,
        (twin.angle, twin.tip),
        ("bending angle: actuator − rod [deg]", "tip: distance [mm]"),
        strict=True,
    ):
        for values, colour, label in (
            (before, COLOURS[1], "map as shipped"),
            (after, COLOURS[0], "adjusted"),
        ):
            axis.plot(twin.pressure, values, "o", color=colour, mfc="none", label=label)
        axis.axhline(0.0, color="0.5", lw=0.8)
        axis.set(xlabel="pressure [kPa]", ylabel=what)
        axis.grid(alpha=0.3)
    axes[0].legend(frameon=False)
    save(figure, file)


def main(file: Path) -> None:
    """Print the tables and draw one of the draws."""
    jax.config.update("jax_enable_x64", True)  # the precision is the program's to choose
    twins = [run(seed) for seed in range(DRAWS)]
    print(f"{'':10s} {'map: angle':>12s} {'tip':>9s}   {'adjusted: angle':>16s} {'tip':>9s}")
    for path in dict.fromkeys(twins[0].path):
        here = [twin.path == path for twin in twins]
        cells = [
            np.sqrt(np.mean([getattr(t, what)[k][rows] ** 2 for t, rows in zip(twins, here, strict=True)]))
            for k in (0, 1)
            for what in ("angle", "tip")
        ]
        print(f"{path:10s} {cells[0]:8.2f} deg {cells[1]:6.2f} mm   {cells[2]:12.2f} deg {cells[3]:6.2f} mm")
    ratios = np.array([twin.ratios() for twin in twins])
    print(f"adjusted over map, root mean square, median of {DRAWS} draws of the noise:")
    print(f"angle {np.median(ratios[:, 0]):.2f}, tip {np.median(ratios[:, 1]):.2f}")
    found = twins[0].fit
    print("of the first draw, with standard errors:")
    for name, value, error in zip(NAMES, found.parameters, found.standard_error, strict=True):
        unit, size = (" [kPa]", 1e-3) if "offset" in name else ("", 1.0)
        print(f"{name + unit:26s} {size * value:8.3f} " + (f"± {size * error:.3f}" if error > 0 else "held"))
    draw(twins[0], file)


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else IMAGES / "twin.png")
