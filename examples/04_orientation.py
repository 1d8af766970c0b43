"""The paper's Fig. 5: bending angle against pressure for five orientations of the winding.

Run as ``python examples/04_orientation.py [PICTURE]``. Circles are the finite-element cell, squares the full
actuator, lines the rod on each of its branches, as far as its calibration goes.
"""

import sys
from pathlib import Path

import jax
from figures.comparison import print_table, series, winding
from figures.panels import IMAGES, add_legend, angle_figure, draw_angles, save

ORIENTATIONS_DEG = (0, 30, 45, 60, 90)


def main(picture: Path) -> None:
    """Draw the panels and print the table."""
    jax.config.update("jax_enable_x64", True)  # the precision is the program's to choose
    figure, panels = angle_figure(len(ORIENTATIONS_DEG))
    for panel, psi in zip(panels, ORIENTATIONS_DEG, strict=True):
        wound, drawn = winding("double-helix", psi), []
        for chamber in range(3):
            # From the chamber's centre to the nearest crossing, whose chamber 1 stands for it.
            away = abs((120 * chamber - psi + 90) % 180 - 90)
            way = [float(k == chamber) for k in range(3)]
            drawn.append(series(f"psi{away}", f"chamber {chamber + 1}, ψ' {away}°", wound, way))
        draw_angles(panel, drawn, f"ψ = {psi}°")
        print(f"psi = {psi} deg")
        print_table(drawn, (20, 40, 45, 50, 60, 70))
    add_legend(figure)
    save(figure, picture)


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else IMAGES / "orientation.png")
