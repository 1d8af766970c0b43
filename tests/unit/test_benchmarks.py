"""Benchmarks are run by hand, now and then: that each still can be is seen here."""

import importlib
import shutil
from pathlib import Path

import numpy as np
import pytest

import rodmodel
from rodmodel.core import VARIANTS, rows_of
from tests.benchmark.timing.core_loop import CoreLoop

SCRIPTS = sorted(path.stem for path in Path("tests/benchmark").glob("bench_*.py"))


@pytest.mark.parametrize("name", SCRIPTS)
def test_a_benchmark_finds_all_that_it_imports(name: str):
    assert callable(importlib.import_module(f"tests.benchmark.{name}").main)


@pytest.mark.slow
@pytest.mark.skipif(shutil.which("cc") is None, reason="cc is not installed")
@pytest.mark.parametrize("variant", VARIANTS)
def test_the_loop_in_c_is_compiled_and_solves(variant: str):
    """With the core's own sources in it, for each set of instructions that this machine runs."""
    rod = rodmodel.load_core("double-helix")
    pressures = np.random.default_rng(0).uniform(0.0, 30e3, (20, 3))
    loop = CoreLoop(rod, variant, rod.options(4, volumes=False, tolerance=1e-7), 4)
    loaded = rows_of({"pressure": pressures, "tip_force": [0.0, 0.02, 0.0]})
    for with_jacobian in (False, True):
        # It raises an error where one of them does not succeed.
        assert loop.solve(loaded, with_jacobian=with_jacobian) > 0.0
