"""Command ``rodmodel-design``: what an actuator is made of, before anything is computed."""

import shlex
import sys
from collections.abc import Callable, Sequence
from typing import TypeAlias

from calibration.cli._arguments import BAD_INPUT, INTERRUPTED, BadInputError, Parser, complain
from calibration.cli.design import _check, _fit_material, _show

# Each adds one subcommand to the parser, in the order of the help.
AddTo: TypeAlias = Callable[..., Parser]
_SUBCOMMANDS: dict[str, AddTo] = {
    "check": _check.add_to,
    "show": _show.add_to,
    "fit-material": _fit_material.add_to,
}


def main(arguments: Sequence[str] | None = None) -> int:
    """Run ``rodmodel-design`` and return the exit status."""
    import jax

    jax.config.update("jax_enable_x64", True)
    given = sys.argv[1:] if arguments is None else list(arguments)
    parser = _parser()
    options = parser.parse_args(given)
    command = shlex.join([parser.prog, *given])
    try:
        status: int = options.command(options, command)
    except BadInputError as error:
        return complain(f"{parser.prog}: {' '.join(str(error).split())}", BAD_INPUT)
    except KeyboardInterrupt:
        return complain(f"{parser.prog}: interrupted", INTERRUPTED)
    return status


def _parser() -> Parser:
    parser = Parser(prog="rodmodel-design", description="Materials and designs of actuators.")
    commands = parser.add_subparsers(required=True, metavar=" | ".join(_SUBCOMMANDS))
    for add_to in _SUBCOMMANDS.values():
        add_to(commands).add_argument("--json", action="store_true", help="one JSON object on stdout")
    return parser
