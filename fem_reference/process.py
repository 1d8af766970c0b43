"""Settings of a whole process that assembles many matrices: programs make them, the library does not."""

import os

import jax

from fem_reference.memory import keep_memory

# Read by XLA when its threads are made; with one of them no loop is compiled in parts.
_XLA_THREADS = "NPROC"


def prepare_process() -> None:
    """Keep the memory of arrays (`keep_memory`), and run compiled loops in the threads that call them.

    The elements are worked out in chunks by as many threads as OpenMP has (see `solid`). By default JAX hands
    each chunk's loops over to threads of its own, which share every one of them out once more. Then all wait
    for each other, and spin while they do: on two cores an assembly takes a third longer.

    Call it before anything is computed: the settings are read when JAX makes its clients, which is done here.
    """
    keep_memory()
    before = os.environ.get(_XLA_THREADS)
    os.environ[_XLA_THREADS] = "1"
    try:
        jax.config.update("jax_cpu_enable_async_dispatch", False)
        jax.local_devices(backend="cpu")
    finally:
        if before is None:
            del os.environ[_XLA_THREADS]
        else:
            os.environ[_XLA_THREADS] = before
