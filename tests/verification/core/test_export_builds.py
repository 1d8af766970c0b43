"""The exported folder compiles without a warning, and its example prints Python's numbers."""

import itertools
import subprocess
from pathlib import Path

import numpy as np
import pytest

from rodmodel.core import CoreRod
from tests.verification.core.expected import assert_example
from tests.verification.core.toolchain import (
    ANY,
    C99,
    CORE,
    HERE,
    OWN,
    WARNINGS,
    build,
    compiler,
    exported,
    found,
    needs,
    output,
    table,
)

DOUBLE, SINGLE = 1e-12, 2e-4
NEWTON = 1e-10  # tolerance of a solve [rad]
FLOAT = "-DRM_REAL_FLOAT"
# At every change; the rest takes a minute, and Zig another one for its C library.
QUICK = {("gcc", "-O3", FLOAT), ("gcc", "-O0", ""), ("clang", "-O0", "")}
ALL = list(itertools.product(("gcc", "clang", "zig"), ("-O0", "-O3"), ("", FLOAT)))


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return exported(tmp_path_factory.mktemp("own") / "rod")


@pytest.mark.parametrize(
    ("name", "level", "precision"),
    [pytest.param(*row, marks=() if row in QUICK else pytest.mark.slow) for row in ALL],
)
def test_every_compiler_takes_it_without_a_warning_and_prints_the_numbers_of_python(
    folder: Path, name: str, level: str, precision: str
):
    flags = [*C99, level, *([precision] if precision else [])]
    program = build(folder, compiler(name), *flags, sources=("main.c", *CORE), out="example")
    assert_example(table(output(program)), OWN, SINGLE if precision else DOUBLE)


def test_an_export_in_single_precision_needs_no_flag(tmp_path: Path):
    place = exported(tmp_path / "rod", single_precision=True)
    program = build(place, compiler("gcc"), *C99, "-O0", sources=("main.c", *CORE), out="example")
    assert_example(table(output(program)), OWN, SINGLE)


@pytest.mark.parametrize("precision", ["", pytest.param(FLOAT, marks=pytest.mark.slow)])
def test_of_a_law_of_all_orientations_psi_is_an_input(tmp_path: Path, precision: str):
    place = exported(tmp_path / "rods", ANY)
    flags = [*C99, "-O0", *([precision] if precision else [])]
    program = build(place, compiler("gcc"), *flags, sources=("main.c", *CORE), out="example")
    assert_example(table(output(program)), ANY, SINGLE if precision else DOUBLE)


def test_cmake_builds_library_and_example(folder: Path, tmp_path: Path):
    (cmake,) = needs("cmake")
    # Of the kind of build that the folder chooses by itself; -O3 the compilers have above.
    kind = "-DCMAKE_C_FLAGS_RELEASE=-O1"
    for line in (["-S", str(folder), "-B", str(tmp_path), kind], ["--build", str(tmp_path)]):
        done = subprocess.run([cmake, *line], capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stdout + done.stderr
    assert (tmp_path / "librodmodel_core.a").exists()
    assert_example(table(output(tmp_path / "example")), OWN, DOUBLE)


@pytest.mark.parametrize("precision", ["", FLOAT])
def test_the_workspace_of_the_macro_is_that_of_the_function(folder: Path, precision: str):
    flags = [*C99, "-O0", *([precision] if precision else [])]
    program = build(folder, compiler("gcc"), *flags, sources=(HERE / "sizes.c", *CORE), out="sizes")
    rows = table(output(program))["size"]
    assert len(rows) > 60
    np.testing.assert_array_equal(rows[:, 2], rows[:, 3])


@pytest.mark.parametrize(("name", "precision"), [("g++", ""), ("clang++", FLOAT)])
def test_the_wrapper_for_c_plus_plus_gives_the_same(folder: Path, name: str, precision: str):
    flags = [precision] if precision else []
    c = compiler("gcc")
    for source in CORE:
        subprocess.run([*c, "-std=c99", "-O0", *flags, "-c", source], cwd=folder, check=True)
    objects = tuple(source.replace(".c", ".o") for source in CORE)
    cpp = (HERE / "wrapper.cpp", *objects)
    program = build(folder, needs(name), "-std=c++17", *WARNINGS, "-O1", *flags, sources=cpp, out="wrapper")
    rows = table(output(program))
    rod = CoreRod.of(found(OWN))
    # What starts from another solution ends elsewhere within Newton's tolerance.
    relative = SINGLE if precision else NEWTON
    loads = {"tip_force": (0.0, 2e-3, 0.0), "gravity": (0.0, 0.0, 9.81)}
    for row in rows["pose"]:
        wanted = rod.solve(row[:3], steps=8, **(loads if row[3] else {}))
        np.testing.assert_allclose(row[4:7], wanted.tip_position, rtol=0, atol=0.066 * relative)
        np.testing.assert_allclose(row[7:9], wanted.bend, rtol=0, atol=7 * relative)
    _, jacobian = rod.jacobian(rows["pose"][-1][:3], steps=8, **loads)
    wanted = np.concatenate(list(jacobian.tip_position.values()), axis=1)
    size = np.abs(wanted).max(axis=0)
    np.testing.assert_array_less(np.abs(rows["jacobian"] - wanted) / size, 100 * relative)
    assert rows["failures"] == 0
