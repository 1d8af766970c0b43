"""Command-line parser and checked numbers, with errors of one line."""

import argparse
import re
from collections.abc import Sequence
from typing import Any, NoReturn

# Python's float also accepts 1_0 and the digits of other scripts, which are likely typing errors.
# Largest number of an option: sums and squares of such numbers are finite in any unit.
_LARGEST = 1e100
_NUMBER = re.compile(r"[-+]?([0-9]+\.?[0-9]*|\.[0-9]+)([eE][-+]?[0-9]+)?")


class InputError(Exception):
    """Bad input; the one-line message names the argument, the value and what is expected."""


class Parser(argparse.ArgumentParser):
    """Parser that raises an `InputError` instead of printing the usage and exiting."""

    def __init__(self, **options: Any) -> None:
        super().__init__(allow_abbrev=False, **options)
        # argparse takes -1e-3 and -inf for options. Here both are numbers; `numbers` refuses the second.
        self._negative_number_matcher = re.compile(
            r"-(\d+\.?\d*|\.\d+)(e[-+]?\d+)?$|-inf|-nan", re.IGNORECASE
        )

    def error(self, message: str) -> NoReturn:
        """Raise an `InputError`."""
        raise InputError(f"{message} (see {self.prog} --help)")


class Version(argparse.Action):
    """Print the version and end; the package's metadata is read then only, which takes a predict's time."""

    def __init__(self, **options: Any) -> None:
        super().__init__(nargs=0, help="print the version and end", **options)

    def __call__(self, parser: argparse.ArgumentParser, *_: Any) -> NoReturn:
        """Print and end."""
        from importlib.metadata import version

        print(f"{parser.prog} {version('rodmodel')}")
        parser.exit()


def numbers(flag: str, words: Sequence[str], count: int, expected: str, *, negative: bool) -> list[float]:
    """Return the values of an option: `count` finite numbers, negative ones only if allowed."""
    text = " ".join(words)
    values = [float(word) for word in words if _NUMBER.fullmatch(word)]
    good = all(abs(value) <= _LARGEST and (negative or value >= 0.0) for value in values)
    if len(values) != count or not good:
        raise InputError(f"{flag}: got {text!r}, expected {expected}")
    return values


def whole_number(flag: str, word: str, least: int, most: int) -> int:
    """Return the value of an option that is a whole number between two others."""
    # Python's int, too, accepts 1_0 and the digits of other scripts.
    value = int(word) if re.fullmatch(r"[0-9]{1,9}", word) else least - 1
    if not least <= value <= most:
        raise InputError(f"{flag}: got {word!r}, expected a whole number from {least} to {most}")
    return value
