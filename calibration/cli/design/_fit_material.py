"""`rodmodel-design fit-material`: fit a material law to tests, and print it for a design file."""

import argparse
import sys
from pathlib import Path
from typing import TYPE_CHECKING

from calibration.cli._arguments import (
    GOOD,
    NOT_CONVERGED,
    BadInputError,
    Parser,
    complain,
    json_text,
    positive,
    refuse_unwritable,
)

if TYPE_CHECKING:
    from calibration.material import MaterialFit, MaterialTest

_PICTURES = (".pdf", ".png", ".svg")


def add_to(commands: "argparse._SubParsersAction[Parser]") -> Parser:
    """Add the command."""
    parser = commands.add_parser("fit-material", help="fit a material law to tensile tests")
    add = parser.add_argument
    add(
        "uniaxial",
        nargs="*",
        metavar="FILE",
        help="CSV file of a uniaxial test; see docs/how-to/fit_a_material.md",
    )
    add("--planar", nargs="+", default=[], metavar="FILE", help="tests of wide strips: planar tension")
    add("--biaxial", nargs="+", default=[], metavar="FILE", help="equibiaxial tests")
    add(
        "--gauge-length-mm",
        type=positive,
        default=None,
        metavar="L",
        help="length at rest between marks or clamps, for files of displacements",
    )
    add(
        "--area-mm2",
        type=positive,
        default=None,
        metavar="A",
        help="section at rest, for files of forces",
    )
    add(
        "--stretch-max",
        type=positive,
        default=None,
        metavar="STRETCH",
        help="leave out rows beyond this stretch; by default all count",
    )
    add("--out", default=None, metavar="FILE", help="TOML file of the material table to write")
    add(
        "--plot",
        default=None,
        metavar="FILE",
        help="plot of tests, laws and errors to write: PNG, PDF or SVG",
    )
    parser.set_defaults(command=_run)
    return parser


def _run(options: argparse.Namespace, command: str) -> int:
    from calibration.material import MaterialFitError, fit_material, fit_record, fit_table, material_lines
    from rodmodel.io import write_atomically

    tests = _tests(options)
    for flag, file in (("--out", options.out), ("--plot", options.plot)):
        if file is not None:
            refuse_unwritable(flag, Path(file))
    try:
        fit = fit_material(tests)
    except MaterialFitError as error:
        return complain(f"rodmodel-design fit-material: {error}; nothing written", NOT_CONVERGED)
    lines = material_lines(fit.material, fit.source)
    print(json_text(fit_record(fit)) if options.json else f"{fit_table(fit)}\n\n{lines}")
    if options.plot is not None:
        _draw(fit, Path(options.plot))
    for note in (*fit.notes, *fit.doubts):
        print(f"rodmodel-design fit-material: {note}", file=sys.stderr)
    if fit.doubts:
        nothing = "" if options.out is None else f"; {options.out} is not written"
        return complain(f"rodmodel-design fit-material: the law should not be used{nothing}", NOT_CONVERGED)
    if options.out is not None:
        write_atomically(options.out, f"# {command}\n{lines}\n")
    return GOOD


def _tests(options: argparse.Namespace) -> "list[MaterialTest]":
    """Read the tests of all modes."""
    from calibration.material import MaterialTestError, Specimen, read_material_test

    if options.plot is not None and Path(options.plot).suffix.lower() not in _PICTURES:
        raise BadInputError(f"--plot: got {options.plot!r}, expected a .pdf, .png or .svg file")
    specimen = Specimen(
        None if options.gauge_length_mm is None else 1e-3 * options.gauge_length_mm,
        None if options.area_mm2 is None else 1e-6 * options.area_mm2,
    )
    if options.stretch_max is not None and options.stretch_max <= 1.0:
        raise BadInputError(
            f"--stretch-max: got {options.stretch_max:g}, expected more than 1, as 1.5 for a strain of 50 %"
        )
    tests = []
    for mode in ("uniaxial", "planar", "biaxial"):
        for file in getattr(options, mode):
            try:
                test = read_material_test(Path(file), mode, specimen)
                tests.append(test if options.stretch_max is None else test.up_to(options.stretch_max))
            except MaterialTestError as error:
                raise BadInputError(str(error)) from error
    if not tests:
        raise BadInputError("FILE: got no test, expected at least one CSV file")
    return tests


def _draw(fit: "MaterialFit", file: Path) -> None:
    from calibration.material.plot import write_material_plot

    write_material_plot(fit, file)
