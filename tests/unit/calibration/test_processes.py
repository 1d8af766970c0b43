"""Work in processes: done, failed, or out of time."""

import os
import signal
import subprocess
import sys
import time
from collections.abc import Sequence
from pathlib import Path

import pytest

from calibration.processes import Job, JobError, run_jobs


def write(file: Path) -> None:
    file.write_text("done")


def fail() -> None:
    raise SystemExit(7)


def write_mask(file: Path) -> None:
    file.write_text(str(signal.SIGINT in signal.pthread_sigmask(signal.SIG_BLOCK, [])))


# The first process of a program begins a tracker of resources, which unblocks signals.
FIRST = """
import sys
from pathlib import Path
from calibration.processes import Job, run_jobs
from tests.unit.calibration.test_processes import write_mask

if __name__ == "__main__":
    for name in sys.argv[1:]:
        run_jobs([Job("job", write_mask, (Path(name),))], 1, lambda names: None)
"""


def test_every_process_ignores_an_interrupt_the_first_too(tmp_path: Path) -> None:
    script, files = tmp_path / "script.py", [tmp_path / name for name in "ab"]
    script.write_text(FIRST)
    root = Path(__file__).parents[3]
    environment = {**os.environ, "PYTHONPATH": str(root)}
    subprocess.run([sys.executable, script, *files], cwd=root, env=environment, check=True)
    assert [file.read_text() for file in files] == ["True", "True"]


def test_all_jobs_are_done_in_fewer_processes_than_jobs(tmp_path: Path) -> None:
    files = [tmp_path / name for name in "abc"]
    seen: list[Sequence[str]] = []
    # Two meshes of one's own counts have the same name.
    jobs = [Job(name, write, (file,)) for name, file in zip(("one", "one", "two"), files, strict=True)]
    assert run_jobs(jobs, 2, lambda names: seen.append(list(names))) == ()
    assert [file.read_text() for file in files] == ["done"] * 3
    assert max(len(names) for names in seen) <= 2


def test_a_job_that_fails_is_told_by_name() -> None:
    with pytest.raises(JobError, match="the process of second ended with 7"):
        run_jobs([Job("second", fail, ())], 1, lambda names: None)


def test_jobs_that_have_no_time_are_named_and_their_processes_end() -> None:
    begun = time.monotonic()
    jobs = [Job("long", time.sleep, (600.0,)), Job("waiting", time.sleep, (600.0,))]
    assert run_jobs(jobs, 1, lambda names: None, limit=0.1) == ("long", "waiting")
    assert time.monotonic() - begun < 60.0
