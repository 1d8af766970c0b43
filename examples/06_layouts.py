"""The paper's Fig. 9: rings and six helices beside the double helix.

Run as ``python examples/06_layouts.py [PICTURE]``. Circles are the finite-element cell, squares the full
actuator, lines the rod on each of its branches, as far as its calibration goes.
"""

import sys
from pathlib import Path

import jax
from figures.comparison import print_table, series, winding
from figures.panels import IMAGES, add_legend, angle_figure, draw_angles, save


def main(picture: Path) -> None:
    """Draw the panels and print the table."""
    jax.config.update("jax_enable_x64", True)  # the precision is the program's to choose
    first, second = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0)
    helix = winding("double-helix")
    groups = {
        "double helix, ψ = 0": [
            series("psi0", "chamber 1", helix, first),
            series("psi60", "chambers 2, 3", helix, second),
        ],
        "rings": [series("ring", "all chambers", winding("ring"), first)],
        "six helices": [series("six-helix", "all chambers", winding("six-helix"), first)],
    }
    figure, panels = angle_figure(len(groups))
    for panel, (title, drawn) in zip(panels, groups.items(), strict=True):
        draw_angles(panel, drawn, title)
        print(title)
        print_table(drawn, (20, 40, 45, 50, 60, 70))
    add_legend(figure)
    save(figure, picture)


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else IMAGES / "layouts.png")
