"""`rodmodel layouts`: the shipped calibrations."""

import argparse
import json

from rodmodel.cli._options import GOOD, add_output
from rodmodel.io import calibration_record, calibration_text, shipped_calibrations


def add_to(commands: "argparse._SubParsersAction[argparse.ArgumentParser]") -> None:
    """Add the command."""
    parser = commands.add_parser(
        "layouts", help="list the shipped calibrations: validity, error against the FEM"
    )
    add_output(parser, plot=None)
    parser.set_defaults(command=_run)


def _run(options: argparse.Namespace) -> int:
    records = [calibration_record(calibration) for calibration in shipped_calibrations()]
    print(
        json.dumps({"calibrations": records}) if options.json else "\n".join(map(calibration_text, records))
    )
    return GOOD
