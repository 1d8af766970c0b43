"""`rodmodel-calibrate truth` and `judge`: runs of the full actuator, and the rods against them."""

import argparse
import json
import math
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

from calibration.cli._arguments import GOOD, NOT_CONVERGED, BadInputError, Parser, complain, refuse_unwritable
from calibration.cli._files import read_truth

if TYPE_CHECKING:
    from calibration.truth.cases import TruthCase
    from calibration.truth.snapped_states import SnappedState

_ROWS = {
    "tip_percent": "tip, % of length",
    "angle_deg": "bending angle to 150 deg [deg]",
    "loaded_tip_percent": "tip under loads, % of length",
    "loaded_angle_deg": "bending angle under loads [deg]",
    "plane_deg": "bending plane [deg]",
    "response_percent": "way under a tip force, % of it",
    "volume_mm3": "chamber volumes [mm3]",
}


def add_to(commands: "argparse._SubParsersAction[Parser]") -> tuple[Parser, Parser]:
    """Add both commands."""
    parser = commands.add_parser("truth", help="run cases of the full actuator, and gather them")
    add = parser.add_argument
    add("cases", nargs="*", metavar="CASE", help="names of cases to run; none lists them all")
    add("--out", default=None, metavar="DIR", help="directory of the runs; an interrupted run resumes")
    add("--elements", default="coarse", help="mesh level (default: %(default)s)")
    add(
        "--gather", default=None, metavar="FILE", help="netCDF file for the runs of DIR; its other cases stay"
    )
    parser.set_defaults(command=_run)
    judge = commands.add_parser("judge", help="shipped rods against the judge runs of the full actuator")
    judge.add_argument("truth", nargs="?", help="netCDF file of `truth --gather` (default: the shipped runs)")
    judge.add_argument(
        "--role", default="judge", choices=["judge", "fit"], help="role of the runs (default: %(default)s)"
    )
    judge.set_defaults(command=_judge)
    return parser, judge


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


def _judge(options: argparse.Namespace, command: str) -> int:
    from calibration.report.all_layouts import coverage_rows
    from calibration.truth.compare_rods import compare_with_truth, judgement
    from calibration.truth.error_bounds import coverage_by
    from calibration.truth.snapped_states import compare_snapped

    truth = read_truth(options.truth)
    verdict = compare_with_truth(truth)
    found, shares = judgement(verdict, options.role), coverage_by(verdict, options.role)
    snapped = compare_snapped(truth) if options.role == "judge" else ()
    if options.json:
        print(json.dumps({**found, "coverage": shares, "snapped": [asdict(state) for state in snapped]}))
        return _status(found, options)
    inside = (
        f"{found['judged']} of {found['states']} states of {options.role} runs are inside the rods' domains"
    )
    after = sum(state.in_domain for state in snapped)
    print(f"{inside}, and {after} more inside those of snapped branches" if after else inside)
    print(f"{'':32s} {'median':>8s} {'95 %':>8s} {'worst':>8s}   at")
    for key, title in _ROWS.items():
        if key in found:
            row: dict[str, Any] = found[key]
            where = ", ".join(f"{p:g}" for p in row["worst_at"]["pressure_kpa"])
            numbers = " ".join(f"{row[name]:8.2f}" for name in ("median", "p95", "worst"))
            print(f"{title:32s} {numbers}   {row['worst_at']['case']}, {where} kPa")
    if shares["all"]["states"]:
        print(
            f"\n{'within the 90 % bound, limit of fine meshes':44s} {'states':>6s} {'angle':>7s} {'tip':>7s}"
        )
        for name, kept in coverage_rows(shares):
            cells = ("—" if kept[key] is None else f"{100.0 * kept[key]:.0f} %" for key in ("angle", "tip"))
            print(f"{name:44s} {kept['states']:6d} " + " ".join(f"{cell:>7s}" for cell in cells))
    if "median_bound_below_30_kpa_deg" in shares:
        print(f"median bound of the angle below 30 kPa: {shares['median_bound_below_30_kpa_deg']:.2f} deg")
    _print_snapped(snapped)
    return _status(found, options)


def _print_snapped(states: "Sequence[SnappedState]") -> None:
    if not states:
        return
    print(
        f"\n{'after a snap':28s} {'kPa':>6s} {'angle':>7s} {'rod':>7s} {'plane':>7s} {'rod':>7s} {'tip':>7s}"
    )
    for state in states:
        angle, plane = math.degrees(state.angle), math.degrees(state.plane)
        rod_angle = angle + math.degrees(state.angle_error)
        rod_plane = plane + math.degrees(state.plane_error)
        print(
            f"{state.case:28s} {1e-3 * max(state.pressure):6.1f} {angle:7.1f} {rod_angle:7.1f} "
            f"{plane:7.1f} {rod_plane:7.1f} {100.0 * state.tip:5.1f} %"
        )


def _status(found: dict[str, Any], options: argparse.Namespace) -> int:
    """Return the exit status: without a judged state no rod has passed."""
    if found["judged"]:
        return GOOD
    runs = options.truth or "the runs that ship"
    return complain(
        f"rodmodel-calibrate judge: {runs}: none of {found['states']} states of {options.role} runs "
        "can be judged: no law of their winding covers them",
        NOT_CONVERGED,
    )
