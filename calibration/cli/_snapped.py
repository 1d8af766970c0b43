"""`rodmodel-calibrate snapped`: sweep a snapped sheet, fit its law, and write it into a calibration file."""

import argparse
import json
import math
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from calibration.cli._arguments import (
    GOOD,
    NOT_CONVERGED,
    BadInputError,
    complain,
    count,
    not_negative,
    positive,
    refuse_unwritable,
    seed,
)
from calibration.cli._files import read_calibration_file, read_design_file, write_calibration_file

if TYPE_CHECKING:
    from calibration.snapped import SnappedPlan
    from rodmodel import Calibration

_SIDES = {"larger": 1, "smaller": -1}


def add_to(commands: Any) -> argparse.ArgumentParser:
    """Add the command."""
    parser = commands.add_parser(
        "snapped", help="sweep the section after a wall has snapped, and add its law to a calibration file"
    )
    add = parser.add_argument
    add("file", help="calibration file with the law of the loading branch; it is written anew")
    add("--design", default=None, metavar="FILE", help="design file (default: the paper's actuator)")
    add("--chamber", type=count, required=True, help="chamber with the high pressure, 1 to 3")
    add("--side", choices=_SIDES, required=True, help="bending planes of the sheet beside the upright one")
    add(
        "--pressure-kpa",
        nargs=2,
        type=positive,
        required=True,
        metavar=("LEAST", "MOST"),
        help="range of that chamber's pressure; the sweep begins at MOST, where the walls must have snapped",
    )
    add("--beside-kpa", type=positive, required=True, help="largest pressure of each of the two others")
    add(
        "--upright-share",
        type=not_negative,
        required=True,
        help="share of the body's length that base and cap hold upright, 0 to 1",
    )
    add("--elements", default="coarse", help="mesh level (default: coarse)")
    add("--paths", type=count, default=30, help="loading paths, every fifth of them held out")
    add("--seed", type=seed, default=0, help="seed of the paths")
    add("--workers", type=count, default=2, help="processes, one thread each")
    add("--out", required=True, help="directory of the sweep")
    parser.set_defaults(command=_run)
    return parser


def _run(options: argparse.Namespace, command: str) -> int:
    from calibration.fit.same_section import UnlikeError, refuse_another_actuator
    from calibration.provenance import code_version, today
    from calibration.snapped import fit_snapped
    from calibration.sweep import RunError, SweepError, build_dataset, open_run, run_sweep, save_dataset
    from calibration.sweep.dataset import DatasetError
    from fem_reference import CellError
    from rodmodel.io import SnappedLaw

    calibration = read_calibration_file(options.file)
    refuse_unwritable("file", Path(options.file))
    plan = _plan(options, calibration)
    try:
        refuse_another_actuator(calibration, {**plan.description(), "material": plan.material})
    except UnlikeError as error:
        raise BadInputError(f"file: got {error}; --design tells its actuator") from error
    directory = Path(options.out)
    try:
        description = open_run(directory, plan, command, plan.material)
        paths = plan.design()
        records = run_sweep(plan.tracer(), paths, directory, options.workers)
        dataset = build_dataset(paths, records, description)
        save_dataset(dataset, directory / "dataset.nc")
    except RunError as error:
        raise BadInputError(str(error)) from error
    except (SweepError, DatasetError, CellError) as error:
        return complain(f"rodmodel-calibrate snapped: {error}", NOT_CONVERGED)
    length = plan.geometry.body_length
    outcome = fit_snapped(
        dataset,
        plan.sheet,
        calibration.section_law,
        calibration.domain,
        plan.domain,
        length,
        options.upright_share,
    )
    if outcome.complaint:
        return complain(f"rodmodel-calibrate snapped: {outcome.complaint}; nothing written", NOT_CONVERGED)
    provenance = {
        "command": command,
        "code_version": code_version(),
        "run_code_version": description["code_version"],
        "date": today(),
        "mesh": description["mesh"],
        "training": outcome.training,
    }
    from rodmodel.section import arrays_of

    found = SnappedLaw(
        plan.sheet.chamber, plan.sheet.side, arrays_of(outcome.law), outcome.domain, outcome.error, provenance
    )
    others = [law for law in calibration.snapped if (law.chamber, law.side) != (found.chamber, found.side)]
    write_calibration_file(replace(calibration, snapped=(*others, found)), options.file)
    angle = outcome.error["free_bending_angle_rad"]
    if options.json:
        print(json.dumps({"file": options.file, "states": dataset.sizes["state"], "error": outcome.error}))
    else:
        print(
            f"{dataset.sizes['state']} states; held-out free bending: median {_degrees(angle['median'])}, "
            f"95 % {_degrees(angle['p95'])}, worst {_degrees(angle['worst'])}"
        )
    return GOOD


def _plan(options: argparse.Namespace, calibration: "Calibration") -> "SnappedPlan":
    """Return the plan of the sweep, of the calibration's winding."""
    from calibration.snapped import SnappedPlan, SnappedSheet, sheet_domain
    from calibration.sweep import usual_end_compliance
    from fem_reference import Design, layout, mesh_level

    own = Design() if options.design is None else read_design_file("--design", options.design)
    least, most = (1e3 * p for p in options.pressure_kpa)
    if least >= most:
        raise BadInputError(
            f"--pressure-kpa: got {options.pressure_kpa[0]:g} {options.pressure_kpa[1]:g}, expected the "
            "least and then a larger one"
        )
    if options.upright_share > 1.0:
        raise BadInputError(f"--upright-share: got {options.upright_share:g}, expected 0 to 1")
    if calibration.layout.psi is None or calibration.law.is_adjusted:
        raise BadInputError(
            "file: got a law of all orientations or of measurements, expected that of one orientation"
        )
    try:
        sheet = SnappedSheet(options.chamber, _SIDES[options.side])
        level = options.elements
        mesh_level(level)
    except ValueError as error:
        raise BadInputError(f"--{error}") from error
    wound = layout(calibration.layout.name, calibration.layout.psi, calibration.layout.pitch)
    actuator = replace(own, winding=wound)
    compliance = own.end_compliance
    if compliance is None:
        compliance = usual_end_compliance(actuator)
    moments = calibration.domain.moment_axes
    domain = sheet_domain(
        sheet, (least, most), 1e3 * options.beside_kpa, 0.5 * float(moments[0]), 0.5 * float(moments[2])
    )
    return SnappedPlan(
        actuator=replace(actuator, end_compliance=compliance),
        level=level,
        domain=domain,
        paths=options.paths,
        seed=options.seed,
        end_compliance=compliance,
        sheet=sheet,
    )


def _degrees(angle: float) -> str:
    return f"{math.degrees(angle):.2f} deg"
