"""`rodmodel-calibrate report`: held-out errors of one law, or of all shipped laws and their rods."""

import argparse
from dataclasses import asdict
from pathlib import Path
from typing import Any

from calibration.cli._arguments import (
    GOOD,
    NOT_CONVERGED,
    BadInputError,
    Parser,
    complain,
    count,
    json_text,
    seed,
)
from calibration.cli._files import read_calibration_file, read_dataset, read_truth

_NOWHERE = "the law has no equilibrium at some held-out states"


def add_to(commands: "argparse._SubParsersAction[Parser]") -> Parser:
    """Add the command."""
    report = commands.add_parser(
        "report",
        help="errors and plots of a calibration file; without one, of all shipped laws and their rods",
    )
    report.add_argument("dataset", nargs="?", help="netCDF file of a run")
    report.add_argument("file", nargs="?", help="calibration file")
    report.add_argument("--figures", default=None, metavar="DIR", help="directory for PNG files")
    report.add_argument(
        "--datasets",
        default=None,
        metavar="DIR",
        help="directory of the laws' datasets, to recompute the errors in their files",
    )
    report.add_argument(
        "--truth",
        default=None,
        metavar="FILE",
        help="runs of the full actuator to compare the rods with (default: the shipped runs)",
    )
    report.add_argument(
        "--compare", action="store_true", help="fit other forms of the law to the same states"
    )
    report.add_argument("--iterations", type=count, default=100, help="iterations of the compared network")
    report.add_argument("--seed", type=seed, default=0, help="seed of the compared network")
    report.set_defaults(command=_report)
    return report


def _report(options: argparse.Namespace, command: str) -> int:
    if options.dataset is None:
        return _report_all(options)
    if options.file is None:
        raise BadInputError(f"file: got none with {options.dataset}, expected a calibration file")
    from calibration.fit.held_out_error import everywhere
    from calibration.report.error_table import error_table
    from calibration.report.law_report import judge
    from calibration.studies.compare_laws import compare_candidates
    from calibration.sweep.dataset import attributes
    from calibration.truth import on_its_mesh
    from rodmodel import SectionLaw

    dataset = read_dataset(options.dataset)
    calibration = on_its_mesh(read_calibration_file(options.file))
    law, run = calibration.section_law, attributes(dataset)
    if isinstance(law, SectionLaw) and "orientations" in run:
        raise BadInputError(
            f"dataset: {options.dataset} holds sections of many orientations, expected those of the one of "
            f"{options.file}"
        )
    length = run["geometry"]["body_length"]
    figures = _directory(options)
    try:
        found = judge(law, dataset, calibration.domain, length, figures)
    except OSError as error:
        raise _unwritable(figures, error) from error
    answer: dict[str, Any] = {"error": found}
    if options.compare:
        if not isinstance(law, SectionLaw):
            raise BadInputError(
                f"--compare: got {options.file}, a law of all orientations, expected one of a single one"
            )
        table = compare_candidates(law, dataset, calibration.domain, length, options.iterations, options.seed)
        answer["comparison"] = table
    print(json_text(answer) if options.json else error_table(found))
    if options.compare and not options.json:
        print(answer["comparison"])
    if not everywhere(found):
        return complain(f"rodmodel-calibrate report: {options.file}: {_NOWHERE}", NOT_CONVERGED)
    return GOOD


def _report_all(options: argparse.Namespace) -> int:
    from calibration.fit.held_out_error import everywhere
    from calibration.report.all_layouts import datasets_by_checksum, markdown, report_map, report_rods
    from calibration.report.rod_error_plot import write_truth_figure
    from calibration.sweep.dataset import DatasetError
    from calibration.truth.cases import title
    from calibration.truth.compare_rods import compare_with_truth
    from calibration.truth.error_bounds import coverage_by
    from rodmodel import shipped_calibrations

    if options.compare:
        raise BadInputError("--compare: got no dataset, expected one, and a calibration file")
    truth, figures = read_truth(options.truth), _directory(options)
    try:
        datasets = {} if options.datasets is None else datasets_by_checksum(Path(options.datasets))
    except DatasetError as error:
        raise BadInputError(f"--{error}") from error
    try:
        maps = [report_map(calibration, datasets, figures) for calibration in shipped_calibrations()]
        verdict = compare_with_truth(truth)
        if figures is not None:
            write_truth_figure(verdict, figures / "rod-against-actuator.png")
    except OSError as error:
        raise _unwritable(figures, error) from error
    rods, shares = report_rods(verdict), coverage_by(verdict)
    if options.json:
        laws = [
            {**asdict(row.calibration.layout), "recomputed": row.recomputed, "error": row.error}
            for row in maps
        ]
        print(json_text({"maps": laws, "rods": rods, "coverage": shares}))
    else:
        print(markdown(maps, rods, shares), end="")
    wrong = [title(row.calibration.layout) for row in maps if not everywhere(row.error)]
    if wrong:
        return complain(f"rodmodel-calibrate report: {'; '.join(wrong)}: {_NOWHERE}", NOT_CONVERGED)
    return GOOD


def _directory(options: argparse.Namespace) -> Path | None:
    return None if options.figures is None else Path(options.figures)


def _unwritable(directory: Path | None, error: OSError) -> BadInputError:
    return BadInputError(
        f"--figures: got {directory} ({error.strerror or error}), expected a writable directory"
    )
