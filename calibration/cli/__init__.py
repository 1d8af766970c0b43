"""Command ``rodmodel-calibrate``: sweep the cell, fit a section law, and report its errors."""

import argparse
import json
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from calibration.cli import _bounds, _ends, _fit_measured, _from_design, _report, _scale, _snapped, _truth
from calibration.cli._arguments import (
    GOOD,
    NOT_CONVERGED,
    BadInputError,
    Parser,
    complain,
    count,
    not_negative,
    number,
    positive,
    refuse_unwritable,
    run_command,
    seed,
)
from calibration.cli._files import read_calibration_file, read_dataset, write_calibration_file
from calibration.cli._pressures import add_pressures, add_single, with_pressures, with_single
from calibration.cli._run_design import orientations, run_actuator, run_domain

# Default size of a law.
_RIDGES, _FEATURES = 24, 16


def main(arguments: Sequence[str] | None = None) -> int:
    """Run ``rodmodel-calibrate`` and return the exit status."""
    return run_command(_parser(), arguments, "interrupted; states in a run's directory are kept")


def _run(options: argparse.Namespace, command: str) -> int:
    from calibration.sweep.dataset import DatasetError, build_dataset, save_dataset
    from calibration.sweep.errors import SweepError
    from calibration.sweep.path_file import PathFileError
    from calibration.sweep.restore_run import restore_run
    from calibration.sweep.run_directory import RunError, RunPlan, open_run
    from calibration.sweep.sweep import run_sweep
    from calibration.sweep.tracing import CellTracer
    from fem_reference import converged_level, mesh_level

    actuator, psi = run_actuator(options), orientations(options)
    try:
        level = options.elements or converged_level(actuator.winding)
        mesh_level(level)
    except ValueError as error:
        raise BadInputError(f"--{error}") from error
    try:
        plan = RunPlan(
            actuator=actuator,
            level=level,
            domain=run_domain(options, actuator),
            paths=options.paths,
            seed=options.seed,
            end_compliance=actuator.end_compliance or 0.0,
            orientations=(psi[0], psi[1]) if len(psi) == 2 else None,
            around=options.around,
        )
    except ValueError as error:
        raise BadInputError(f"--design {options.design}: {error}") from error
    directory = Path(options.out)
    if options.retry and options.extend is None:
        raise BadInputError(
            "--retry: got it without --extend, expected a dataset whose paths are tried again"
        )
    try:
        if options.extend is not None:
            restore_run(read_dataset(options.extend), directory, plan, plan.material, options.retry)
        description = open_run(directory, plan, command, plan.material)
        paths = plan.design()
        tracer = CellTracer(plan.actuator, plan.level, plan.end_compliance)
        records = run_sweep(tracer, paths, directory, options.workers, options.scheduler)
        dataset = build_dataset(paths, records, description)
        save_dataset(dataset, directory / "dataset.nc")
    except RunError as error:
        raise BadInputError(str(error)) from error
    except PathFileError as error:
        raise BadInputError(f"--out: {error}") from error
    except OSError as error:
        raise BadInputError(
            f"--out: got {directory} ({error.strerror or error}), expected a writable directory"
        ) from error
    except (SweepError, DatasetError) as error:
        return complain(f"rodmodel-calibrate run: {error}", NOT_CONVERGED)
    failed = {name: record.end for name, record in records.items() if record.failed}
    states = dataset.sizes["state"]
    if options.json:
        summary = {
            "dataset": str(directory / "dataset.nc"),
            "states": states,
            "paths": len(paths),
            "converged": not failed,
            "failed_paths": failed,
        }
        print(json.dumps(summary))
    else:
        print(f"{states} states on {len(paths)} paths written to {directory / 'dataset.nc'}")
    if failed:
        ends = "; ".join(f"{name} after {len(records[name].states)} states" for name in failed)
        return complain(
            f"rodmodel-calibrate run: {len(failed)} paths ended early, all states are written: {ends}",
            NOT_CONVERGED,
        )
    return GOOD


