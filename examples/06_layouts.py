"""The paper's Fig. 9: rings and six helices beside the double helix.

Run as ``python examples/06_layouts.py [PICTURE]``. Points are the finite-element cell, lines the rod.
"""

import sys
from pathlib import Path

import jax
from comparison import IMAGES, angle_figure, draw_angles, print_table, rod_of, save, series


def main(picture: Path) -> None:
    """Draw the panels and print the table."""
    jax.config.update("jax_enable_x64", True)  # the precision is the program's to choose
    first, second = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0)
    helix = rod_of("double-helix")
    groups = {
        "double helix, ψ = 0": [
            series("psi0", "chamber 1", helix, first),
            series("psi60", "chambers 2, 3", helix, second),
        ],
        "rings": [series("ring", "all chambers", rod_of("ring"), first)],
        "six helices": [series("six-helix", "all chambers", rod_of("six-helix"), first)],
    }
    figure, panels = angle_figure(len(groups))
    for panel, (title, drawn) in zip(panels, groups.items(), strict=True):
        draw_angles(panel, drawn, title)
        panel[0].legend(fontsize=8)
        print(title)
        print_table(drawn, (20, 40, 50, 60, 70))
    save(figure, picture)


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else IMAGES / "layouts.png")
