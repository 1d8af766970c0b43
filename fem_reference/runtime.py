"""Process-wide settings for assembling many matrices; programs make them, the library does not."""

import ctypes
import os
import signal
import sys
import threading

import jax

# Parameters of glibc's mallopt.
_TRIM_THRESHOLD, _MMAP_THRESHOLD = -1, -3
# Their values [bytes], larger than any array here.
_LARGEST_ARRAY, _LARGEST_REST = 1 << 30, (1 << 31) - 1
# XLA reads this variable when it starts its threads; with one thread it splits no loop.
_XLA_THREADS = "NPROC"
_AGAIN = 0.05  # time after which a lost interrupt comes again [s]


def keep_memory() -> bool:
    """Let the C library keep the memory of freed arrays, for programs that assemble many matrices.

    By default glibc returns a large array to the system as soon as it is freed. The next array causes page
    faults, which can take longer than filling it: two fifths of the time of the actuator's assembly. The
    setting is process-wide, so programs call this function and the library does not.

    Returns
    -------
    accepted : whether the C library has accepted the setting; only glibc does.
    """
    try:
        mallopt = ctypes.CDLL(None).mallopt
    except (AttributeError, OSError, TypeError):
        return False
    return bool(mallopt(_MMAP_THRESHOLD, _LARGEST_ARRAY) and mallopt(_TRIM_THRESHOLD, _LARGEST_REST))


def keep_interrupts() -> None:
    """Let Ctrl-C come again where Python would lose it.

    Python drops an exception in a finaliser or a callback of its garbage collector, with a line on standard
    error. JAX has such a callback, and an interrupt that falls into it would not end a run.
    """
    usual = sys.unraisablehook
    if getattr(usual, "keeps_interrupts", False):
        return

    def hook(lost: "sys.UnraisableHookArgs") -> None:
        if lost.exc_type is KeyboardInterrupt:
            # Not at once: that would be lost in the same place. A true signal also wakes a thread that waits.
            threading.Timer(
                _AGAIN, signal.pthread_kill, (threading.main_thread().ident, signal.SIGINT)
            ).start()
        else:
            usual(lost)

    hook.keeps_interrupts = True  # type: ignore[attr-defined]
    sys.unraisablehook = hook


def prepare_process() -> None:
    """Keep the memory of arrays (`keep_memory`) and Ctrl-C, and run compiled loops in the calling threads.

    Elements are computed in chunks by as many threads as OpenMP has (see `solid`). By default JAX splits each
    chunk's loops once more over its own threads. All threads then spin while they wait for each other: on two
    cores an assembly takes a third longer.

    Call it before any computation: JAX reads the settings when it creates its clients, which happens here.
    """
    keep_memory()
    keep_interrupts()
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
