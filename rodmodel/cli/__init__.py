"""The command `rodmodel`: predictions of the compiled rod, for people and for programs."""

import os
import sys
from collections.abc import Sequence

from rodmodel.cli import _export, _inverse, _layouts, _predict, _workspace
from rodmodel.cli._arguments import InputError, Parser
from rodmodel.cli._options import BAD_INPUT

UNREAD = 141


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command.

    Returns
    -------
    status : 0 good; 2 bad input, told in one line on standard error; 3 no convergence, with what was reached;
        141 as of other commands (128 and the number of SIGPIPE) where the output was not read to its end.
    """
    try:
        options = _parser().parse_args(arguments)
        status: int = options.command(options)
        sys.stdout.flush()
    except BrokenPipeError:
        # Whoever reads has had enough (`| head`). What is still unwritten would fail anew at exit.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return UNREAD
    except InputError as error:
        # One line, whatever a file name or the system put into it.
        print("rodmodel:", *str(error).split(), file=sys.stderr)
        return BAD_INPUT
    return status


def _parser() -> Parser:
    parser = Parser(
        prog="rodmodel", description="Bending of a soft pneumatic actuator, calibrated from 3D FEM."
    )
    names = "layouts | predict | inverse | workspace | export"
    commands = parser.add_subparsers(required=True, metavar=names)
    for command in (_layouts, _predict, _inverse, _workspace, _export):
        command.add_to(commands)
    return parser
