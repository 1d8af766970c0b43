"""What studies of randomly drawn designs share: options, and a report of how many are good."""

import argparse
import json
import sys
from collections.abc import Callable, Iterator
from itertools import islice
from typing import Any, TypeVar

from fem_reference import prepare_process

D = TypeVar("D")


def arguments(description: str | None, designs: int) -> argparse.ArgumentParser:
    """Parser of such a study, for so many designs by default; its help begins with the first line."""
    parser = argparse.ArgumentParser(description=(description or "").splitlines()[0])
    parser.add_argument("--designs", type=int, default=designs, help="how many (default: %(default)s)")
    parser.add_argument("--first", type=int, default=0, help="number of the first one (default: %(default)s)")
    parser.add_argument("--seed", type=int, default=0, help="of the designs")
    parser.add_argument("--json", action="store_true", help="one JSON object on stdout")
    return parser


def report(
    options: argparse.Namespace,
    designs: Iterator[D],
    outcome: Callable[[int, D], dict[str, Any]],
    line: Callable[[dict[str, Any]], str],
    good: str,
    summary: str,
) -> None:
    """Find the outcome of each design, and print it in a line or all in one JSON object.

    Parameters
    ----------
    options : of `arguments`.
    designs : all that the seed draws.
    outcome : record of a design, by its number.
    line : record in words.
    good : key of a record that tells whether the design is good.
    summary : end of the last line, behind how many are good.
    """
    prepare_process()
    rows = []
    chosen = islice(designs, options.first, options.first + options.designs)
    for number, design in enumerate(chosen, start=options.first):
        rows.append(outcome(number, design))
        if not options.json:
            print(f"{number:3d} {line(rows[-1])}", flush=True)
    count = sum(row[good] for row in rows)
    if options.json:
        json.dump({good: count, "designs": rows}, sys.stdout)
    else:
        print(f"{count} of {len(rows)} {summary}")
