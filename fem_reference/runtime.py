"""Settings of a whole process that assembles many matrices: programs make them, the library does not."""

import ctypes
import os

import jax

# Parameters of glibc's mallopt, and sizes [bytes] beyond those of any array of ours.
_TRIM_THRESHOLD, _MMAP_THRESHOLD = -1, -3
_LARGEST_ARRAY, _LARGEST_REST = 1 << 30, (1 << 31) - 1
# Read by XLA when its threads are made; with one of them no loop is compiled in parts.
_XLA_THREADS = "NPROC"


def keep_memory() -> bool:
    """Let the C library keep what arrays leave, for programs that assemble many matrices of one size.

    By default glibc gives a large array back to the system as soon as it is freed, and the next one is paged
    in anew, which can take longer than to fill it: two fifths of the actuator's assembly. This is a setting
    of the whole process, so programs call it, and the library does not.

    Returns
    -------
    whether the C library took it; others than glibc are left as they are.
    """
    try:
        mallopt = ctypes.CDLL(None).mallopt
    except (AttributeError, OSError, TypeError):
        return False
    return bool(mallopt(_MMAP_THRESHOLD, _LARGEST_ARRAY) and mallopt(_TRIM_THRESHOLD, _LARGEST_REST))


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
