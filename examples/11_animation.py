"""Animate the full actuator's finite elements with the rod's prediction drawn through them.

python examples/11_animation.py [animation.gif] [picture.png] [--frames DIRECTORY]

The skin is the finite elements', the line the rod's: chamber 1 to its highest pressure, then a circle of the
bending plane, as far as points/actuator_frames.py has made frames of them. Where a pressure is beyond the
calibration the rod's line is dashed.
"""

import argparse
from collections.abc import Mapping
from pathlib import Path

import jax
import matplotlib

matplotlib.use("Agg")

import jax.numpy as jnp
import matplotlib.pyplot as plt
import numpy as np
from jaxtyping import Float
from matplotlib.animation import FuncAnimation, PillowWriter
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from mpl_toolkits.mplot3d import Axes3D
from mpl_toolkits.mplot3d.art3d import Poly3DCollection

import rodmodel

FRAMES = Path(__file__).parent / "data"
STATIONS = np.linspace(0.0, 66e-3, 67)
LIGHT = np.array([0.3, -0.8, 0.5]) / np.linalg.norm([0.3, -0.8, 0.5])
SILICONE, SKIN_ALPHA = np.array([0.93, 0.80, 0.62]), 0.45
# Chamber 1 bends in the x-z plane: seen from the side. The circle is seen from above.
VIEWS = {"chamber1": (8.0, -90.0), "circle": (38.0, -70.0)}
FRAMES_A_SECOND, HOLD, DOTS_PER_INCH = 6, 4, 80
BAR_MM = 20.0

Frames = Mapping[str, np.ndarray]


def main(arguments: list[str] | None = None) -> None:
    """Print how far apart rod and finite elements are, write animation and picture."""
    jax.config.update("jax_enable_x64", True)
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("animation", nargs="?", type=Path, default=Path("docs/images/animation.gif"))
    parser.add_argument("picture", nargs="?", type=Path, default=Path("docs/images/fem_and_rod.png"))
    parser.add_argument("--frames", type=Path, default=FRAMES)
    parser.add_argument("--every", type=int, default=1, help="take only every so many-th frame, and the last")
    options = parser.parse_args(arguments)

    rod = rodmodel.load("double-helix")
    paths = {}
    for name in VIEWS:
        frames = options.frames / f"frames-{name}.npz"
        if not frames.exists():
            continue
        with np.load(frames) as file:
            grain = file["grain"]
            paths[name] = {k: file[k][:: -options.every][::-1] for k in file.files if k != "grain"}
        paths[name]["skin"] = grain * paths[name]["skin"]
        paths[name] |= rods(rod, paths[name]["pressure"])
    tell(paths, rod.actuator.body_length)
    draw_picture(paths, options.picture)
    animate(paths, options.animation)
    print(f"drawn in {options.picture} and {options.animation}")


def rods(rod: rodmodel.Rod, pressure: Float[np.ndarray, "n 3"]) -> dict[str, np.ndarray]:
    """The rod's line, angle and plane at each pressure, and whether the calibration covers it."""

    def one(p: jax.Array) -> tuple[jax.Array, ...]:
        solution = rod.solve(p, throw=False)
        line = solution.centreline(jnp.asarray(STATIONS))
        return line, solution.tip_position, solution.bending_angle, solution.bending_plane, solution.in_domain

    names = ("rod_line", "rod_tip", "rod_angle", "rod_plane", "covered")
    values = jax.jit(jax.vmap(one))(jnp.asarray(pressure))
    return {name: np.asarray(value) for name, value in zip(names, values, strict=True)}


def tell(paths: Mapping[str, Frames], length: float) -> None:
    """A table: pressures, bend by finite elements and rod, distance of the tips."""
    for name, path in paths.items():
        print(f"{name}: pressures [kPa], theta and gamma by finite elements and by the rod [deg], tips apart")
        apart = 100.0 * np.linalg.norm(path["tip"] - path["rod_tip"], axis=1) / length
        for n, pressure in enumerate(path["pressure"]):
            bends = np.rad2deg([path[key][n] for key in ("angle", "plane", "rod_angle", "rod_plane")])
            row = " ".join(f"{1e-3 * p:5.1f}" for p in pressure) + "   "
            row += " ".join(f"{value:7.2f}" for value in bends) + f"   {apart[n]:5.2f} % of the length"
            print(row + ("" if path["covered"][n] else "   beyond the calibration"))
        inside = path["covered"].astype(bool)
        print(
            f"apart where covered: median {np.median(apart[inside]):.2f}, worst {apart[inside].max():.2f} %"
        )


