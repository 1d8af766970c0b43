"""A controller made from a calibration that was adjusted to measurements gives the rod's numbers."""

import re
from pathlib import Path

import numpy as np

from rodmodel.core import CoreRod
from rodmodel.core.export import export
from rodmodel.io import Adjustment, adjusted, find, save_calibration
from tests.verification.core.toolchain import C99, CORE, build, compiler, output, table

STEPS = 8  # of the example


def test_the_exported_example_prints_the_numbers_of_the_adjusted_rod(tmp_path: Path):
    mine = Adjustment(
        1.2, np.array([1.05, 0.93, 0.97]), np.array([600.0, -400.0, 300.0]), np.array([0.15, 0.0, -0.1])
    )
    figures = {"measured_angle_rad": {"median": 0.01, "p90": 0.05, "worst": 0.06}}
    file = tmp_path / "mine.json"
    save_calibration(adjusted(find("double-helix", 0.0, 3e-3), mine, figures, {}), file)
    of_mine = find("double-helix", 0.0, 3e-3, file)
    export(of_mine, tmp_path / "rod")
    (written,) = re.findall(r"\.angle = \{(.*?)\}", (tmp_path / "rod" / "law.c").read_text())
    bounds = [float(number) for number in re.findall(r"N\((.*?)\)", written)]
    assert bounds[0] == 0.05
    assert min(bounds) == 0.05
    program = build(tmp_path / "rod", compiler("gcc"), *C99, "-O0", sources=("main.c", *CORE), out="example")
    rows, rod = table(output(program)), CoreRod.of(of_mine)
    assert rows["failures"] == 0
    unloaded = rows["predict"][:3]
    for row in unloaded:
        solution = rod.solve(row[:3], steps=STEPS)
        np.testing.assert_allclose(row[3:6], solution.tip_position, rtol=0, atol=0.066e-12)
        assert abs(row[6] - solution.bending_angle) < 1e-12
    # Nothing is read, and yet it bends.
    assert unloaded[0, 6] > 1e-3