def _fit(options: argparse.Namespace, command: str) -> int:
    from calibration.fit.pipeline import Judged, begin_near, fit_and_judge
    from calibration.fit.same_section import UnlikeError, cautions, refuse_another_actuator, refuse_unlike
    from calibration.fit.to_calibration import calibration_of
    from calibration.provenance import code_version, sha256, today
    from calibration.report.error_table import error_table
    from calibration.sweep.dataset import attributes
    from calibration.truth import on_its_mesh

    dataset, domain = _dataset(options)
    refuse_unwritable("--out", Path(options.out))
    run = attributes(dataset)
    others = [read_dataset(file) for file in options.also]
    for file, other in zip(options.also, others, strict=True):
        try:
            refuse_unlike(dataset, other)
        except UnlikeError as error:
            raise BadInputError(f"--also {file}: got {error}") from error
    if options.near and (options.ridges is not None or options.features is not None):
        raise BadInputError("--near: got --ridges or --features too, expected the size to be that law's")
    if options.near_weight is not None and not options.near:
        raise BadInputError("--near-weight: got it without --near, expected both or neither")
    near = []
    for file in options.near:
        begun = read_calibration_file(file)
        try:
            if not options.near_another:
                refuse_another_actuator(begun, run)
            near.append(begin_near(on_its_mesh(begun).section_law, run))
        except UnlikeError as error:
            raise BadInputError(f"--near {file}: got {error}; --near-another allows it") from error
        except ValueError as error:
            raise BadInputError(f"--near {file}: got {error}") from error
        for caution in cautions(begun, run, domain):
            print(f"rodmodel-calibrate fit: --near {file}: {caution}", file=sys.stderr)
    outcome: Judged = fit_and_judge(
        dataset,
        domain,
        run["geometry"]["body_length"],
        options.ridges or _RIDGES,
        options.features or _FEATURES,
        options.iterations,
        options.seed,
        near,
        others,
        options.near_weight,
    )
    if not outcome.good:
        return complain(f"rodmodel-calibrate fit: {outcome.complaint}; nothing written", NOT_CONVERGED)
    provenance = {
        "fit_command": command,
        "code_version": code_version(),
        "dataset_sha256": sha256(Path(options.dataset)),
        "states": outcome.states,
        "date": today(),
        "training": outcome.training,
        **({"near_sha256": [sha256(Path(file)) for file in options.near]} if near else {}),
        **({"also_sha256": [sha256(Path(file)) for file in options.also]} if others else {}),
    }
    made = calibration_of(outcome.law, outcome.domain, outcome.error, run, provenance)
    write_calibration_file(made, options.out)
    kept = outcome.domain.pressure_max
    if options.json:
        answer = {
            "file": options.out,
            "error": outcome.error,
            "training": outcome.training,
            "pressure_max_kpa": [1e-3 * p for p in kept],
        }
        print(json.dumps(answer))
    else:
        print(error_table(outcome.error))
    if kept != domain.pressure_max and not options.json:
        largest = ", ".join(f"{1e-3 * p:g}" for p in kept)
        print(f"The law is stable up to {largest} kPa in chambers 1, 2, 3: its domain ends there.")
    return GOOD


def _dataset(options: argparse.Namespace) -> Any:
    """Return the dataset and its domain, narrowed by the options."""
    from calibration.sweep import attributes, domain_of_run

    dataset = read_dataset(options.dataset)
    domain = with_pressures(domain_of_run(attributes(dataset)), options)
    return dataset, with_single(domain, options)