def faces(skin: Float[np.ndarray, "along around 3"]) -> np.ndarray:
    """Quadrilaterals of the skin [mm]."""
    x = 1e3 * np.concatenate([skin, skin[:, :1]], axis=1)
    corners = np.stack([x[:-1, :-1], x[:-1, 1:], x[1:, 1:], x[1:, :-1]], axis=2)
    return corners.reshape(-1, 4, 3)


def draw_body(axes: Axes3D, path: Frames, n: int, alpha: float = SKIN_ALPHA) -> None:
    """One frame: skin, cap and the rod's line."""
    quads = faces(path["skin"][n])
    normal = np.cross(quads[:, 2] - quads[:, 0], quads[:, 3] - quads[:, 1])
    normal /= np.linalg.norm(normal, axis=1)[:, None]
    shade = 0.55 + 0.45 * np.clip(normal @ LIGHT, 0.0, 1.0)
    colours = np.column_stack([shade[:, None] * SILICONE, np.full(len(quads), alpha)])
    axes.add_collection3d(Poly3DCollection(quads, facecolors=colours, edgecolors="none", zorder=1))
    axes.add_collection3d(
        Poly3DCollection(
            [1e3 * path["skin"][n, -1]],
            facecolors=[(*(0.8 * SILICONE), alpha)],
            edgecolors="none",
            zorder=1,
        )
    )
    x, y, z = 1e3 * path["rod_line"][n].T
    axes.plot(x, y, z, color="#1f4e79", lw=2.2, ls="-" if path["covered"][n] else "--", zorder=2)


def set_box(axes: Axes3D, path: Frames, view: tuple[float, float]) -> None:
    """The same axes for all frames of a path, to scale."""
    low, high = 1e3 * path["skin"].min(axis=(0, 1, 2)), 1e3 * path["skin"].max(axis=(0, 1, 2))
    axes.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), zlim=(low[2], high[2]))
    axes.set_box_aspect(high - low)
    axes.view_init(elev=view[0], azim=view[1])
    axes.set_proj_type("ortho")
    axes.set_axis_off()


def draw_curve(axes: plt.Axes, name: str, path: Frames, upto: int) -> None:
    """Angle against pressure, or the bend on the circle: finite elements as dots, rod as a line."""
    bend, rod = path["angle"][: upto + 1], path["rod_angle"]
    if name == "chamber1":
        pressure = 1e-3 * path["pressure"][:, 0]
        covered = path["covered"].astype(bool)
        axes.plot(pressure[covered], np.rad2deg(rod[covered]), "#1f4e79", label="rod")
        axes.plot(pressure[: upto + 1], np.rad2deg(bend), "o", color="#c77b30", ms=4, label="finite elements")
        axes.set(
            xlim=(0.0, pressure.max() + 2.0),
            ylim=(0.0, 1.05 * np.rad2deg(path["angle"].max())),
            xlabel="pressure of chamber 1 [kPa]",
            ylabel="bending angle [deg]",
        )
        axes.legend(loc="upper left", frameon=False)
        return
    for angle, plane, style in (
        (rod, path["rod_plane"], {"color": "#1f4e79", "label": "rod"}),
        (bend, path["plane"][: upto + 1], {"color": "#c77b30", "marker": "o", "ms": 4, "ls": ""}),
    ):
        axes.plot(np.rad2deg(angle) * np.cos(plane), np.rad2deg(angle) * np.sin(plane), **style)
    span = (-1.2 * np.rad2deg(rod.max()), 1.2 * np.rad2deg(rod.max()))
    axes.set(xlim=span, ylim=span, aspect="equal", xlabel="θ cos γ [deg]", ylabel="θ sin γ [deg]")


