"""The paper's Figs 12 to 15: angle and plane with one chamber and with two, at ψ = 0.

Run as ``python examples/07_one_and_two_chambers.py [PICTURE]``. Circles are the finite-element cell, squares
the full actuator, lines the rod on each of its branches. In the cell chamber 3 alone and the pair 3+1 are the
mirror images of chamber 2 and of the pair 1+2.
"""

import sys
from pathlib import Path

import jax
from figures.comparison import print_table, series, winding
from figures.panels import COLOURS, IMAGES, add_legend, draw, draw_errors, save
from matplotlib.figure import Figure


def main(picture: Path) -> None:
    """Draw the panels and print the table."""
    jax.config.update("jax_enable_x64", True)  # the precision is the program's to choose
    helix = winding("double-helix")
    groups = {
        "one chamber": [
            series("psi0", "chamber 1", helix, (1.0, 0.0, 0.0)),
            series("psi60", "chamber 2", helix, (0.0, 1.0, 0.0), turned_deg=120.0),
            series("psi60", "chamber 3", helix, (0.0, 0.0, 1.0), turned_deg=240.0, mirrored=True),
        ],
        "two chambers": [
            series("psi0-pair12", "chambers 1+2", helix, (1.0, 1.0, 0.0)),
            series("psi0-pair23", "chambers 2+3", helix, (0.0, 1.0, 1.0)),
            series("psi0-pair12", "chambers 3+1", helix, (1.0, 0.0, 1.0), mirrored=True),
        ],
    }
    figure = Figure(figsize=(10.0, 8.0), layout="constrained")
    axes = figure.subplots(3, 2, sharex="col", height_ratios=(3, 3, 1.2))
    for column, (title, drawn) in enumerate(groups.items()):
        angle, plane, error = axes[:, column]
        for colour, one in zip(COLOURS, drawn, strict=True):
            draw(angle, one, colour, "angle")
            draw(plane, one, colour, "plane")
            draw_errors(error, one, colour)
        angle.set_title(title, fontsize=10)
        angle.legend(fontsize=8, loc="upper left")
        plane.set_ylim(-20.0, 380.0)
        error.set_xlabel("pressure [kPa]")
        for panel in axes[:, column]:
            panel.grid(alpha=0.3)
        print(title)
        print_table(drawn, (20, 30, 40, 45, 50, 60, 65, 70) if column == 0 else (20, 30, 40, 45, 50, 55, 57))
    for panel, label in zip(
        axes[:, 0], ("bending angle [deg]", "bending plane [deg]", "rod − FEM [deg]"), strict=True
    ):
        panel.set_ylabel(label)
    add_legend(figure)
    save(figure, picture)


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else IMAGES / "one_and_two_chambers.png")
