"""A run that is killed outright, with SIGKILL, and started again ends as one that was left alone."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

from calibration.path_file import read_path
from fem_reference.actuator_run import ActuatorRun

WAIT = 300.0

ACTUATOR = """
import sys
from fem_reference import Actuator, ActuatorGeometry, ActuatorLoad
from fem_reference.actuator_run import ActuatorRun
from tests.fem_fixtures import TINY

if __name__ == "__main__":
    actuator = Actuator(ActuatorGeometry(body_length=9e-3, cap_length=3e-3), level=TINY)
    loads = [ActuatorLoad((p, 0.5 * p, 0.0)) for p in (1e3, 2e3, 3e3, 4e3)]
    list(ActuatorRun(sys.argv[1], {"case": 1}).states(actuator, loads))
"""

SWEEP = """
import sys
from pathlib import Path
from calibration.design import LoadingPath
from calibration.sweep import run_sweep
from calibration.tracing import CellTracer
from fem_reference import ActuatorGeometry, DoubleHelix, Load
from tests.fem_fixtures import TINY

if __name__ == "__main__":
    paths = [
        LoadingPath(f"{k:03d}", "train", tuple(Load((1e3 * p, 1e3 * k, 0.0)) for p in (1, 2, 3, 4)))
        for k in range(2)
    ]
    run_sweep(CellTracer(ActuatorGeometry(), DoubleHelix(), TINY), paths, Path(sys.argv[1]), workers=1)
"""


def start(script: Path, directory: Path) -> subprocess.Popen:
    """The script in a process group of its own, so that its workers are killed with it."""
    root = Path(__file__).parents[3]
    return subprocess.Popen(
        [sys.executable, script, directory], cwd=root, start_new_session=True, env=_env(root)
    )


def _env(root: Path) -> dict[str, str]:
    return {**os.environ, "PYTHONPATH": str(root), "OMP_NUM_THREADS": "1"}


def kill_when(process: subprocess.Popen, begun) -> None:
    """Kill the process as soon as ``begun()`` holds; it must not have ended by itself before."""
    deadline = time.monotonic() + WAIT
    while not begun():
        assert process.poll() is None, "the run ended before it could be killed"
        assert time.monotonic() < deadline, "the run did not begin"
        time.sleep(0.01)
    os.killpg(process.pid, signal.SIGKILL)
    assert process.wait(WAIT) == -signal.SIGKILL


@pytest.fixture
def script(tmp_path):
    def write(text: str) -> Path:
        file = tmp_path / "script.py"
        file.write_text(text)
        return file

    return write


def test_a_killed_run_of_the_actuator_ends_as_one_left_alone(script, tmp_path):
    file = script(ACTUATOR)
    assert start(file, tmp_path / "whole").wait(WAIT) == 0
    kill_when(start(file, tmp_path / "cut"), lambda: (tmp_path / "cut" / "step_0002.json").exists())
    kept = len(ActuatorRun(tmp_path / "cut", {"case": 1}).records())
    assert 2 <= kept < 4
    before = (tmp_path / "cut" / "step_0001.json").stat().st_mtime_ns
    assert start(file, tmp_path / "cut").wait(WAIT) == 0
    # What was finished was not done again.
    assert (tmp_path / "cut" / "step_0001.json").stat().st_mtime_ns == before
    whole, cut = (ActuatorRun(tmp_path / name, {"case": 1}).records() for name in ("whole", "cut"))
    assert len(cut) == len(whole) == 4
    for a, b in zip(whole, cut, strict=True):
        # The Newton iterations end at residual forces of 1e-9 N.
        np.testing.assert_allclose(b["tip_position_mm"], a["tip_position_mm"], atol=1e-6)


def test_a_killed_sweep_ends_as_one_left_alone(script, tmp_path):
    file = script(SWEEP)
    assert start(file, tmp_path / "whole").wait(WAIT) == 0
    second = tmp_path / "cut" / "paths" / "001.jsonl"
    kill_when(start(file, tmp_path / "cut"), lambda: len(read_path(second).states) >= 2)
    finished = read_path(tmp_path / "cut" / "paths" / "000.jsonl")
    assert finished.end == {"attempts": 1}
    assert read_path(second).end is None
    assert start(file, tmp_path / "cut").wait(WAIT) == 0
    assert read_path(tmp_path / "cut" / "paths" / "000.jsonl") == finished
    for name in ("000", "001"):
        whole, cut = (read_path(tmp_path / run / "paths" / f"{name}.jsonl") for run in ("whole", "cut"))
        assert cut.end == whole.end
        for a, b in zip(whole.states, cut.states, strict=True):
            assert a["pressure"] == b["pressure"]
            # Traced again from rest, by the same iterations.
            np.testing.assert_allclose(b["curvature"], a["curvature"], atol=1e-6)
