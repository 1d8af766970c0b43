"""A control loop at 1 kHz: the rod's bend goes round a circle, guided by the Jacobian.

    python examples/03_control_loop.py [PICTURE] [--ticks N]

The wanted bend has an angle of 40 degrees and a plane that goes once round. Each tick the controller reads
the bend, solves its model of the rod for the Jacobian, and changes the pressures by as much as takes the bend
along the circle and out of its error. The rod that it controls carries a payload of which the model knows
nothing. Prints tracking error, computing times and missed deadlines, and draws them.
"""

import argparse
import time
from collections.abc import Callable
from pathlib import Path

import matplotlib

matplotlib.use("Agg")

import matplotlib.pyplot as plt
import numpy as np

import rodmodel

PERIOD = 1e-3  # [s]
ANGLE = np.radians(40.0)
GRAVITY = np.array([0.0, 0.0, 9.81])  # the rod hangs
PAYLOAD = np.array([0.0, 0.0, 5e-3])  # at its tip, half a gram [N]
GAIN = 60.0  # of the error, against which the loop works [1/s]
DECAY = 0.02  # per tick, of a pressure that is not needed
PICTURE = Path(__file__).parents[1] / "docs" / "images" / "control_loop.png"


def main() -> None:
    """Run the loop, print the report, draw the picture."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("picture", nargs="?", type=Path, default=PICTURE)
    parser.add_argument(
        "--ticks", type=int, default=4000, help="once round the circle (default: %(default)s)"
    )
    options = parser.parse_args()

    rod = rodmodel.load_core("double-helix", psi=0.0, pitch=3e-3)
    plant = rod.predictor(("tip_force", "gravity"))
    control = controller(rod)
    # Of the rod without weight: what that misses, the loop makes up for in a few hundredths of a second.
    pressure = rod.inverse(ANGLE, 0.0).pressure

    plane = 2.0 * np.pi * np.arange(options.ticks + 1) / options.ticks
    wanted = ANGLE * np.stack([np.cos(plane), np.sin(plane)], axis=1)
    bends, pressures, work = run(plant, control, pressure, wanted)

    error_deg = np.degrees(np.linalg.norm(bends - wanted[:-1], axis=1))
    settled = error_deg[len(error_deg) // 10 :]
    missed = np.count_nonzero(work > PERIOD)
    print(f"ticks             {options.ticks} of {1e3 * PERIOD:g} ms")
    print(f"missed deadlines  {missed} ({100.0 * missed / options.ticks:.2f} %)")
    print(
        f"work per tick     median {1e6 * np.median(work):.0f} µs, "
        f"99 % within {1e6 * np.quantile(work, 0.99):.0f} µs, worst {1e6 * work.max():.0f} µs"
    )
    print(
        f"tracking error    {np.sqrt(np.mean(settled**2)):.3f} deg rms, {settled.max():.3f} deg at most, "
        "after a tenth of the circle"
    )
    options.picture.parent.mkdir(parents=True, exist_ok=True)
    draw(bends, wanted[:-1], pressures, work, options.picture)
    print(f"wrote {options.picture}")


def controller(rod: rodmodel.CoreRod) -> Callable[..., np.ndarray]:
    """Function from pressures, bend, wanted bend and the next one to the next pressures."""
    model = rod.predictor(("gravity",), steps=4, tolerance=1e-5)
    largest = np.array(rod.domain.pressure_max)

    def step(
        pressure: np.ndarray, is_bend: np.ndarray, wanted: np.ndarray, following: np.ndarray
    ) -> np.ndarray:
        jacobian = model.jacobian(pressure, gravity=GRAVITY)[1].bend_by_pressure
        change = following - wanted + GAIN * PERIOD * (wanted - is_bend)

        def without(chamber: int) -> tuple[float, np.ndarray]:
            """Pressures by which the two other chambers make the change, while this one is let off."""
            let_off = -DECAY * pressure[chamber]
            pair = [k for k in range(3) if k != chamber]
            after = pressure.copy()
            after[pair] += np.linalg.solve(jacobian[:, pair], change - jacobian[:, chamber] * let_off)
            after[chamber] += let_off
            # The pair that can: a negative pressure counts most, what is left in the third chamber least.
            return 1e3 * np.maximum(-after, 0.0).sum() + pressure[chamber], after

        _, chosen = min(map(without, range(3)), key=lambda choice: choice[0])
        chosen = np.clip(chosen, 0.0, largest)
        return chosen * min(1.0, rod.domain.reach(chosen))

    return step


def run(
    plant: rodmodel.Predictor, control: Callable[..., np.ndarray], pressure: np.ndarray, wanted: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Bends [rad], pressures [Pa] and the time that the controller took [s], tick by tick."""
    ticks = len(wanted) - 1
    bends, pressures, work = np.empty((ticks, 2)), np.empty((ticks, 3)), np.empty(ticks)
    next_tick = time.perf_counter()
    for tick in range(ticks):
        # What a sensor would tell; it takes its time before the tick.
        pose = plant(pressure, tip_force=PAYLOAD, gravity=GRAVITY)
        bends[tick] = pose.bending_angle * np.array([np.cos(pose.bending_plane), np.sin(pose.bending_plane)])
        pressures[tick] = pressure
        while time.perf_counter() < next_tick:
            pass
        begin = time.perf_counter()
        pressure = control(pressure, bends[tick], wanted[tick], wanted[tick + 1])
        work[tick] = time.perf_counter() - begin
        # A missed tick is not caught up with.
        next_tick = max(next_tick + PERIOD, begin + work[tick])
    return bends, pressures, work


def draw(bends: np.ndarray, wanted: np.ndarray, pressures: np.ndarray, work: np.ndarray, file: Path) -> None:
    """Path, pressures, error and computing times."""
    figure = plt.figure(figsize=(11.0, 6.5), layout="constrained")
    path = figure.add_subplot(2, 2, 1, projection="polar")
    for points, style, label in ((wanted, "k--", "wanted"), (bends, "#0072b2", "reached")):
        path.plot(
            np.arctan2(points[:, 1], points[:, 0]),
            np.degrees(np.hypot(*points.T)),
            style,
            linewidth=1.0,
            label=label,
        )
    path.set_title("plane γ and angle θ [deg]", fontsize=10)
    path.legend(loc="center", fontsize=8)
    seconds = PERIOD * np.arange(len(work))
    pressure = figure.add_subplot(2, 2, 2)
    for chamber, colour in enumerate(("#0072b2", "#e69f00", "#009e73")):
        pressure.plot(seconds, 1e-3 * pressures[:, chamber], color=colour, label=f"chamber {chamber + 1}")
    pressure.set(xlabel="time [s]", ylabel="pressure [kPa]")
    pressure.legend(fontsize=8)
    error = figure.add_subplot(2, 2, 3)
    error.semilogy(seconds, np.degrees(np.linalg.norm(bends - wanted, axis=1)), color="#d55e00")
    error.set(xlabel="time [s]", ylabel="error of the bend [deg]")
    times = figure.add_subplot(2, 2, 4)
    times.hist(1e6 * work, bins=np.geomspace(1e6 * work.min(), 1e6 * work.max() * 1.01, 60), color="0.5")
    times.axvline(1e6 * PERIOD, color="black", linestyle="--", label="deadline")
    times.set(xscale="log", yscale="log", xlabel="controller's work per tick [µs]", ylabel="ticks")
    times.legend(fontsize=8)
    figure.savefig(file, dpi=130)


if __name__ == "__main__":
    main()
