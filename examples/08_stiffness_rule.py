"""Which orientation makes the three chambers most alike: the question that the paper left open, answered.

Run as ``python examples/08_stiffness_rule.py [PICTURE]``. The paper's rule ranks chambers by
R = ψ'/(180° − ψ'), ψ' the angle from a chamber's centre to the nearest crossing of the threads (its Eqs 5 to
10), and finds ψ = 0 and 12 degrees best. Here the stiffness of a chamber is the pressure over the angle that
it bends the actuator to, from the calibration of all orientations; its correlation with R, the spread of the
three chambers over ψ, and the ψ of least spread, by bisection on the sign of its derivative. Where the
finite-element points are, at ψ' in steps of 15 degrees, they say the same without the calibration's error.
"""

import json
import math
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from figures.fem_points import POINTS
from figures.panels import COLOURS, IMAGES, save
from jax import Array
from matplotlib.figure import Figure

import rodmodel
from rodmodel.stiffness_rule import stiffness_ratio

PRESSURES_KPA = (20.0, 30.0, 40.0, 50.0)
JUDGED_KPA = 40.0
CHAMBERS = jnp.eye(3)
# Of a legend: the curves take all the room inside.
ABOVE: dict[str, Any] = {"fontsize": 8, "loc": "lower center", "bbox_to_anchor": (0.5, 1.0), "frameon": False}


def main(picture: Path) -> None:
    """Print the answers and draw the picture."""
    jax.config.update("jax_enable_x64", True)  # the precision is the program's to choose
    rods = rodmodel.load_oriented("double-helix")

    def angles(psi: Array, kpa: Array) -> Array:
        """Bending angle by each chamber alone [rad]."""
        section = rods.section.at_psi(psi)
        free = jax.vmap(section.free_curvature)(1e3 * kpa * CHAMBERS)
        return rods.actuator.body_length * jnp.hypot(free[:, 0], free[:, 1])

    @jax.jit
    def spread(psi: Array, kpa: Array) -> Array:
        """Largest less smallest angle, over the mean."""
        found = angles(psi, kpa)
        return (jnp.max(found) - jnp.min(found)) / jnp.mean(found)

    slope = jax.jit(jax.grad(spread))
    over_psi = jax.jit(jax.vmap(angles, (0, None)))
    psi = jnp.radians(jnp.linspace(0.0, 180.0, 181))
    ratio = np.asarray(jax.vmap(stiffness_ratio)(psi))
    at = {p: np.asarray(over_psi(psi, jnp.asarray(p))) for p in PRESSURES_KPA}
    spreads = {p: np.ptp(a, axis=1) / a.mean(axis=1) for p, a in at.items()}

    print(
        "pressure [kPa]   correlation of p/θ with R   spread at ψ = 0, 12, 30 [%]   "
        "least at ψ [deg], spread [%]"
    )
    for p, found in at.items():
        stiffness = p / found
        correlation = np.corrcoef(ratio.ravel(), stiffness.ravel())[0, 1]
        best = least_spread(lambda x, p=p: slope(x, jnp.asarray(p)), psi[:61], spreads[p][:61])
        least = float(spread(jnp.asarray(best), jnp.asarray(p)))
        some = "  ".join(
            f"{100.0 * float(spread(jnp.radians(x), jnp.asarray(p))):6.2f}" for x in (0.0, 12.0, 30.0)
        )
        print(
            f"{p:14g}   {correlation:25.3f}   {some:>30s}   {math.degrees(best):12.2f}, {100.0 * least:.2f}"
        )
    # Of the section alone, which is what the angles here are of: that of rods has the ends' part too.
    (of_all,) = (c for c in rodmodel.shipped_calibrations() if c.layout.psi is None)
    error = float(of_all.error["free_bending_angle_rad"]["p90"])
    noise = math.sqrt(2.0) * error / float(at[JUDGED_KPA].mean())
    print(
        f"The map errs by up to {math.degrees(error):.2f} deg in 90 % of states: by its error "
        f"alone two angles differ by up to {100.0 * noise:.1f} % of their mean at {JUDGED_KPA:g} kPa."
    )
    points = json.loads(POINTS.read_text())
    print("spread by the finite-element points alone [%], at ψ =" + "".join(f"{x:7d}" for x in (0, 15, 30)))
    for p in PRESSURES_KPA:
        cells = [_point_spread(points, x, p) for x in (0, 15, 30)]
        print(f"{p:47g} kPa  " + "".join(f"{100.0 * cell:7.2f}" for cell in cells))
    save(drawn(np.degrees(psi), ratio, at[JUDGED_KPA], spreads, points), picture)


