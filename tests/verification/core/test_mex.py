"""The MEX function in Octave: the numbers of Python, and complaints instead of crashes."""

import os
import subprocess
from pathlib import Path

import numpy as np

from rodmodel.core import CoreRod
from tests.verification.core.toolchain import OWN, exported, found, needs

SCRIPT = """
[tip, bend, converged] = rodmodel_mex([20e3 5e3 0], [0 2e-3 0], [0 0 9.81]);
printf("%.17g ", tip, bend, converged); printf("\\n");
[tip, bend, converged] = rodmodel_mex([20e3 5e3 0]);
printf("%.17g ", tip, bend, converged); printf("\\n");
[tip, bend, converged] = rodmodel_mex([-1 0 0]);
printf("%.17g ", tip, bend, converged); printf("\\n");
try, rodmodel_mex([1 2]); catch e, printf("%s\\n", e.message); end
try, rodmodel_mex(); catch e, printf("%s\\n", e.message); end
"""


def test_octave_gets_the_numbers_of_python(tmp_path: Path):
    octave, mkoctfile = needs("octave-cli", "mkoctfile")
    folder = exported(tmp_path / "rod")
    line = [mkoctfile, "--mex", "rodmodel_mex.c", "rodmodel_core.c", "law.c"]
    # Optimised code has the tests of compilers.
    environment = os.environ | {"CFLAGS": "-O1"}
    done = subprocess.run(line, cwd=folder, env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    line = [octave, "--no-gui", "--norc", "--eval", SCRIPT]
    done = subprocess.run(line, cwd=folder, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    loaded, free, bad, two, none = done.stdout.splitlines()
    rod = CoreRod.of(found(OWN))
    for row, loads in ((loaded, {"tip_force": (0.0, 2e-3, 0.0), "gravity": (0.0, 0.0, 9.81)}), (free, {})):
        wanted = rod.solve([20e3, 5e3, 0.0], steps=8, **loads)
        numbers = [float(number) for number in row.split()]
        np.testing.assert_allclose(numbers, [*wanted.tip_position, *wanted.bend, 1.0], rtol=0, atol=1e-11)
    assert np.isnan([float(number) for number in bad.split()][:5]).all()
    assert bad.split()[5] == "0"
    assert "pressure: expected three real numbers [Pa]" in two
    assert "expected (pressure, tip_force, gravity)" in none
