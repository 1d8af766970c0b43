"""What every test runs under: double precision, one thread a process, no display, shapes checked."""

import gc
import os
from pathlib import Path

# Read when NumPy, MKL and XLA are first imported. Two pytest processes fill two cores: more threads would
# only contend for them.
os.environ.setdefault("OMP_NUM_THREADS", "1")
os.environ.setdefault("MKL_NUM_THREADS", "1")
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
os.environ.setdefault("XLA_FLAGS", "--xla_cpu_multi_thread_eigen=false")
os.environ["MPLBACKEND"] = "Agg"

import jax
import jaxtyping
import pytest
from hypothesis import settings

jax.config.update("jax_enable_x64", True)

# What one test has compiled, however small, serves all others: in each worker, and in processes of tests.
_COMPILED = Path(__file__).parents[1] / "build" / "compiled"
os.environ["JAX_COMPILATION_CACHE_DIR"] = str(_COMPILED)
os.environ["JAX_PERSISTENT_CACHE_MIN_COMPILE_TIME_SECS"] = "0"
jax.config.update("jax_compilation_cache_dir", str(_COMPILED))
jax.config.update("jax_persistent_cache_min_compile_time_secs", 0.0)

# Every shape and dtype that an annotation names is checked at each call (each trace, under jit).
# The hook acts on modules imported after it, so nothing here or in a plugin may import these earlier.
jaxtyping.install_import_hook(["rodmodel", "fem_reference", "calibration"], "beartype.beartype")

# Tracing makes objects by the million, few of them garbage in cycles: looked for after every 700 of them, as
# Python does by itself, that garbage takes longer to find than it is worth. Each module's goes at its end.
gc.set_threshold(100_000, 20, 20)

# The same examples on every run, and no limit on the time of one: a first call compiles.
settings.register_profile("rodmodel", deadline=None, derandomize=True)
settings.load_profile("rodmodel")


def pytest_configure(config: pytest.Config) -> None:
    """A worker may read a program that another is writing: JAX says so, and compiles it."""
    config.addinivalue_line("filterwarnings", "ignore:Error reading persistent compilation cache entry")


@pytest.fixture(autouse=True, scope="module")
def forget_what_was_compiled():
    """No module's functions outlive it: they fill the memory, and slow down what looks through it.

    What is left, imported modules above all, is not looked through again: that takes a third of a second.
    """
    yield
    jax.clear_caches()
    gc.collect()
    gc.freeze()


@pytest.fixture
def unchecked():
    """Values of a wrong type reach the code, as they do for users, who run without the tests' checks."""
    jaxtyping.config.update("jaxtyping_disable", True)
    yield
    jaxtyping.config.update("jaxtyping_disable", False)