def _point_angle(points: dict[str, Any], away_deg: float, kpa: float) -> float:
    """Angle by a chamber so far from the nearest crossing [deg]."""
    path = points[f"psi{away_deg:g}"]
    return float(path["angle_deg"][path["pressure_kpa"].index(kpa)])


def _point_spread(points: dict[str, Any], psi_deg: float, kpa: float) -> float:
    away = [abs((120 * chamber - psi_deg + 90) % 180 - 90) for chamber in range(3)]
    angles = np.array([_point_angle(points, a, kpa) for a in away])
    return float(np.ptp(angles) / angles.mean())


def least_spread(slope: Callable[[Array], Array], psi: Array, values: np.ndarray) -> float:
    """ψ of least spread near the least of a grid: bisection on the sign of its derivative.

    The spread is the difference of two angles, with a kink where another chamber becomes the largest or the
    smallest; the derivative changes its sign there too. After 60° all comes again.
    """
    k = int(np.argmin(values))
    low, high = float(psi[max(k - 1, 0)]), float(psi[min(k + 1, len(psi) - 1)])
    for _ in range(30):
        middle = 0.5 * (low + high)
        low, high = (low, middle) if float(slope(jnp.asarray(middle))) > 0.0 else (middle, high)
    return 0.5 * (low + high)


def drawn(
    psi_deg: np.ndarray,
    ratio: np.ndarray,
    angles: np.ndarray,
    spreads: dict[float, np.ndarray],
    points: dict[str, Any],
) -> Figure:
    """Stiffness over ψ with the rule, stiffness over R, and the spread."""
    figure = Figure(figsize=(12.0, 3.8), layout="constrained")
    over_psi, over_ratio, spread = figure.subplots(1, 3)
    stiffness = JUDGED_KPA / np.degrees(angles)
    for k, colour in enumerate(COLOURS):
        over_psi.plot(psi_deg, stiffness[:, k], color=colour, label=f"chamber {k + 1}")
        over_ratio.plot(ratio[:, k], stiffness[:, k], ".", color=colour, ms=2)
    away = np.arange(0, 91, 15)
    of_points = JUDGED_KPA / np.array([_point_angle(points, x, JUDGED_KPA) for x in away])
    over_psi.plot(away, of_points, "ko", ms=4, label="FEM, chamber 1")
    over_ratio.plot(away / (180.0 - away), of_points, "ko", ms=4, label="FEM")
    over_ratio.legend(**ABOVE)
    over_psi.set_xlabel("ψ [deg]")
    over_psi.set_ylabel(f"pressure over angle at {JUDGED_KPA:g} kPa [kPa/deg]")
    over_psi.legend(**ABOVE, ncols=2)
    over_ratio.set_xlabel("the paper's R")
    for p, values in spreads.items():
        spread.plot(psi_deg, 100.0 * values, label=f"{p:g} kPa")
    spread.set_xlabel("ψ [deg]")
    spread.set_ylabel("largest less smallest angle, % of mean")
    spread.legend(**ABOVE, ncols=4)
    for panel in (over_psi, over_ratio, spread):
        panel.grid(alpha=0.3)
    return figure


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else IMAGES / "stiffness_rule.png")
