"""The command `rodmodel`: predictions of the compiled rod, as text or JSON."""

import os
import sys
from collections.abc import Sequence

from rodmodel.cli import _cycle, _export, _inverse, _layouts, _predict, _workspace
from rodmodel.cli._arguments import InputError, Parser, Version
from rodmodel.cli._options import BAD_INPUT

# Status of a program that SIGPIPE ends: 128 and the signal's number.
UNREAD = 141


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command.

    Returns
    -------
    status : 0 success; 2 bad input, with one line on standard error; 3 no convergence, with the state reached
        on standard output; 141 if the reader closed standard output early.
    """
    try:
        options = _parser().parse_args(arguments)
        status: int = options.command(options)
        sys.stdout.flush()
    except BrokenPipeError:
        # The reader closed the pipe (`| head`). Buffered output would fail again at exit.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return UNREAD
    except InputError as error:
        # Names of files and messages of the system may hold line breaks.
        print("rodmodel:", *str(error).split(), file=sys.stderr)
        return BAD_INPUT
    return status


def _parser() -> Parser:
    parser = Parser(
        prog="rodmodel", description="Bending of a soft pneumatic actuator, calibrated from 3D FEM."
    )
    parser.add_argument("--version", action=Version)
    names = "layouts | predict | cycle | inverse | workspace | export"
    commands = parser.add_subparsers(required=True, metavar=names)
    for command in (_layouts, _predict, _cycle, _inverse, _workspace, _export):
        command.add_to(commands)
    return parser
