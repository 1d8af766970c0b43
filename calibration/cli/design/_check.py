"""`rodmodel-design check`: every fault of a design file, before anything is meshed."""

import argparse
import sys

from calibration.cli._arguments import BAD_INPUT, GOOD, Parser, json_text
from calibration.cli._files import fit_silicone


def add_to(commands: "argparse._SubParsersAction[Parser]") -> Parser:
    """Add the command."""
    parser = commands.add_parser("check", help="say whether a design file is valid, or all its faults")
    parser.add_argument("design", metavar="FILE", help="design file, see docs/reference/design_file.md")
    parser.set_defaults(command=_run)
    return parser


def _run(options: argparse.Namespace, command: str) -> int:
    from fem_reference import DesignError, read_design

    try:
        design = read_design(options.design, fit_silicone)
    except DesignError as error:
        if options.json:
            faults = [fault._asdict() for fault in error.faults]
            print(json_text({"file": options.design, "valid": False, "faults": faults}))
        else:
            print(*error.lines, sep="\n", file=sys.stderr)
        return BAD_INPUT
    if options.json:
        print(json_text({"file": options.design, "valid": True, "faults": []}))
    else:
        print(f"{options.design}: {design.name} is a valid design")
    return GOOD
