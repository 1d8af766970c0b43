"""Options for the pressures of a domain."""

import argparse
from dataclasses import replace
from typing import TYPE_CHECKING

from calibration.cli._arguments import BadInputError, not_negative, positive

if TYPE_CHECKING:
    from rodmodel import Domain


def add_pressures(parser: argparse.ArgumentParser, each: str, total: str) -> None:
    """Add the limits of the pressures, with what their help says of the defaults."""
    parser.add_argument(
        "--pressure-max-kpa",
        nargs=3,
        type=positive,
        default=None,
        metavar=("P1", "P2", "P3"),
        help=f"largest pressure of each chamber {each}".strip(),
    )
    parser.add_argument(
        "--pressure-sum-max-kpa",
        type=positive,
        default=None,
        help=f"largest sum of the pressures {total}".strip(),
    )
    parser.add_argument(
        "--pressure-beside",
        nargs=2,
        type=not_negative,
        default=None,
        metavar=("SHARE", "MAX_KPA"),
        help="of each chamber, its pressure and SHARE of the sum of the two others are at most MAX_KPA: the "
        "more one has, the less have those beside it (default: no such limit)",
    )


def add_single(parser: argparse.ArgumentParser) -> None:
    """Add the limits of a chamber alone."""
    parser.add_argument(
        "--single-kpa",
        nargs=4,
        type=not_negative,
        default=None,
        metavar=("P1", "P2", "P3", "BESIDE"),
        help="beyond the other limits, largest pressure of each chamber while the two others have at most "
        "BESIDE each; only as far as the law stands there (default: no more)",
    )


def with_single(domain: "Domain", options: argparse.Namespace) -> "Domain":
    """Return a domain with the limits of a chamber alone that the options give."""
    if options.single_kpa is None:
        return domain
    first, second, third, beside = (1e3 * p for p in options.single_kpa)
    return replace(domain, single_max=(first, second, third), single_beside=beside)


def with_pressures(domain: "Domain", options: argparse.Namespace) -> "Domain":
    """Return a domain with the limits that the options give.

    Raises
    ------
    BadInputError
        For a share above one, or no pressure at all.
    """
    if options.pressure_max_kpa is not None:
        first, second, third = (1e3 * p for p in options.pressure_max_kpa)
        domain = replace(domain, pressure_max=(first, second, third))
    if options.pressure_sum_max_kpa is not None:
        domain = replace(domain, pressure_sum_max=1e3 * options.pressure_sum_max_kpa)
    if options.pressure_beside is not None:
        share, most = options.pressure_beside
        if share > 1.0 or most == 0.0:
            raise BadInputError(
                f"--pressure-beside: got {share:g} {most:g}, expected a share from 0 to 1 and a positive "
                "pressure"
            )
        domain = replace(domain, beside_share=share, beside_max=1e3 * most)
    return domain
