"""`rodmodel export`: C sources of the core with a calibrated rod, for a controller without Python."""

import argparse
from pathlib import Path

from rodmodel.cli._arguments import InputError
from rodmodel.cli._options import GOOD, add_layout, find_calibration

_FOLDER = "a directory that can be made and written to"


def add_to(commands: "argparse._SubParsersAction[argparse.ArgumentParser]") -> None:
    """Add the command."""
    parser = commands.add_parser("export", help="write C99 sources that predict on a controller")
    add_layout(parser)
    add = parser.add_argument
    add("--out", required=True, metavar="DIR", help="directory for the sources, created if missing")
    add("--float", action="store_true", help="single precision (default: double)")
    parser.set_defaults(command=_run)


def _run(options: argparse.Namespace) -> int:
    found = find_calibration(options)
    from rodmodel.core.export import export

    try:
        export(found, Path(options.out), single_precision=options.float)
    except OSError as error:
        raise InputError(f"--out: got {options.out!r} ({error.strerror}), expected {_FOLDER}") from error
    return GOOD
