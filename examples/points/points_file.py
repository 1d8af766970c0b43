"""What the scripts that make finite-element points share: the cell, options, and a file that grows."""

import argparse
import json
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from rich.progress import track

from calibration.sweep import usual_end_compliance
from fem_reference import Design, PeriodCell, Winding, prepare_process

# The silicone slides as it does in the sweeps of calibrations.
END_COMPLIANCE = usual_end_compliance(Design())
Three = tuple[float, float, float]


def wound_cell(winding: Winding, level: str) -> PeriodCell:
    """The paper's cell with a winding."""
    return PeriodCell(winding=winding, level=level, end_compliance=END_COMPLIANCE)


def pascals(kilopascals: float, way: Three) -> Three:
    """Pressures of the three chambers [Pa]: a pressure [kPa] times the share of each."""
    return 1e3 * kilopascals * way[0], 1e3 * kilopascals * way[1], 1e3 * kilopascals * way[2]


def arguments(description: str | None, file: Path, mesh: str | None = None) -> argparse.ArgumentParser:
    """Arguments of such a script; ``mesh`` is the default level, None for that of each winding."""
    parser = argparse.ArgumentParser(description=description)
    parser.add_argument("file", nargs="?", type=Path, default=file)
    parser.add_argument("--only", nargs="+", metavar="NAME", help="paths to follow")
    told = mesh or "the winding's own"
    parser.add_argument("--elements", default=mesh, help=f"mesh level (default: {told})")
    return parser


def complete(
    options: argparse.Namespace,
    paths: Sequence[tuple[Any, ...]],
    trace: Callable[[Any, Any], dict[str, Any]],
) -> None:
    """Follow the paths that the file lacks, each on the mesh level asked for, and keep it once it is done.

    The first entry of a path is its name.
    """
    prepare_process()
    held = json.loads(options.file.read_text()) if options.file.exists() else {}
    wanted = [p for p in paths if p[0] not in held and (options.only is None or p[0] in options.only)]
    for path in track(wanted, "paths"):
        held[path[0]] = trace(path, options.elements)
        options.file.parent.mkdir(parents=True, exist_ok=True)
        partial = options.file.with_suffix(".part")
        partial.write_text(json.dumps(held, indent=1) + "\n")
        partial.replace(options.file)
    print(f"{len(held)} paths in {options.file}")
