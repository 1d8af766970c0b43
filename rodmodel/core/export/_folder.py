"""Atomic writing of an export's folder."""

import contextlib
import errno
import math
import os
import secrets
import shutil
from pathlib import Path
from typing import TYPE_CHECKING

from rodmodel.core.export._law_header import law_header, law_source

if TYPE_CHECKING:
    from rodmodel.io import Found

_SOURCES = Path(__file__).parents[1] / "src"
_TEMPLATES = Path(__file__).parent / "templates"
_CORE = "rodmodel_core.h"
# Dispatch among variants of the core, of which a controller has one.
_LEFT_OUT = ("dispatch.c", "dispatch.h")
_GUARD = "#define RODMODEL_CORE_H\n"


def export(found: "Found", folder: Path, single_precision: bool = False) -> None:
    """Write C99 sources of the core with a calibrated rod in them, an example, and a C++ and a MEX wrapper.

    The same calibration gives the same files. A calibration of all orientations ψ gives the rod at the
    requested ψ and, beside it, the laws of all with ψ as an input.

    Parameters
    ----------
    found : calibration and requested orientation.
    folder : new or empty folder in an existing one.
    single_precision : use floats, for processors without double precision.

    Raises
    ------
    OSError
        If the folder is not empty or cannot be written. It stays unchanged.
    """
    files = _files(found, single_precision)
    target = Path(os.path.realpath(folder))
    exists = target.exists()
    if exists and any(target.iterdir()):
        raise OSError(errno.ENOTEMPTY, os.strerror(errno.ENOTEMPTY), str(folder))
    part = (target if exists else target.parent) / f".{os.getpid()}-{secrets.token_hex(4)}.part"
    moved: list[Path] = []
    try:
        part.mkdir()
        for name, text in files.items():
            (part / name).write_text(text, encoding="utf-8", newline="\n")
        if exists:
            # The folder may be a process's working directory, so it is not replaced.
            for name in files:
                moved.append((part / name).rename(target / name))
            part.rmdir()
        else:
            part.rename(target)
    except BaseException:
        # An error of the clean-up must not hide the first one.
        with contextlib.suppress(OSError):
            for file in moved:
                file.unlink()
            shutil.rmtree(part)
        raise


def _files(found: "Found", single_precision: bool) -> dict[str, str]:
    """Return the text of every file by name."""
    files = {
        file.name: file.read_text(encoding="utf-8")
        for file in sorted(_SOURCES.rglob("*.[ch]"))
        if file.name not in _LEFT_OUT
    }
    if single_precision:
        # Defined in the header, so that no compiler option is needed.
        definition = "#ifndef RM_REAL_FLOAT\n#define RM_REAL_FLOAT\n#endif\n"
        files[_CORE] = files[_CORE].replace(_GUARD, f"{_GUARD}\n{definition}", 1)
    files["law.h"], files["law.c"] = law_header(found), law_source(found)
    layout = found.calibration.layout
    name = f"{layout.name}, ψ {math.degrees(found.psi):.10g}°, pitch {1e3 * layout.pitch:.10g} mm"
    for file in sorted(_TEMPLATES.iterdir()):
        files[file.name] = file.read_text(encoding="utf-8").replace("@ROD@", name)
    return files
