"""`rodmodel-calibrate bounds`: torsion in the limit of fine meshes, and bounds of the rods' errors."""

import argparse
import json
import math
from collections.abc import Sequence
from dataclasses import replace
from importlib.resources import files
from pathlib import Path
from typing import TYPE_CHECKING, Any

from calibration.cli._arguments import GOOD, BadInputError, Parser
from calibration.cli._files import read_calibration_file, read_truth, write_calibration_file

if TYPE_CHECKING:
    from calibration.truth import SnappedState
    from rodmodel import Calibration, ErrorBound
    from rodmodel.io import SnappedLaw


def add_to(commands: "argparse._SubParsersAction[Parser]") -> Parser:
    """Add the command."""
    bounds = commands.add_parser(
        "bounds",
        help="torsion in the limit of fine meshes, bounds of angle and tip from the truth of other layouts, "
        "and where runs jumped, written to calibration files",
    )
    bounds.add_argument(
        "files", nargs="*", metavar="FILE", help="calibration files to write (default: all that ship)"
    )
    bounds.add_argument(
        "--truth",
        default=None,
        metavar="FILE",
        help="runs of the full actuator, as `truth --gather` writes them (default: the shipped runs)",
    )
    bounds.set_defaults(command=_bounds)
    return bounds


def _bounds(options: argparse.Namespace, command: str) -> int:
    from calibration.from_design import design_of
    from calibration.provenance import code_version, sha256, today
    from calibration.truth.compare_rods import compare_with_truth
    from calibration.truth.dataset import SHIPPED
    from calibration.truth.error_bounds import BoundError, bound_for, scales
    from calibration.truth.jump_limits import jump_limits
    from calibration.truth.mesh_limits import SHIPPED_LIMITS
    from calibration.truth.mesh_torsion import at_limit, torsion_ratio
    from calibration.truth.snapped_states import compare_snapped

    shipped = sorted(Path(str(files("rodmodel"))).joinpath("calibrations").glob("*.json"))
    calibrations = {file: read_calibration_file(file) for file in options.files or map(str, shipped)}
    for file, calibration in calibrations.items():
        if calibration.law.is_adjusted:
            raise BadInputError(
                f"{file}: got a law adjusted to measurements, expected the map that it was made of"
            )
    truth = read_truth(options.truth)
    about = {
        "command": command,
        "code_version": code_version(),
        "date": today(),
        "mesh_limits_sha256": sha256(SHIPPED_LIMITS),
    }
    # The rods that ship are compared with the truth below, with their torsion.
    carried = {file: at_limit(c, design_of(c), about) for file, c in calibrations.items()}
    for file in (file for file, made in carried.items() if made is not calibrations[file]):
        write_calibration_file(replace(carried[file], bound=None), file)
    calibrations, about = carried, {**about, "truth_sha256": sha256(Path(options.truth or SHIPPED))}
    try:
        verdict = compare_with_truth(truth)
        scale = scales(verdict)
        made = {file: bound_for(verdict, scale, c.layout) for file, c in calibrations.items()}
    except BoundError as error:
        raise BadInputError(str(error)) from error
    after_jumps = compare_snapped(truth)
    for file, calibration in calibrations.items():
        bound, note = made[file]
        provenance = {**calibration.provenance, "bound": {**about, **note}}
        snapped = tuple(_told(sheet, calibration, after_jumps) for sheet in calibration.snapped)
        jumps = jump_limits(truth, calibration.layout)
        write_calibration_file(
            replace(calibration, bound=bound, provenance=provenance, snapped=snapped, jumps=jumps), file
        )
    if options.json:
        rows = [
            {
                "file": file,
                "torsion_ratio": torsion_ratio(calibrations[file]),
                "bound": _record(bound),
                **note,
            }
            for file, (bound, note) in made.items()
        ]
        print(json.dumps({"bounds": rows}))
        return GOOD
    for file, (bound, note) in made.items():
        _print(file, bound, note)
        share = 100.0 * torsion_ratio(calibrations[file])
        print(f"  torsional stiffness {share:.1f} % of that on the mesh of the sweep")
    return GOOD


def _told(sheet: "SnappedLaw", calibration: "Calibration", states: "Sequence[SnappedState]") -> "SnappedLaw":
    """Return a snapped law with its largest errors against runs that jumped, if there are any."""
    from calibration.truth.snapped_states import largest_errors

    length = float(calibration.actuator.body_length)
    actuator = largest_errors(states, calibration.layout, (sheet.chamber, sheet.side), length)
    cell = {name: value for name, value in sheet.error.items() if name != "actuator"}
    return replace(sheet, error=cell if actuator is None else {**cell, "actuator": actuator})


def _record(bound: "ErrorBound") -> dict[str, Any]:
    at_nodes = [bound.at(0.0, bending_angle=node) for node in bound.bending_angle]
    return {
        "bending_angle_deg": [math.degrees(node) for node in bound.bending_angle],
        "angle_deg": [math.degrees(angle) for angle, _ in at_nodes],
        "tip_mm": [1e3 * tip for _, tip in at_nodes],
        "angle_deg_per_nmm": 1e-3 * math.degrees(bound.angle_per_moment),
        "tip_mm_per_nmm": bound.tip_per_moment,
    }


def _print(file: str, bound: "ErrorBound", note: dict[str, Any]) -> None:
    record, own = _record(bound), note["own_judge_states"]
    states = note["judge_states_of_other_layouts"]
    print(f"{file}: from {sum(states.values())} judge states of {len(states)} other layouts")
    rows = (("bent by, deg", "bending_angle_deg", "{:8.0f}"), ("deg", "angle_deg", "{:8.2f}"))
    for unit, key, form in (*rows, ("mm", "tip_mm", "{:8.2f}")):
        print(f"  {unit:12s}" + "".join(form.format(value) for value in record[key]))
    print(
        f"  and {record['angle_deg_per_nmm']:.2f} deg, {record['tip_mm_per_nmm']:.2f} mm "
        "for each N mm on the base"
    )
    if own["states"]:
        shares = f"{100.0 * own['angle']:.0f} % of angles, {100.0 * own['tip']:.0f} % of tips"
        print(f"  covers {shares} of its own {own['states']} judge states")
