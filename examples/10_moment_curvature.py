"""Moment-curvature maps of the chambers, per winding: a moment about the axis that the chamber bends about.

Run as ``python examples/10_moment_curvature.py [PICTURE]``. Points are the finite-element cell, lines the
section law that a rod is integrated with, its error underneath, as the angle of 60 mm. The highest pressure
that both the law and the full actuator have is drawn too: there the square is the actuator's middle, free.
A line ends where the section gives way sideways.
"""

import json
import math
import sys
from collections.abc import Sequence
from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np
from figures.fem_points import middle_curvature
from figures.panels import ACTUATOR, CELL, COLOURS, EDGE, IMAGES, save
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

import rodmodel

POINTS = Path(__file__).parent / "data" / "moment_points.json"
RISE_STEPS, NEWTON_STEPS = 40, 50
MOMENT_LEFT = 1e-9  # [N m], a millionth of the moments
HIGHEST = "#cc79a7"


@jax.jit
def curvature_at(section: rodmodel.SectionLaw, pressure: jax.Array, moment: jax.Array) -> jax.Array:
    """Curvature of the section under a moment, by Newton's method while the moment rises from none.

    Not a number if the section gives way before, as its stiffness tells.
    """
    law = section.at(pressure)

    def step(n: int, u: jax.Array) -> jax.Array:
        share, stiffness = jnp.minimum((n + 1) / RISE_STEPS, 1.0), law.stiffness(u)
        stands = jnp.linalg.eigvalsh(stiffness)[0] > 0.0
        return jnp.where(
            stands, u + jnp.linalg.solve(stiffness, share * moment - law.moment(u)), jnp.full(3, jnp.nan)
        )

    found = jax.lax.fori_loop(0, NEWTON_STEPS, step, law.free_curvature)
    left = jnp.abs(law.moment(found) - moment).max()
    return jnp.where(left < MOMENT_LEFT, found, jnp.nan)


def main(picture: Path) -> None:
    """Draw the panels and print the tables."""
    jax.config.update("jax_enable_x64", True)  # the precision is the program's to choose
    held = json.loads(POINTS.read_text())
    mapped = list(dict.fromkeys((path["layout"], path["chamber"]) for path in held.values()))
    figure = Figure(figsize=(12.0, 5.6), layout="constrained")
    axes = figure.subplots(2, len(mapped), sharex="col", sharey="row", height_ratios=(3, 1))
    print(
        f"{'law − FEM, angle of 60 mm [deg]':40s}   median    worst  points  FEM's stiffness free [1e-4 N m²]"
    )
    highest = [draw_column(axes[:, column], held, *which) for column, which in enumerate(mapped)]
    print("law − middle of the full actuator, without a moment, angle of 60 mm [deg]")
    for told in highest:
        print(told)
    axes[0, 0].set_ylabel("moment about the chamber's axis [N mm]")
    axes[1, 0].set_ylabel("law − FEM [deg]")
    handles = [
        Line2D([], [], color="0.35", lw=1.5, label="section law"),
        Line2D([], [], color="0.35", label="cell", **CELL),
        Line2D([], [], color="0.35", label="full actuator, its middle", **ACTUATOR, **EDGE),
    ]
    figure.legend(handles=handles, loc="outside lower center", ncols=3, fontsize=8, frameon=False)
    save(figure, picture)


def draw_column(panels: Sequence[Axes], held: dict, name: str, chamber: int) -> str:
    """Draw one chamber of a winding, print its table, and return the line about the full actuator."""
    above, below = panels
    rod, alone = rodmodel.load(name), np.eye(3)[chamber - 1]
    azimuth = 2.0 * math.pi / 3.0 * (chamber - 1)
    axis = np.array([math.sin(azimuth), -math.cos(azimuth), 0.0])
    over = jax.jit(jax.vmap(curvature_at, (None, None, 0)))

    def law(kpa: float, moment_nmm: np.ndarray) -> np.ndarray:
        pressure, moment = jnp.asarray(1e3 * kpa * alone), jnp.asarray(1e-3 * moment_nmm[:, None] * axis)
        return np.array(over(rod.section, pressure, moment)) @ axis

    def curve(kpa: float, moments: np.ndarray, colour: str) -> None:
        curvature = law(kpa, moments)
        # Beyond the first moment under which it gives way a section may stand again, but is not led there.
        curvature[np.maximum.accumulate(np.isnan(curvature) & (moments > 0.0))] = np.nan
        above.plot(curvature, moments, color=colour, lw=1.5)
        name = {"color": colour, "fontsize": 8, "ha": "center", "va": "bottom", "rotation": 90}
        last = np.flatnonzero(np.isfinite(curvature))[-1]
        above.text(curvature[last], moments[last] + 0.3, f"{kpa:g} kPa", **name)

    pressures = sorted(
        {p["pressure_kpa"] for p in held.values() if (p["layout"], p["chamber"]) == (name, chamber)}
    )
    for colour, kpa in zip(COLOURS, pressures, strict=True):
        ways = [held[f"{name}-chamber{chamber}-{kpa:g}-{way}"] for way in ("back", "on")]
        moment = np.concatenate([ways[0]["moment_nmm"][:0:-1], ways[1]["moment_nmm"]])
        fem = np.concatenate([ways[0]["curvature_per_m"][:0:-1], ways[1]["curvature_per_m"]])
        error = np.degrees(rod.actuator.body_length * (law(kpa, moment) - fem))
        fine = np.linspace(moment.min(), moment.max(), 80)
        curve(kpa, fine, colour)
        above.plot(fem, moment, color=colour, **CELL)
        below.plot(fem, error, "o-", color=colour, ms=3, lw=0.8)
        free = int(np.argmin(np.abs(moment)))
        slope = (moment[free + 1] - moment[free - 1]) / (fem[free + 1] - fem[free - 1])
        print(
            f"{f'{name}, chamber {chamber}, {kpa:g} kPa':40s} {np.median(np.abs(error)):8.2f} "
            f"{np.abs(error).max():8.2f} {len(error):7d} {10.0 * slope:33.2f}"
        )
    # The highest pressure that both the law and the full actuator have.
    run_kpa, middle = middle_curvature(rodmodel.Layout(name, 0.0, 3e-3), alone)
    inside = np.flatnonzero(rod.domain.covers_pressure(1e3 * run_kpa * alone[:, None]))
    kpa, bent = run_kpa[inside[-1]], middle[inside[-1]] @ axis
    off = float(np.degrees(rod.actuator.body_length * (law(kpa, np.zeros(1))[0] - bent)))
    curve(kpa, fine, HIGHEST)
    above.plot(bent, 0.0, color=HIGHEST, **ACTUATOR, **EDGE)
    below.plot(bent, off, color=HIGHEST, **ACTUATOR, **EDGE)
    above.set_title(f"{name}, chamber {chamber}", fontsize=10)
    above.set_ylim(1.1 * fine[0], 1.6 * fine[-1])
    below.axhline(0.0, color="0.5", lw=0.8)
    below.set_xlabel("curvature [1/m]")
    for panel in panels:
        panel.grid(alpha=0.3)
    return f"{f'{name}, chamber {chamber}, {kpa:g} kPa':40s} {off:+8.2f}"


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else IMAGES / "moment_curvature.png")
