"""The core timed inside C: `core_loop.c`, compiled as CMake compiles the core, called in cffi's ABI mode."""

import re
import subprocess
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from cffi import FFI

from rodmodel.core import CoreRod
from tests.benchmark.timing.clock import ROUNDS
from tests.benchmark.timing.figures import KEPT, ROOT

_SOURCE = Path(__file__).with_suffix(".c")
_CORE = ROOT / "rodmodel" / "core"
_COMPILER = ROOT / ".venv" / ".compiler"
_FOLDERS = (_CORE / "src", *sorted(path for path in (_CORE / "src").iterdir() if path.is_dir()))
# What CMake adds for the release build and the standard that CMakeLists.txt asks for.
_ALWAYS = ("-O3", "-DNDEBUG", "-std=c99", "-fPIC", "-shared")

_FFI = FFI()
_FFI.cdef(
    """
    int loop_solves(const void *rod, const void *inputs, int count, const void *options, int warm,
                    int with_jacobian, void *workspace, double *seconds);
    double loop_sums(const void *rod, const void *inputs, int count, int passes, void *memory,
                     double *seconds);
    """
)


def flags(name: str) -> list[str]:
    """Flags that CMakeLists.txt sets under a name; none where it sets none."""
    found = re.search(rf"^set\({name}_flags (.*)\)$", (_CORE / "CMakeLists.txt").read_text(), re.MULTILINE)
    return found[1].split() if found else []


@cache
def library(variant: str) -> Any:
    """Return the compiled loops for one set of instructions."""
    compiler = _COMPILER.read_text().strip() if _COMPILER.exists() else "cc"
    KEPT.mkdir(parents=True, exist_ok=True)
    target = KEPT / f"core_loop_{variant}.so"
    options = [*_ALWAYS, *flags("core"), *flags(variant), *(f"-I{folder}" for folder in _FOLDERS)]
    subprocess.run([compiler, *options, str(_SOURCE), "-o", str(target), "-lm"], check=True)
    return _FFI.dlopen(str(target))


class CoreLoop:
    """Loops over many inputs of one rod.

    Parameters
    ----------
    rod : to be solved.
    variant : set of instructions, of `rodmodel.core.VARIANTS`.
    options : of the core.
    steps : as the options have them.
    """

    def __init__(self, rod: CoreRod, variant: str, options: Any, steps: int) -> None:
        self._rod, self._options, self._library = rod, options, library(variant)
        self._workspace = rod.handle.workspace(steps, with_jacobian=True)

    def solve(self, inputs: np.ndarray, warm: bool = False, with_jacobian: bool = False) -> float:
        """Median time of a solve in the quietest round [s]; all must succeed."""

        def run(seconds: Any) -> None:
            arguments = self._rod.handle.rod, _pointer(inputs), len(inputs), self._options
            good = self._library.loop_solves(*arguments, warm, with_jacobian, self._workspace, seconds)
            if good != len(inputs):
                raise RuntimeError(f"loop_solves: got {good} solutions, expected {len(inputs)}")

        return _quietest(run, len(inputs))

    def sums(self, inputs: np.ndarray, passes: int) -> float:
        """Median time of the law alone in the quietest round [s]: its pressures, and so many sums."""

        def run(seconds: Any) -> None:
            arguments = self._rod.handle.rod, _pointer(inputs), len(inputs)
            self._library.loop_sums(*arguments, passes, self._workspace, seconds)

        return _quietest(run, len(inputs))


def _quietest(run: Any, count: int) -> float:
    medians = []
    for _ in range(ROUNDS):
        seconds = np.empty(count)
        run(_FFI.from_buffer("double *", seconds))
        medians.append(float(np.median(seconds)))
    return min(medians)


def _pointer(rows: np.ndarray) -> Any:
    return _FFI.from_buffer("void *", rows)
