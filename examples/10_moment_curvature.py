"""Moment-curvature maps of the chambers, per winding: a moment about the axis that the chamber bends about.

Run as ``python examples/10_moment_curvature.py [PICTURE]``. Points are the finite-element cell, lines the
section law that a rod is integrated with, its error underneath, as the angle of 60 mm.
"""

import json
import math
import sys
from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np
from comparison import COLOURS, IMAGES, save
from matplotlib.figure import Figure

import rodmodel

POINTS = Path(__file__).parent / "data" / "moment_points.json"
NEWTON_STEPS = 30


@jax.jit
def curvature_at(section: rodmodel.SectionLaw, pressure: jax.Array, moment: jax.Array) -> jax.Array:
    """Curvature of the section under a moment, by Newton's method from the free curvature."""
    law = section.at(pressure)

    def step(_: int, u: jax.Array) -> jax.Array:
        return u + jnp.linalg.solve(law.stiffness(u), moment - law.moment(u))

    return jax.lax.fori_loop(0, NEWTON_STEPS, step, law.free_curvature)


def main(picture: Path) -> None:
    """Draw the panels and print the table."""
    jax.config.update("jax_enable_x64", True)  # the precision is the program's to choose
    held = json.loads(POINTS.read_text())
    mapped = list(dict.fromkeys((path["layout"], path["chamber"]) for path in held.values()))
    figure = Figure(figsize=(12.0, 5.2), layout="constrained")
    axes = figure.subplots(2, len(mapped), sharex="col", sharey="row", height_ratios=(3, 1))
    print(
        f"{'law − FEM, angle of 60 mm [deg]':40s}   median    worst  points  FEM's stiffness free [1e-4 N m²]"
    )
    for column, (name, chamber) in enumerate(mapped):
        above, below = axes[:, column]
        azimuth, rod = 2.0 * math.pi / 3.0 * (chamber - 1), rodmodel.load(name)
        axis = np.array([math.sin(azimuth), -math.cos(azimuth), 0.0])
        over = jax.jit(jax.vmap(curvature_at, (None, None, 0)))
        pressures = sorted(
            {p["pressure_kpa"] for p in held.values() if (p["layout"], p["chamber"]) == (name, chamber)}
        )
        for colour, kpa in zip(COLOURS, pressures, strict=True):
            ways = [held[f"{name}-chamber{chamber}-{kpa:g}-{way}"] for way in ("back", "on")]
            moment = np.concatenate([ways[0]["moment_nmm"][:0:-1], ways[1]["moment_nmm"]])
            fem = np.concatenate([ways[0]["curvature_per_m"][:0:-1], ways[1]["curvature_per_m"]])
            pressure = 1e3 * kpa * jnp.eye(3)[chamber - 1]
            fine = np.linspace(moment.min(), moment.max(), 80)
            curve = np.asarray(over(rod.section, pressure, 1e-3 * fine[:, None] * axis)) @ axis
            law = np.asarray(over(rod.section, pressure, 1e-3 * moment[:, None] * axis)) @ axis
            error = np.degrees(rod.actuator.body_length * (law - fem))
            above.plot(curve, fine, color=colour, lw=1.5, label=f"{kpa:g} kPa")
            above.plot(fem, moment, "o", color=colour, ms=4)
            below.plot(fem, error, "o-", color=colour, ms=3, lw=0.8)
            free = int(np.argmin(np.abs(moment)))
            slope = (moment[free + 1] - moment[free - 1]) / (fem[free + 1] - fem[free - 1])
            print(
                f"{f'{name}, chamber {chamber}, {kpa:g} kPa':40s} {np.median(np.abs(error)):8.2f} "
                f"{np.abs(error).max():8.2f} {len(error):7d} {10.0 * slope:33.2f}"
            )
        above.set_title(f"{name}, chamber {chamber}", fontsize=10)
        above.legend(fontsize=8, title="pressure")
        below.axhline(0.0, color="0.5", lw=0.8)
        below.set_xlabel("curvature [1/m]")
        for panel in (above, below):
            panel.grid(alpha=0.3)
    axes[0, 0].set_ylabel("moment about the chamber's axis [N mm]")
    axes[1, 0].set_ylabel("law − FEM [deg]")
    save(figure, picture)


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else IMAGES / "moment_curvature.png")
