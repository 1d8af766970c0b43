"""A copy of the tree in which one module has a fault, and the verdict of the tests there."""

import math
import os
import resource
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import NamedTuple

from tests.mutation.subjects import Subject

ROOT = Path(__file__).parents[2]
_COPIED = ("rodmodel", "fem_reference", "calibration", "tests")
# Sweeps and stored runs, which no test of a subject reads.
_LEFT_OUT = shutil.ignore_patterns("__pycache__", "*.nc")
# A fault may make an iteration longer, and an endless one must end. The limit is one of the processor's time,
# as other work on the machine is no fault; the least is for the import of JAX. What waits for ever needs no
# processor: its limit is on the clock, so many times longer.
_SLOWER, _LEAST, _WAITS = 3, 30, 20
# How a process ends whose time is up.
_STOPPED = (-signal.SIGXCPU, -signal.SIGKILL)


class Verdict(NamedTuple):
    """What the tests said of a module: ``survived``, ``killed`` or ``timeout``."""

    outcome: str
    seconds: float


class SandboxError(Exception):
    """The tests of a subject do not tell a good module from a bad one."""


class Sandbox:
    """Copy of the packages and the tests, extension included: the working tree is only read."""

    def __init__(self, folder: Path) -> None:
        for name in _COPIED:
            shutil.copytree(ROOT / name, folder / name, ignore=_LEFT_OUT)
        shutil.copy(ROOT / "pyproject.toml", folder)
        self.folder = folder

    def judge(self, subject: Subject, source: str, limit: int | None = None) -> Verdict:
        """Run a subject's tests, up to the first that fails, with this text as its module.

        Parameters
        ----------
        subject, source : the module, and what stands in its place.
        limit : of the processor's time [s].
        """
        module = self.folder / subject.module
        good = module.read_text()
        module.write_text(source)
        try:
            return self._run(subject, limit)
        finally:
            module.write_text(good)

    def limit(self, subject: Subject) -> int:
        """Longest time of the processor that a mutant is given [s]; nothing else may run in the meantime.

        Raises
        ------
        SandboxError
            Where the tests fail without a fault, or pass without the module.
        """
        source = (self.folder / subject.module).read_text()
        before = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime
        sound = self.judge(subject, source)
        taken = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime - before
        if sound.outcome != "survived":
            raise SandboxError(f"{subject.module}: its tests fail without a fault: {' '.join(subject.tests)}")
        absent = f"raise ImportError({subject.module!r})\n"
        if self.judge(subject, absent).outcome != "killed":
            raise SandboxError(f"{subject.module}: its tests pass without it: {' '.join(subject.tests)}")
        return max(_LEAST, _SLOWER * math.ceil(taken))

    def _run(self, subject: Subject, limit: int | None) -> Verdict:
        # No bytecode: that of the last mutant has the size and, within a second, the time of the next one.
        environment = os.environ | {"PYTHONDONTWRITEBYTECODE": "1"}
        command = [sys.executable, "-m", "pytest", "-x", "-q", "-p", "no:cacheprovider", *subject.tests]
        # What is named runs, also where it has been marked slow since.
        command += ["-m", ""]
        if subject.without is not None:
            command += ["-k", f"not {subject.without}"]
        begin = time.monotonic()
        run = subprocess.Popen(
            command,
            cwd=self.folder,
            env=environment,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            start_new_session=True,
        )
        if limit is not None:
            resource.prlimit(run.pid, resource.RLIMIT_CPU, (limit, limit))
        try:
            status = run.wait(None if limit is None else _WAITS * limit)
        except subprocess.TimeoutExpired:
            return Verdict("timeout", time.monotonic() - begin)
        finally:
            # With what the tests have started; nothing is left where they have ended.
            if run.poll() is None:
                os.killpg(run.pid, signal.SIGKILL)
                run.wait()
        outcome = "timeout" if status in _STOPPED else "killed" if status else "survived"
        return Verdict(outcome, time.monotonic() - begin)
