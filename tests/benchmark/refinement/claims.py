"""What the study can tell of the paper's claims: ``python -m tests.benchmark.refinement.claims [RUN]``.

An angle's interval is that of its limit, and two windings are compared mesh by mesh alike. Where the interval
of a difference holds zero, the meshes cannot tell. Without RUN, the record that ships is read.
"""

import argparse
import sys
from pathlib import Path

from tests.benchmark.refinement.limits import Limit, difference, limit
from tests.benchmark.refinement.report import gathered
from tests.benchmark.refinement.solve import Solved

PRESSURES = (20.0, 40.0, 50.0)
#: What the paper says to bend more, and what less.
CLAIMS = (
    ("chamber 1 bends more than 2 and 3 at ψ = 0", "psi 0", "psi 60"),
    ("the larger ψ', the less it bends", "psi 0", "psi 30"),
    ("", "psi 30", "psi 45"),
    ("", "psi 45", "psi 60"),
    ("", "psi 60", "psi 90"),
    ("a larger pitch bends more", "pitch 4", "psi 0"),
    ("", "psi 0", "pitch 2"),
    ("", "pitch 6", "pitch 4"),
    ("six helices bend less than a double one", "psi 0", "six helices"),
    ("rings bend less than a double helix", "psi 0", "rings"),
    ("rings bend more than six helices", "rings", "six helices"),
)


def angles(found: dict[str, dict[str, Solved]]) -> str:
    """Markdown table of the angles' limits under one chamber and two."""
    head = [f"{name}, {p:g} kPa" for name in ("chamber 1", "chambers 1+2") for p in PRESSURES]
    rows = [f"| winding | {' | '.join(head)} |", "|" + " --- |" * (len(head) + 1)]
    for winding, meshes in found.items():
        cells = [
            _shown(limit(meshes, path, p, "angle_deg"))
            for path in ("chamber 1", "chambers 1+2")
            for p in PRESSURES
        ]
        rows.append(f"| {winding} | {' | '.join(cells)} |")
    return "\n".join(rows)


def claims(found: dict[str, dict[str, Solved]]) -> str:
    """Markdown table of the differences that the claims are about, with what they tell."""
    head = [f"{p:g} kPa" for p in PRESSURES]
    rows = [f"| claim | of | against | {' | '.join(head)} |", "|" + " --- |" * (len(head) + 3)]
    for text, more, less in CLAIMS:
        if more in found and less in found:
            cells = [_judged(found[more], found[less], p) for p in PRESSURES]
            rows.append(f"| {text} | {more} | {less} | {' | '.join(cells)} |")
    return "\n".join(rows)


def spreads(found: dict[str, dict[str, Solved]]) -> str:
    """Markdown table of how far the three chambers are apart, by ψ and pressure.

    Chamber k at ψ is chamber 1 at the angle from it to its nearest crossing.
    """
    of = {"0": ("psi 0", "psi 60"), "30": ("psi 30", "psi 90")}
    rows = [f"| ψ [deg] | {' | '.join(f'{p:g} kPa' for p in PRESSURES)} |", "|" + " --- |" * 4]
    for psi, (first, second) in of.items():
        if first in found and second in found:
            cells = [
                _shown(difference(found[first], found[second], "chamber 1", p, "angle_deg"))
                for p in PRESSURES
            ]
            rows.append(f"| {psi} | {' | '.join(cells)} |")
    return "\n".join(rows)


def _judged(more: dict[str, Solved], less: dict[str, Solved], pressure: float) -> str:
    interval = difference(more, less, "chamber 1", pressure, "angle_deg")
    if interval is None:
        return ""
    told = "holds" if interval.least > 0.0 else "does not" if interval.most < 0.0 else "cannot be told"
    return f"{_shown(interval)}: {told}"


def _shown(interval: Limit | None) -> str:
    if interval is None:
        return ""
    return f"{interval.middle:.2f} ± {0.5 * (interval.most - interval.least):.2f}°"


def main() -> int:
    """Print the tables."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("run", nargs="?", type=Path, default=None)
    found = gathered(parser.parse_args().run)
    print(angles(found), claims(found), spreads(found), sep="\n\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