def draw_notes(axes: Axes3D, name: str, path: Frames, shown: list[int]) -> None:
    """What is drawn, in words; pressures at the tips where one chamber has them; a bar for the scale."""
    lines = [
        Line2D([], [], color="#1f4e79", lw=2.2, label="rod"),
        Line2D([], [], color="#1f4e79", lw=2.2, ls="--", label="rod beyond its calibration"),
        Patch(facecolor=SILICONE, alpha=0.6, label="finite elements"),
        Line2D([], [], color="#c77b30", marker="o", ms=3.5, ls="", label="their tip"),
    ]
    if name == "chamber1":
        kpa = 1e-3 * path["pressure"][shown, 0]
        axes.set_title(f"chamber 1 from {kpa[0]:g} to {kpa[-1]:g} kPa", fontsize=10)
        axes.legend(handles=lines[:3], loc="upper left", fontsize=8, frameon=False)
        for n in shown:
            tip, before = 1e3 * path["rod_line"][n][[-1, -8]]
            place = tip + 0.9 * (tip - before)
            axes.text(
                *place, f"{1e-3 * path['pressure'][n, 0]:.0f} kPa", ha="center", va="center", fontsize=8
            )
    else:
        angle = np.rad2deg(np.median(path["rod_angle"]))
        axes.set_title(f"once around at {angle:.0f}°", fontsize=10)
        axes.legend(handles=[lines[0], *lines[2:]], loc="upper left", fontsize=8, frameon=False)
    x, y, z = 1e3 * path["skin"].max(axis=(0, 1, 2))[0], 0.0, 0.0
    axes.plot([x + 4.0, x + 4.0], [y, y], [z, z + BAR_MM], color="black", lw=2.0)
    axes.text(x + 6.0, y, z + 0.5 * BAR_MM, f"{BAR_MM:g} mm", fontsize=8, ha="left", va="center")


def draw_picture(paths: Mapping[str, Frames], file: Path) -> None:
    """Every third frame of chamber 1, and the circle with its tips."""
    figure = plt.figure(figsize=(5.2 * len(paths), 4.6), layout="constrained")
    for number, (name, path) in enumerate(paths.items(), start=1):
        axes = figure.add_subplot(1, len(paths), number, projection="3d", computed_zorder=False)
        steps = len(path["pressure"])
        shown = [*range((steps - 1) % 3, steps, 3 if name == "chamber1" else 8)]
        for n in shown:
            draw_body(axes, path, n, alpha=0.3)
        if name == "circle":
            axes.plot(*(1e3 * path["rod_tip"].T), color="#1f4e79", lw=1.5, zorder=2)
            axes.plot(*(1e3 * path["tip"].T), "o", color="#c77b30", ms=3.5, zorder=2)
        set_box(axes, path, VIEWS[name])
        draw_notes(axes, name, path, shown)
    file.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(file, dpi=130)
    plt.close(figure)


def animate(paths: Mapping[str, Frames], file: Path) -> None:
    """All frames of both paths, one after the other; the last of each is held."""
    figure = plt.figure(figsize=(8.0, 4.0), layout="constrained")
    order = [
        (name, min(n, len(path["pressure"]) - 1))
        for name, path in paths.items()
        for n in range(len(path["pressure"]) + HOLD)
    ]

    def draw(step: int) -> list[plt.Axes]:
        name, n = order[step]
        figure.clear()
        path = paths[name]
        body = figure.add_subplot(1, 2, 1, projection="3d", computed_zorder=False)
        draw_body(body, path, n)
        set_box(body, path, VIEWS[name])
        curve = figure.add_subplot(1, 2, 2)
        draw_curve(curve, name, path, n)
        pressures = ", ".join(f"{1e-3 * p:.1f}" for p in path["pressure"][n])
        curve.set_title(f"{pressures} kPa", fontsize=10)
        return [body, curve]

    moving = FuncAnimation(figure, draw, frames=len(order), blit=False)
    file.parent.mkdir(parents=True, exist_ok=True)
    moving.save(file, writer=PillowWriter(fps=FRAMES_A_SECOND), dpi=DOTS_PER_INCH)
    plt.close(figure)


if __name__ == "__main__":
    main()
