"""Compilers that this machine has, the folder that is exported, and the programs made of it."""

import importlib.util
import math
import os
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from rodmodel.core.export import export
from rodmodel.io import Found, find

HERE = Path(__file__).parent
WARNINGS = ("-Wall", "-Wextra", "-Wconversion", "-pedantic", "-Werror")
C99 = ("-std=c99", *WARNINGS)
CORE = ("rodmodel_core.c", "law.c")
#: Orientations of the double helix [deg]: one has a law of its own, the other is one of a law of all.
OWN, ANY = 0.0, 20.0


def found(psi_deg: float) -> Found:
    """Shipped calibration of the double helix."""
    return find("double-helix", math.radians(psi_deg), 3e-3)


def exported(folder: Path, psi_deg: float = OWN, single_precision: bool = False) -> Path:
    """Folder that `rodmodel export` writes of a shipped calibration."""
    export(found(psi_deg), folder, single_precision)
    return folder


def needs(*programs: str) -> list[str]:
    """Paths of programs; without one of them the test is skipped."""
    paths = [shutil.which(program) for program in programs]
    for program, path in zip(programs, paths, strict=True):
        if path is None:
            pytest.skip(f"{program} is not installed")
    return [path for path in paths if path is not None]


def compiler(name: str) -> list[str]:
    """Command of a compiler; without it the test is skipped."""
    if name != "zig":
        return needs(name)
    if importlib.util.find_spec("ziglang") is None:
        pytest.skip("ziglang is not installed")
    return [sys.executable, "-m", "ziglang", "cc"]


def build(folder: Path, command: list[str], *flags: str, sources: tuple[str | Path, ...], out: str) -> Path:
    """Compile sources of an exported folder, or beside this file, into a program. A warning fails."""
    # Zig keeps what it has built of the C library, for all tests.
    cache = str(Path(__file__).parents[3] / "build" / "zig")
    environment = os.environ | {"ZIG_GLOBAL_CACHE_DIR": cache, "ZIG_LOCAL_CACHE_DIR": cache}
    program = folder / out
    line = [*command, *flags, "-I.", *map(str, sources), "-lm", "-o", str(program)]
    done = subprocess.run(line, cwd=folder, capture_output=True, text=True, env=environment, check=False)
    assert done.returncode == 0, done.stderr
    assert done.stderr == ""
    return program


def output(program: Path | list[str], *arguments: str, cwd: Path | None = None) -> str:
    """What a program prints; it must succeed."""
    line = [*(program if isinstance(program, list) else [str(program)]), *arguments]
    done = subprocess.run(line, capture_output=True, text=True, cwd=cwd, check=False, timeout=300)
    assert done.returncode == 0, done.stdout[-2000:] + done.stderr[-4000:]
    assert done.stderr == ""
    return done.stdout


def table(text: str) -> dict[str, np.ndarray]:
    """Rows of numbers of the example's output, by their first word."""
    rows: dict[str, list[list[float]]] = {}
    for line in text.splitlines():
        if not line.startswith("#"):
            name, *numbers = line.split()
            rows.setdefault(name, []).append([float(number) for number in numbers])
    return {name: np.array(numbers) for name, numbers in rows.items()}
