"""Writing a file so that its name always stands for a whole one."""

import contextlib
import os
import secrets
import shutil
from pathlib import Path


def write_atomically(path: str | Path, text: str) -> None:
    """Write a text file: whoever reads `path` finds the old one or the whole new one, after a power cut too.

    The text goes to a part file in the same folder, which takes the name at the end. A link is followed and
    stays; a file that was there passes its permissions on. A device or a pipe takes the text as it is.

    Parameters
    ----------
    path : file to write or to replace.
    text : its content, written in UTF-8.

    Raises
    ------
    OSError
        Where it cannot be written. What was there is untouched, and no part is left behind.
    """
    file = Path(os.path.realpath(path))
    if file.exists() and not file.is_file():
        file.write_text(text, encoding="utf-8")
        return
    # A name of its own and not one made from the file's, which may be as long as names can be.
    part = file.parent / f".{os.getpid()}-{secrets.token_hex(4)}.part"
    try:
        with part.open("x", encoding="utf-8") as stream:
            stream.write(text)
            stream.flush()
            os.fsync(stream.fileno())
        if file.exists():
            shutil.copymode(file, part)
        part.replace(file)
    except BaseException:
        # The error that is on its way says more than one of tidying up after it.
        with contextlib.suppress(OSError):
            part.unlink()
        raise
    _sync_folder(file.parent)


def _sync_folder(folder: Path) -> None:
    """Put a folder's new names on the disk; only POSIX opens folders."""
    if os.name != "posix":
        return
    descriptor = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)
