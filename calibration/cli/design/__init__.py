"""Command ``rodmodel-design``: what an actuator is made of, before anything is computed."""

from collections.abc import Callable, Sequence
from typing import TypeAlias

from calibration.cli._arguments import Parser, run_command
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
    return run_command(_parser(), arguments, "interrupted")


def _parser() -> Parser:
    parser = Parser(prog="rodmodel-design", description="Materials and designs of actuators.")
    commands = parser.add_subparsers(required=True, metavar=" | ".join(_SUBCOMMANDS))
    for add_to in _SUBCOMMANDS.values():
        add_to(commands).add_argument("--json", action="store_true", help="one JSON object on stdout")
    return parser
