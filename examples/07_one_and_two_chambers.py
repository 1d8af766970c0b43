"""The paper's Figs 12 to 15: angle and plane with one chamber and with two, at ψ = 0.

Run as ``python examples/07_one_and_two_chambers.py [PICTURE]``. Points are the finite-element cell, lines the
rod. Chamber 3 alone and the pair 3+1 are the mirror images of chamber 2 and of the pair 1+2.
"""

import sys
from pathlib import Path

import jax
import numpy as np
from comparison import COLOURS, IMAGES, print_table, rod_of, save, series
from matplotlib.figure import Figure


def main(picture: Path) -> None:
    """Draw the panels and print the table."""
    jax.config.update("jax_enable_x64", True)  # the precision is the program's to choose
    rod = rod_of("double-helix")
    groups = {
        "one chamber": [
            series("psi0", "chamber 1", rod, (1.0, 0.0, 0.0)),
            series("psi60", "chamber 2", rod, (0.0, 1.0, 0.0), turned_deg=120.0),
            series("psi60", "chamber 3", rod, (0.0, 0.0, 1.0), turned_deg=240.0, mirrored=True),
        ],
        "two chambers": [
            series("psi0-pair12", "chambers 1+2", rod, (1.0, 1.0, 0.0)),
            series("psi0-pair23", "chambers 2+3", rod, (0.0, 1.0, 1.0)),
            series("psi0-pair12", "chambers 3+1", rod, (1.0, 0.0, 1.0), mirrored=True),
        ],
    }
    figure = Figure(figsize=(10.0, 7.5), layout="constrained")
    axes = figure.subplots(3, 2, sharex="col", height_ratios=(3, 3, 1))
    for column, (title, drawn) in enumerate(groups.items()):
        angle, plane, error = axes[:, column]
        for colour, one in zip(COLOURS, drawn, strict=True):
            after = np.cumsum(one.jumped) > 0
            for panel, points, curve in (
                (angle, one.angle, one.curve_angle),
                (plane, one.plane, one.curve_plane),
            ):
                # A plane of 0 may come out as 360 degrees.
                here, along = (points, curve) if panel is angle else map(_continuous, (points, curve))
                panel.plot(one.pressure[~after], here[~after], "o", color=colour, ms=4)
                panel.plot(one.pressure[after], here[after], "o", color=colour, ms=4, mfc="none")
                panel.plot(one.curve_pressure, along, color=colour, lw=1.5, label=one.label)
            error.plot(one.pressure, one.error, "o-", color=colour, ms=3, lw=0.8)
        angle.set_title(title, fontsize=10)
        angle.legend(fontsize=8)
        plane.set_ylim(-20.0, 380.0)
        error.set_xlabel("pressure [kPa]")
        for panel in axes[:, column]:
            panel.grid(alpha=0.3)
        print(title)
        print_table(drawn, (20, 30, 40, 50, 60))
    for panel, label in zip(
        axes[:, 0], ("bending angle of 60 mm [deg]", "bending plane [deg]", "rod − FEM [deg]"), strict=True
    ):
        panel.set_ylabel(label)
    save(figure, picture)


def _continuous(plane: np.ndarray) -> np.ndarray:
    """A plane near 360° drawn near 0°."""
    return np.where(plane > 350.0, plane - 360.0, plane)


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else IMAGES / "one_and_two_chambers.png")