def _parser() -> Parser:
    parser = Parser(
        prog="rodmodel-calibrate", description="Calibrate a section law on the finite-element cell."
    )
    commands = parser.add_subparsers(
        required=True,
        metavar="design | run | fit | report | fit-measured | truth | ends | bounds | judge | scale "
        "| snapped",
    )

    design = _from_design.add_to(commands)
    run = commands.add_parser("run", help="sweep loading paths of the cell, or resume an interrupted run")
    run.add_argument(
        "--design",
        default=None,
        metavar="FILE",
        help="design file, which other options change (default: the paper's actuator)",
    )
    run.add_argument("--layout", default=None, help="winding layout (default: double-helix, or the design's)")
    run.add_argument(
        "--psi-deg",
        nargs="+",
        type=number,
        default=None,
        metavar="PSI",
        help="winding orientation [deg]; or a range, from which each path draws its own (default: 0, or the "
        "design's)",
    )
    run.add_argument(
        "--pitch-mm",
        type=positive,
        default=None,
        help="winding pitch, twice the rings' spacing [mm] (default: 3, or the design's)",
    )
    run.add_argument(
        "--elements",
        default=None,
        help="mesh level, as those of rodmodel-fem (default: fine, and finer for rings)",
    )
    run.add_argument("--out", required=True, help="directory of the run")
    run.add_argument(
        "--extend",
        default=None,
        metavar="DATASET",
        help="dataset of the same run with fewer paths, whose states are not computed again",
    )
    run.add_argument(
        "--retry",
        action="store_true",
        help="with --extend: compute again the paths of that dataset that ended before their last load",
    )
    run.add_argument("--workers", type=count, default=2, help="processes, one thread each")
    run.add_argument(
        "--scheduler",
        default=None,
        metavar="ADDRESS",
        help="address of a dask scheduler to use in place of local processes; it must be trusted",
    )
    run.add_argument("--paths", type=count, default=100, help="loading paths, every fifth of them held out")
    run.add_argument("--seed", type=seed, default=0, help="seed of the design")
    run.add_argument(
        "--around",
        type=int,
        choices=(1, 2, 3),
        default=None,
        metavar="CHAMBER",
        help="paths near this chamber alone, the two others up to their largest pressures",
    )
    run.add_argument(
        "--end-compliance-mm-per-n",
        type=not_negative,
        default=None,
        metavar="C",
        help="compliance of the ends along the rod (default: the design's, or that of the paper's actuator, "
        "scaled)",
    )
    run.add_argument(
        "--moment-max-nmm",
        type=positive,
        default=None,
        help="largest bending moment [N mm] (default: 6.6, scaled to the design)",
    )
    run.add_argument(
        "--torque-max-nmm",
        type=positive,
        default=None,
        help="largest torque [N mm] (default: 3.3, scaled to the design)",
    )
    scaled = "(default: the design's, or {} kPa, scaled by the shear modulus)"
    add_pressures(run, scaled.format("60 60 60"), scaled.format("110"))
    run.set_defaults(command=_run)

    fit = commands.add_parser("fit", help="fit the section law and write the calibration file")
    fit.add_argument("dataset", help="netCDF file of a run")
    fit.add_argument(
        "--also",
        nargs="+",
        default=[],
        metavar="DATASET",
        help="more datasets of the same section (of any orientation for a law of all); their training "
        "states are fitted too",
    )
    fit.add_argument("--out", required=True, help="calibration file to write")
    fit.add_argument(
        "--near",
        nargs="+",
        default=[],
        metavar="FILE",
        help="calibration of another winding whose law the fit starts from and stays near, which needs "
        "fewer paths; with several, a law is fitted near each, and one law is trained on their mean",
    )
    fit.add_argument(
        "--near-weight",
        type=positive,
        default=None,
        metavar="WEIGHT",
        help="weight of the squared distance from that law: 0.03 by default, near several 0.003; a hundred "
        "times as much suits a few hundred states of a finer mesh",
    )
    fit.add_argument(
        "--near-another", action="store_true", help="allow the law of another actuator for --near"
    )
    fit.add_argument(
        "--ridges", type=count, default=None, help=f"ridge functions of the law (default: {_RIDGES})"
    )
    fit.add_argument(
        "--features",
        type=count,
        default=None,
        help=f"hidden functions of the pressures (default: {_FEATURES})",
    )
    fit.add_argument("--iterations", type=count, default=100, help="maximum iterations of the final training")
    fit.add_argument("--seed", type=seed, default=0, help="seed of the first start")
    add_pressures(fit, "", "")
    add_single(fit)
    fit.set_defaults(command=_fit)

    report, measured = _report.add_to(commands), _fit_measured.add_to(commands)
    (truth, judge), ends = _truth.add_to(commands), _ends.add_to(commands)
    bounds = _bounds.add_to(commands)
    scale, snapped = _scale.add_to(commands), _snapped.add_to(commands)
    for command in (design, run, fit, report, measured, truth, ends, bounds, judge, scale, snapped):
        command.add_argument("--json", action="store_true", help="one JSON object on stdout")
    return parser
