"""The paper's Table IV: deviation of the model from measured bending, beside that of a file of your own.

Run as ``python examples/09_against_measurement.py [CSV]``. The columns of the file are those of
docs/measured_template.csv, which it takes if none is given: its rows were made by the model with noise, so
what comes out is the noise, and not an experiment.
"""

import sys
from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np

import rodmodel
from calibration.measured import ANGLE, PLANE, Measured, read_measured

TEMPLATE = Path(__file__).parents[1] / "docs" / "measured_template.csv"
#: Robotica (2023), Table IV: root mean square of the deviation of its FEM from its experiment, of θ and γ
#: [deg], by the chambers under pressure. It gives none of γ for single chambers.
PUBLISHED: dict[tuple[int, ...], tuple[float, float | None]] = {
    (1,): (3.1, None),
    (2,): (16.8, None),
    (3,): (15.9, None),
    (1, 2): (4.6, 3.0),
    (2, 3): (6.5, 3.5),
    (1, 3): (5.6, 7.8),
}


def deviations(measured: Measured, rod: rodmodel.Rod) -> dict[tuple[int, ...], tuple[float, float, int]]:
    """Root mean square of predicted less measured θ and γ [deg], and the number of rows, by chambers."""
    solve = jax.jit(jax.vmap(lambda p: rod.solve(p, throw=False)))
    solution = solve(jnp.asarray(measured.pressure))
    predicted = {ANGLE: solution.bending_angle, PLANE: solution.bending_plane}
    groups = [tuple(int(k) + 1 for k in np.flatnonzero(row > 0.0)) for row in measured.pressure]
    found = {}
    for group in sorted(set(groups), key=lambda g: (len(g), g)):
        rows = [n for n, other in enumerate(groups) if other == group]
        squares = []
        for name in (ANGLE, PLANE):
            if name not in measured.outputs:
                squares.append(np.nan)
                continue
            off = np.asarray(predicted[name])[rows] - measured.values[rows, measured.outputs.index(name)]
            if name == PLANE:
                off = (off + np.pi) % (2.0 * np.pi) - np.pi
            squares.append(float(np.degrees(np.sqrt(np.mean(off**2)))))
        found[group] = (squares[0], squares[1], len(rows))
    return found


def main(file: Path) -> None:
    """Print the table."""
    jax.config.update("jax_enable_x64", True)  # the precision is the program's to choose
    rod = rodmodel.load("double-helix")
    found = deviations(read_measured(file, rod.domain), rod)
    print(f"{'':12s} {'paper: θ':>10s} {'γ':>6s}   {file.name + ': θ':>28s} {'γ':>6s}  rows    [deg]")
    for group in sorted({*PUBLISHED, *found}, key=lambda g: (len(g), g)):
        theirs, ours = PUBLISHED.get(group, (None, None)), found.get(group)
        cells = [_cell(theirs[0], 10), _cell(theirs[1], 6)]
        cells += ["", _cell(ours and ours[0], 28), _cell(ours and ours[1], 6), f"{ours[2] if ours else 0:5d}"]
        print(f"chambers {'+'.join(map(str, group)):3s} " + " ".join(cells))


def _cell(value: float | None, width: int) -> str:
    return f"{'–' if value is None or np.isnan(value) else f'{value:.1f}':>{width}s}"


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else TEMPLATE)
