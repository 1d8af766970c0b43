"""Command ``rodmodel-fem``: the finite-element reference."""

import sys
from collections.abc import Sequence
from importlib.metadata import version

from fem_reference.cli import _actuator, _cell
from fem_reference.cli._arguments import BAD_INPUT, INTERRUPTED, InputError, Parser
from fem_reference.runtime import prepare_process

__all__ = ["main"]


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command.

    Returns
    -------
    status : 0 success; 2 bad input, with one line on standard error; 3 no convergence, with the last
        converged state printed; 130 interrupted.
    """
    prepare_process()
    parser = Parser(prog="rodmodel-fem", description="3D finite elements of a soft pneumatic actuator.")
    parser.add_argument("--version", action="version", version=f"%(prog)s {version('rodmodel')}")
    commands = parser.add_subparsers(required=True, metavar="cell | actuator")
    _cell.add_command(commands)
    _actuator.add_command(commands)
    try:
        options = parser.parse_args(arguments)
        status: int = options.command(options)
    except InputError as error:
        print(f"rodmodel-fem: {error}", file=sys.stderr)
        return BAD_INPUT
    except KeyboardInterrupt:
        print("rodmodel-fem: interrupted; steps in the directory of --run are kept", file=sys.stderr)
        return INTERRUPTED
    return status
