"""Memory of large arrays, kept by the process between their uses."""

import ctypes

# Parameters of glibc's mallopt, and sizes [bytes] beyond those of any array of ours.
_TRIM_THRESHOLD, _MMAP_THRESHOLD = -1, -3
_LARGEST_ARRAY, _LARGEST_REST = 1 << 30, (1 << 31) - 1


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
