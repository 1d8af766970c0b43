"""A run that is stopped, by SIGKILL or Ctrl-C, and started again ends as one that was left alone."""

import contextlib
import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import psutil
import pytest

from calibration.sweep import attributes, load_dataset
from calibration.sweep.path_file import read_path

WAIT = 300.0
KILL, INTERRUPT = signal.SIGKILL, signal.SIGINT

# Workers begin with the script too, so that they have its mesh.
ACTUATOR = """
import sys
import fem_reference.cli._actuator
from fem_reference import LEVELS, ActuatorGeometry, Design
from fem_reference.cli import main
from tests.fem_fixtures import TINY

LEVELS["coarse"] = TINY
SHORT = ActuatorGeometry(body_length=9e-3, cap_length=3e-3)
fem_reference.cli._actuator.design_of = lambda options: Design(geometry=SHORT)
fem_reference.cli._actuator._STEP = 1e-3

if __name__ == "__main__":
    sys.exit(main(["actuator", "--pressure-kpa", "8", "4", "0", "--run", sys.argv[1], "--json"]))
"""

SWEEP = """
import sys
from calibration.cli import main
from fem_reference import LEVELS
from tests.fem_fixtures import TINY

LEVELS["coarse"] = TINY

if __name__ == "__main__":
    sizes = ["--elements", "coarse", "--paths", "2", "--workers", "1", "--pressure-max-kpa", "12", "12", "12"]
    sys.exit(main(["run", "--out", sys.argv[1], *sizes, "--moment-max-nmm", "1", "--torque-max-nmm", "1"]))
"""


# A shell's background jobs ignore Ctrl-C, and so does what they start, unless it is told otherwise.
FOREGROUND = """
import os, signal, sys

signal.signal(signal.SIGINT, signal.SIG_DFL)
os.execv(sys.executable, [sys.executable, *sys.argv[1:]])
"""


def start(script: Path, directory: Path) -> subprocess.Popen:
    """The script in a process group of its own, as a terminal's foreground."""
    root = Path(__file__).parents[4]
    return subprocess.Popen(
        [sys.executable, "-c", FOREGROUND, script, directory],
        cwd=root,
        start_new_session=True,
        env={**os.environ, "PYTHONPATH": str(root), "OMP_NUM_THREADS": "1"},
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )


def ended(script: Path, directory: Path) -> dict[str, object]:
    """Let the script end, and return the object that it prints, if any."""
    process = start(script, directory)
    out, err = process.communicate(timeout=WAIT)
    assert process.returncode == 0, err
    return json.loads(out) if out.startswith("{") else {}


def stop_when(process: subprocess.Popen, begun, how: signal.Signals) -> None:
    """Stop the process as soon as ``begun()`` holds; it must not have ended by itself before.

    SIGKILL comes to it alone, Ctrl-C to all of its group. Either way none of its processes is left.
    """
    deadline = time.monotonic() + WAIT
    while not begun():
        assert process.poll() is None, process.communicate()[1]
        assert time.monotonic() < deadline, "the run did not begin"
        time.sleep(0.01)
    # Nothing moves on while its processes are listed.
    os.killpg(process.pid, signal.SIGSTOP)
    family = psutil.Process(process.pid).children(recursive=True)
    if how == signal.SIGKILL:
        process.kill()
    else:
        os.killpg(process.pid, how)
    with contextlib.suppress(ProcessLookupError):
        os.killpg(process.pid, signal.SIGCONT)
    _, err = process.communicate(timeout=WAIT)
    if how == signal.SIGKILL:
        assert process.returncode == -signal.SIGKILL
    else:
        assert process.returncode == 130, err
        assert "interrupted" in err
        assert err.count("\n") == 1, err
    assert psutil.wait_procs(family, timeout=WAIT)[1] == []


@pytest.fixture(scope="module")
def script(tmp_path_factory):
    folder = tmp_path_factory.mktemp("scripts")

    def write(text: str) -> Path:
        file = folder / f"script_{len(text)}.py"
        file.write_text(text)
        return file

    return write


@pytest.fixture(scope="module")
def actuator(script, tmp_path_factory):
    """A run of the actuator that was left alone, and what it printed."""
    directory = tmp_path_factory.mktemp("actuator") / "run"
    told = ended(script(ACTUATOR), directory)
    # Enough for a run to be stopped on the way.
    assert len(list(directory.glob("step_*.json"))) == 8
    return directory, told


@pytest.fixture(scope="module")
def sweep(script, tmp_path_factory):
    """A run directory of a sweep that was left alone."""
    directory = tmp_path_factory.mktemp("sweep") / "run"
    ended(script(SWEEP), directory)
    return directory


# Ctrl-C takes as long again.
@pytest.mark.parametrize("how", [KILL, pytest.param(INTERRUPT, marks=pytest.mark.slow)])
def test_a_stopped_run_of_the_actuator_ends_as_one_left_alone(script, actuator, tmp_path, how):
    whole, told = actuator
    cut = tmp_path / "run"
    stop_when(start(script(ACTUATOR), cut), (cut / "step_0002.json").exists, how)
    assert len(list(cut.glob("step_*.json"))) < 8
    before = (cut / "step_0001.json").stat().st_mtime_ns
    again = ended(script(ACTUATOR), cut)
    # What was finished was not done again.
    assert (cut / "step_0001.json").stat().st_mtime_ns == before
    assert sorted(file.name for file in cut.iterdir()) == sorted(file.name for file in whole.iterdir())
    # The Newton iterations end at residual forces of 1e-9 N.
    np.testing.assert_allclose(again["tip_position_mm"], told["tip_position_mm"], atol=1e-6)
    for name in sorted(file.name for file in whole.glob("step_*.json")):
        a, b = (json.loads((run / name).read_text()) for run in (whole, cut))
        np.testing.assert_allclose(b["tip_position_mm"], a["tip_position_mm"], atol=1e-6)


# Fast tests cut a sweep's files, interrupt its processes and go on, in `unit/calibration`:
# `sweep/test_sweep.py`, `sweep/test_workers.py` and `cli/test_commands.py`.
@pytest.mark.slow
@pytest.mark.parametrize("how", [INTERRUPT, KILL])
def test_a_stopped_sweep_ends_as_one_left_alone(script, sweep, tmp_path, how):
    cut = tmp_path / "run"
    paths = sorted(file.name for file in (sweep / "paths").iterdir())
    first, second = (cut / "paths" / name for name in paths)
    stop_when(start(script(SWEEP), cut), lambda: len(read_path(second).states) >= 1, how)
    finished = read_path(first)
    assert finished.end == {"attempts": 1}
    assert read_path(second).end is None
    ended(script(SWEEP), cut)
    assert read_path(first) == finished
    whole, resumed = (load_dataset(run / "dataset.nc") for run in (sweep, cut))
    assert sorted(file.name for file in cut.iterdir()) == ["dataset.nc", "paths", "run.json"]
    # Traced again from rest, by the same iterations; only the directory's name and the time are others.
    for name in set(whole.data_vars) - {"seconds"}:
        if whole[name].dtype.kind == "f":
            np.testing.assert_allclose(resumed[name], whole[name], rtol=1e-9, atol=1e-9)
        else:
            np.testing.assert_array_equal(resumed[name], whole[name])
    expected, found = attributes(whole), attributes(resumed)
    assert expected.pop("command").replace(str(sweep), str(cut)) == found.pop("command")
    assert found == expected
