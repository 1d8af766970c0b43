"""`rodmodel-calibrate design`: from a design file to a calibration file and its report, in one command."""

import argparse
import math
from pathlib import Path
from typing import TYPE_CHECKING

from calibration.cli._arguments import (
    GOOD,
    NOT_CONVERGED,
    BadInputError,
    Parser,
    complain,
    count,
    json_text,
    positive,
    refuse_unwritable,
)
from calibration.cli._files import read_design_file, write_calibration_file

if TYPE_CHECKING:
    from calibration.from_design import Findings, Task

# The name of the run's folder after that of the calibration file.
_FOLDER = "_run"


def add_to(commands: "argparse._SubParsersAction[Parser]") -> Parser:
    """Add the command."""
    parser = commands.add_parser(
        "design", help="make the calibration of a design file, with a report; an interrupted run resumes"
    )
    add = parser.add_argument
    add("design", metavar="FILE", help="design file, see docs/reference/design_file.md")
    add("--out", required=True, help="calibration file to write; the report lies beside it, as HTML")
    add(
        "--budget",
        default="1h",
        metavar="TIME",
        help="time for it, such as 20min, 1h or 8h; it chooses mesh, paths and runs (default: %(default)s)",
    )
    add(
        "--run",
        default=None,
        metavar="DIR",
        help="directory of the run's files (default: the name of --out with _run)",
    )
    add(
        "--angle-deg",
        type=positive,
        default=180.0,
        help="bending angle at which the range of pressures ends, where the design names none (default: 180)",
    )
    add("--workers", type=count, default=2, help="processes, one thread each (default: %(default)s)")
    add(
        "--scheduler",
        default=None,
        metavar="ADDRESS",
        help="address of a dask scheduler for the sweep in place of local processes; it must be trusted",
    )
    parser.set_defaults(command=_design)
    return parser


def _design(options: argparse.Namespace, command: str) -> int:
    from calibration.from_design import StageError, calibrate, report
    from calibration.sweep import RunError
    from calibration.sweep.path_file import PathFileError
    from rodmodel.io import write_atomically

    task = _task(options, command)

    def say(line: str) -> None:
        if not options.json:
            print(line, flush=True)

    try:
        found = calibrate(task, say)
    except StageError as error:
        return complain(f"rodmodel-calibrate design: {error}; nothing written", NOT_CONVERGED)
    except (RunError, PathFileError, OSError) as error:
        raise BadInputError(
            f"--run: got {task.directory} ({error}), expected a directory for this run"
        ) from error
    write_calibration_file(found.calibration, options.out)
    page = _page_of(Path(options.out))
    try:
        write_atomically(page, report(found))
    except OSError as error:
        raise BadInputError(
            f"--out: got {page} ({error.strerror or error}), expected a writable file"
        ) from error
    _tell(found, options, page)
    return GOOD


def _task(options: argparse.Namespace, command: str) -> "Task":
    from calibration.from_design import Budget, Task

    design = read_design_file("design", options.design)
    try:
        budget = Budget.parse(options.budget)
    except ValueError as error:
        raise BadInputError(f"--{error}") from error
    out = Path(options.out)
    refuse_unwritable("--out", out)
    folder = out.with_name(out.stem + _FOLDER) if options.run is None else Path(options.run)
    return Task(
        design=design,
        budget=budget,
        directory=folder,
        command=command,
        angle=math.radians(options.angle_deg),
        workers=options.workers,
        scheduler=options.scheduler,
    )


def _page_of(out: Path) -> Path:
    return out.with_suffix(".html")


def _tell(found: "Findings", options: argparse.Namespace, page: Path) -> None:
    record = found.record()
    if options.json:
        print(json_text({"file": options.out, "report": str(page), **record}))
        return
    reached = "all bars are met" if not found.short else f"short of its bars: {', '.join(found.short)}"
    print(f"{options.out}: the calibration of {found.task.design.name}; {reached}")
    print(f"{page}: the report")
