"""Shared parts of the commands: exit statuses, errors in one line, and argument types."""

import argparse
import json
import math
import os
import shlex
import sys
from collections.abc import Callable, Mapping, Sequence
from importlib.metadata import version
from pathlib import Path
from typing import Any, NoReturn

# Largest seed: that of a word of 64 bits, which all generators take.
_MOST_SEED = 2**63 - 1

GOOD, BAD_INPUT, NOT_CONVERGED = 0, 2, 3
#: Exit status after Ctrl-C, as in shells.
INTERRUPTED = 130
#: Exit status of a program that SIGPIPE ends.
UNREAD = 141


class BadInputError(ValueError):
    """Error for bad input; the message is one line."""


class Parser(argparse.ArgumentParser):
    """Parser whose errors are one line."""

    def error(self, message: str) -> NoReturn:
        """Print the error in one line and exit."""
        self.exit(BAD_INPUT, f"{self.prog}: {message}\n")


def run_command(parser: Parser, arguments: Sequence[str] | None, after_interrupt: str) -> int:
    """Run the command that a parser's options name, in double precision, and return the exit status.

    Parameters
    ----------
    parser : parser whose options have ``command``, a function of the options and the command's text.
    arguments : of the command line; by default the process'.
    after_interrupt : what is told after Ctrl-C.
    """
    import jax

    jax.config.update("jax_enable_x64", True)
    parser.add_argument("--version", action="version", version=f"%(prog)s {version('rodmodel')}")
    given = sys.argv[1:] if arguments is None else list(arguments)
    options = parser.parse_args(given)
    try:
        status: int = options.command(options, shlex.join([parser.prog, *given]))
        sys.stdout.flush()
    except BadInputError as error:
        return complain(f"{parser.prog}: {' '.join(str(error).split())}", BAD_INPUT)
    except KeyboardInterrupt:
        return complain(f"{parser.prog}: {after_interrupt}", INTERRUPTED)
    except BrokenPipeError:
        # The reader closed the pipe (`| head`). Buffered output would fail again at exit.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return UNREAD
    return status


def refuse_unwritable(argument: str, file: Path) -> None:
    """Refuse a file that cannot be written, before the work begins."""
    try:
        with file.open("a"):
            pass
        if file.stat().st_size == 0:
            file.unlink()
    except OSError as error:
        raise BadInputError(
            f"{argument}: got {file} ({error.strerror}), expected a path that can be written"
        ) from error


def complain(message: str, status: int) -> int:
    """Print a message on standard error; return the status."""
    print(message, file=sys.stderr)
    return status


def json_text(answer: Any) -> str:
    """Return one JSON object, with null for infinity and NaN, which JSON does not have."""

    def finite(value: Any) -> Any:
        if isinstance(value, Mapping):
            return {key: finite(inner) for key, inner in value.items()}
        if isinstance(value, list | tuple):
            return [finite(inner) for inner in value]
        return None if isinstance(value, float) and not math.isfinite(value) else value

    return json.dumps(finite(answer), allow_nan=False)


def _checked(expected: str, valid: Callable[[float], bool]) -> Callable[[str], float]:
    def convert(text: str) -> float:
        try:
            value = float(text)
        except ValueError:
            value = math.nan
        if not valid(value):
            raise argparse.ArgumentTypeError(f"got {text!r}, expected {expected}")
        return value

    return convert


number = _checked("a finite number", math.isfinite)
not_negative = _checked("a number that is not negative", lambda value: math.isfinite(value) and value >= 0)
positive = _checked("a positive number", lambda value: math.isfinite(value) and value > 0)


def seed(text: str) -> int:
    """Parse the seed of random numbers, a whole number of 0 or more."""
    if not text.isdecimal() or int(text) > _MOST_SEED:
        raise argparse.ArgumentTypeError(f"got {text!r}, expected a whole number from 0 to {_MOST_SEED}")
    return int(text)


def count(text: str) -> int:
    """Parse a whole number of at least 1."""
    if not text.isdecimal() or int(text) < 1:
        raise argparse.ArgumentTypeError(f"got {text!r}, expected a whole number of at least 1")
    return int(text)
