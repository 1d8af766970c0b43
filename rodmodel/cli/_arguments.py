"""Command-line arguments: the parser, and checked numbers, with errors of one line."""

import argparse
import math
import re
from collections.abc import Sequence
from typing import Any, NoReturn

# Python reads 1_0 and the digits of other scripts as numbers too; typed by mistake, they are told.
_NUMBER = re.compile(r"[-+]?([0-9]+\.?[0-9]*|\.[0-9]+)([eE][-+]?[0-9]+)?")


class InputError(Exception):
    """Bad input; the message names the argument, what came and what is expected, in one line."""


class Parser(argparse.ArgumentParser):
    """Parser that raises its complaint instead of printing a usage and leaving the process."""

    def __init__(self, **options: Any) -> None:
        super().__init__(allow_abbrev=False, **options)
        # argparse takes -1e-3 and -inf for options; these are numbers, the second one to be refused as such.
        self._negative_number_matcher = re.compile(
            r"-(\d+\.?\d*|\.\d+)(e[-+]?\d+)?$|-inf|-nan", re.IGNORECASE
        )

    def error(self, message: str) -> NoReturn:
        """Raise the complaint."""
        raise InputError(f"{message} (see {self.prog} --help)")


def numbers(flag: str, came: Sequence[str], count: int, expected: str, *, negative: bool) -> list[float]:
    """Values of an option: `count` finite numbers, negative ones only where they may be."""
    text = " ".join(came)
    values = [float(value) for value in came if _NUMBER.fullmatch(value)]
    good = all(math.isfinite(value) and (negative or value >= 0.0) for value in values)
    if len(values) != count or not good:
        raise InputError(f"{flag}: got {text!r}, expected {expected}")
    return values
