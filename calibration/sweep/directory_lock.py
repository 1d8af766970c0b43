"""One sweep at a time in a run directory: two would write the same paths' files."""

import contextlib
import os
from collections.abc import Iterator
from pathlib import Path

from calibration.sweep.errors import SweepError

try:
    import fcntl
except ImportError:  # Windows has no such locks, and no directories that can be opened.
    fcntl = None  # type: ignore[assignment]


@contextlib.contextmanager
def sole_sweep(directory: Path) -> Iterator[None]:
    """Hold a run directory, which is created if missing, until the block ends or the process dies.

    Raises
    ------
    SweepError
        If another process holds it.
    """
    directory.mkdir(parents=True, exist_ok=True)
    if fcntl is None:
        yield
        return
    handle = os.open(directory, os.O_RDONLY)
    try:
        fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError as error:
        raise SweepError(
            f"sweep: {directory} is in use by another sweep; wait until it ends, or stop it, and run again"
        ) from error
    else:
        yield
    finally:
        os.close(handle)
