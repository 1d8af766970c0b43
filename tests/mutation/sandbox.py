"""A copy of the tree in which one module has a fault, and the verdict of the tests there."""

import os
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
# A fault may make an iteration longer, and an endless one must end; the least is for the import of JAX.
_SLOWER, _LEAST = 3.0, 30.0


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

    def judge(self, subject: Subject, source: str, limit: float | None = None) -> Verdict:
        """Run a subject's tests, up to the first that fails, with this text as its module."""
        module = self.folder / subject.module
        good = module.read_text()
        module.write_text(source)
        try:
            return self._run(subject.tests, limit)
        finally:
            module.write_text(good)

    def limit(self, subject: Subject) -> float:
        """Longest time that a mutant is given [s].

        Raises
        ------
        SandboxError
            Where the tests fail without a fault, or pass without the module.
        """
        source = (self.folder / subject.module).read_text()
        sound = self.judge(subject, source)
        if sound.outcome != "survived":
            raise SandboxError(f"{subject.module}: its tests fail without a fault: {' '.join(subject.tests)}")
        absent = f"raise ImportError({subject.module!r})\n"
        if self.judge(subject, absent).outcome != "killed":
            raise SandboxError(f"{subject.module}: its tests pass without it: {' '.join(subject.tests)}")
        return max(_LEAST, _SLOWER * sound.seconds)

    def _run(self, tests: tuple[str, ...], limit: float | None) -> Verdict:
        # No bytecode: that of the last mutant has the size and, within a second, the time of the next one.
        environment = os.environ | {"PYTHONDONTWRITEBYTECODE": "1"}
        command = [sys.executable, "-m", "pytest", "-x", "-q", "-p", "no:cacheprovider", *tests]
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
        try:
            status = run.wait(limit)
        except subprocess.TimeoutExpired:
            return Verdict("timeout", time.monotonic() - begin)
        finally:
            # With what the tests have started; nothing is left where they have ended.
            if run.poll() is None:
                os.killpg(run.pid, signal.SIGKILL)
                run.wait()
        return Verdict("killed" if status else "survived", time.monotonic() - begin)
