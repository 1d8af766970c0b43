"""`rodmodel-calibrate judge`: compare the rods with the full actuator."""

import argparse
import json
from typing import Any

from calibration.cli._arguments import GOOD, NOT_CONVERGED, Parser, complain
from calibration.cli._files import read_truth

_ROWS = {
    "tip_percent": "tip, % of length",
    "angle_deg": "bending angle to 150 deg [deg]",
    "loaded_tip_percent": "tip under loads, % of length",
    "loaded_angle_deg": "bending angle under loads [deg]",
    "plane_deg": "bending plane [deg]",
    "response_percent": "way under a tip force, % of it",
    "volume_mm3": "chamber volumes [mm3]",
}


def add_to(commands: "argparse._SubParsersAction[Parser]") -> Parser:
    """Add the command."""
    judge = commands.add_parser("judge", help="shipped rods against the judge runs of the full actuator")
    judge.add_argument("truth", nargs="?", help="netCDF file of `truth --gather` (default: the shipped runs)")
    judge.add_argument(
        "--role", default="judge", choices=["judge", "fit"], help="role of the runs (default: %(default)s)"
    )
    judge.set_defaults(command=_judge)
    return judge


def _judge(options: argparse.Namespace, command: str) -> int:
    from calibration.report.all_layouts import coverage_rows
    from calibration.truth.compare_rods import compare_with_truth, judgement
    from calibration.truth.error_bounds import coverage_by

    verdict = compare_with_truth(read_truth(options.truth))
    found, shares = judgement(verdict, options.role), coverage_by(verdict, options.role)
    if options.json:
        print(json.dumps({**found, "coverage": shares}))
        return _status(found, options)
    print(
        f"{found['judged']} of {found['states']} states of {options.role} runs are inside the rods' domains"
    )
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
    return _status(found, options)


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
