"""`rodmodel-calibrate truth`: runs of the full actuator, for the comparison with rods."""

import argparse
import json
from pathlib import Path
from typing import TYPE_CHECKING

from calibration.cli._arguments import GOOD, NOT_CONVERGED, BadInputError, Parser, complain, refuse_unwritable

if TYPE_CHECKING:
    from calibration.truth.cases import TruthCase


def add_to(commands: "argparse._SubParsersAction[Parser]") -> Parser:
    """Add the command."""
    parser = commands.add_parser("truth", help="run cases of the full actuator, and gather them")
    add = parser.add_argument
    add("cases", nargs="*", metavar="CASE", help="names of cases to run; none lists them all")
    add("--out", default=None, metavar="DIR", help="directory of the runs; an interrupted run resumes")
    add("--elements", default="coarse", help="mesh level (default: %(default)s)")
    add(
        "--gather", default=None, metavar="FILE", help="netCDF file for the runs of DIR; its other cases stay"
    )
    parser.set_defaults(command=_run)
    return parser


def _run(options: argparse.Namespace, command: str) -> int:
    from calibration.sweep.dataset import save_dataset
    from calibration.truth.cases import cases
    from calibration.truth.dataset import TruthError, case_of, gather, load_truth, merged

    if not options.cases and options.gather is None:
        _list(options, cases())
        return GOOD
    if options.out is None:
        raise BadInputError("--out: got nothing, expected the directory of the runs")
    directory = Path(options.out)
    if options.gather is not None:
        refuse_unwritable("--gather", Path(options.gather))
    try:
        chosen = [case_of(name) for name in options.cases]
    except TruthError as error:
        raise BadInputError(str(error)) from error
    failures = [line for case in chosen if (line := _trace(case, directory, options.elements, command))]
    if options.gather is not None:
        try:
            truth = gather(directory)
            if Path(options.gather).exists():
                truth = merged(load_truth(Path(options.gather)), truth)
        except TruthError as error:
            raise BadInputError(str(error)) from error
        try:
            save_dataset(truth, Path(options.gather))
        except OSError as error:
            raise BadInputError(
                f"--gather: got {options.gather} ({error.strerror or error}), expected a path that can be "
                "written"
            ) from error
        summary = {"file": options.gather, "states": truth.sizes["state"]}
        text = f"{summary['states']} states written to {summary['file']}"
        print(json.dumps(summary) if options.json else text)
    for line in failures:
        complain(f"rodmodel-calibrate truth: {line}", NOT_CONVERGED)
    return NOT_CONVERGED if failures else GOOD


def _trace(case: "TruthCase", directory: Path, level: str, command: str) -> str:
    """Run one case; return the error message, or an empty text."""
    from calibration.progress import progress_bar
    from calibration.truth.dataset import trace
    from fem_reference import ActuatorError, RunError, prepare_process

    prepare_process()
    try:
        with progress_bar(len(case.loads), "states") as advance:
            for _ in trace(case, directory, level, command):
                advance(1, case.name)
    except (RunError, ValueError) as error:
        raise BadInputError(str(error)) from error
    except ActuatorError as error:
        return f"{case.name}: {error}"
    return ""


def _list(options: argparse.Namespace, known: "tuple[TruthCase, ...]") -> None:
    rows = [{"case": case.name, "role": case.role, "loads": len(case.loads)} for case in known]
    if options.json:
        print(json.dumps({"cases": rows}))
        return
    for row in rows:
        print(f"{row['case']:20s} {row['role']:6s} {row['loads']} loads")
