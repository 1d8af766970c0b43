"""The paper's Fig. 7: bending angle against pressure for pitches of 2, 3 and 4 mm.

Run as ``python examples/05_pitch.py [PICTURE]``. Circles are the finite-element cell, squares the full
actuator, lines the rod on each of its branches, as far as its calibration goes.
"""

import sys
from pathlib import Path

import jax
from figures.comparison import print_table, series, winding
from figures.panels import IMAGES, add_legend, angle_figure, draw_angles, save

PITCHES_MM = (2, 3, 4)


def main(picture: Path) -> None:
    """Draw the panels and print the table."""
    jax.config.update("jax_enable_x64", True)  # the precision is the program's to choose
    figure, panels = angle_figure(len(PITCHES_MM))
    for panel, pitch in zip(panels, PITCHES_MM, strict=True):
        wound = winding("double-helix", 0, pitch)
        # Chambers 2 and 3 are 60 degrees from a crossing: alike.
        names = ("psi0", "psi60") if pitch == 3 else (f"pitch{pitch}-psi0", f"pitch{pitch}-psi60")
        drawn = [
            series(names[0], "chamber 1", wound, (1.0, 0.0, 0.0)),
            series(names[1], "chambers 2, 3", wound, (0.0, 1.0, 0.0)),
        ]
        draw_angles(panel, drawn, f"pitch {pitch} mm")
        print(f"pitch {pitch} mm" + ("" if wound.rod else ": no calibration ships, points alone"))
        print_table(drawn, (20, 40, 45, 50, 60, 70))
    add_legend(figure)
    save(figure, picture)


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else IMAGES / "pitch.png")
