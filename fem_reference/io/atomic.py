"""Writing a file so that its name always stands for a whole one.

`rodmodel` and `fem_reference` import nothing from each other, so each has this file; a test holds them equal.
"""

import contextlib
import os
import secrets
import shutil
from collections.abc import Iterator
from pathlib import Path

_PART = "part"


def write_atomically(path: str | Path, content: str | bytes) -> None:
    """Write a file: whoever reads `path` finds the old one or the whole new one, after a power cut too.

    Parameters
    ----------
    path : file to write or to replace; see `atomic_part`.
    content : text, which is written in UTF-8, or bytes.

    Raises
    ------
    OSError
        Where it cannot be written. What was there is untouched, and no part is left behind.
    """
    with atomic_part(path) as part, part.open("wb") as stream:
        stream.write(content.encode() if isinstance(content, str) else content)


@contextlib.contextmanager
def atomic_part(path: str | Path) -> Iterator[Path]:
    """An empty file beside `path` for a library to write to; it takes the name when the block ends well.

    A link is followed and stays; a file that was there passes its permissions on. A device or a pipe is
    handed out as it is. The part's suffix says nothing of a format, so the library has to be told it.

    Parameters
    ----------
    path : file to write or to replace.

    Yields
    ------
    part : file to write; whoever opens it closes it in the block.

    Raises
    ------
    OSError
        Where it cannot be written. After this, and any other error in the block, what was there is untouched,
        and no part is left behind.
    """
    file = Path(os.path.realpath(path))
    if file.exists() and not file.is_file():
        yield file
        return
    # A name of its own and not one made from the file's, which may be as long as names can be.
    part = file.parent / f".{os.getpid()}-{secrets.token_hex(4)}.{_PART}"
    try:
        part.touch(exist_ok=False)
        yield part
        _sync(part)
        if file.exists():
            shutil.copymode(file, part)
        part.replace(file)
    except BaseException:
        # The error that is on its way says more than one of tidying up after it.
        with contextlib.suppress(OSError):
            part.unlink()
        raise
    sync_folder(file.parent)


def drop_parts(folder: str | Path) -> None:
    """Delete the parts that killed processes left in a folder into which nobody else writes."""
    for part in Path(folder).glob(f".*-*.{_PART}"):
        part.unlink()


def sync_folder(folder: str | Path) -> None:
    """Put a folder's new names on the disk; only POSIX opens folders."""
    if os.name != "posix":
        return
    descriptor = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


def _sync(file: Path) -> None:
    with file.open("rb+") as stream:
        os.fsync(stream.fileno())
