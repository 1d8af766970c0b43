"""Tables and figure of the refinement study.

Run as ``python -m tests.benchmark.refinement.report [RUN] [--plot FILE] [--json]`` on what
``python -m tests.benchmark.refinement RUN`` has solved; without RUN, on the record that ships.
"""

import argparse
import json
import sys
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np

matplotlib.use("Agg")

import matplotlib.pyplot as plt
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from tests.benchmark.refinement.limits import Limit, limit
from tests.benchmark.refinement.meshes import FINEST, MESHES, WINDINGS
from tests.benchmark.refinement.solve import ONE, TWO, UPRIGHT, UPRIGHT_PATH, Solved

RECORD = Path(__file__).with_name("recorded.json")
#: Meshes that are judged; the others tell the limit.
JUDGED = ("linear x1", "linear x2", "quadratic x1", "fine", "finer")
_TITLES = {"linear x1": "coarse", "linear x2": "layered", "quadratic x1": "quadratic"}
_PATHS = {"chamber 1": ONE, "chambers 1+2": TWO}
_QUANTITIES = {"angle_deg": "angle", "plane_bending": "EI", "torsion": "GJ", "volume_1": "volume"}


def gathered(run: Path | None) -> dict[str, dict[str, Solved]]:
    """Solved states by winding and mesh, from a run's directory or from the record."""
    if run is None:
        rows = json.loads(RECORD.read_text())
    else:
        rows = [json.loads(file.read_text()) for file in sorted(run.glob("*.json"))]
    found: dict[str, dict[str, Solved]] = {name: {} for name in WINDINGS}
    for row in rows:
        here, solved = found[row["winding"]], Solved(**row)
        # Chamber 1 in its plane of symmetry is solved for by itself.
        before = here.get(solved.mesh)
        here[solved.mesh] = solved if before is None else before.joined(solved)
    return {name: meshes for name, meshes in found.items() if meshes}


def _known(found: dict[str, dict[str, Solved]]) -> dict[str, dict[str, Solved]]:
    """Windings of which both families of meshes came so far that there is a limit."""
    return {
        name: meshes
        for name, meshes in found.items()
        if any(limit(meshes, "chamber 1", p, "angle_deg") is not None for p in ONE)
    }


def worst(meshes: dict[str, Solved], name: str, key: str) -> tuple[float, Limit] | None:
    """Largest error of a mesh in a quantity over all states, with the limit there; None if not known."""
    found = []
    for path, pressures in _PATHS.items():
        for pressure in pressures:
            interval, value = limit(meshes, path, pressure, key), meshes[name].value(path, pressure, key)
            if interval is not None and np.isfinite(value):
                found.append((interval.error(value), interval))
    return max(found, key=lambda pair: abs(pair[0]), default=None)


def table(found: dict[str, dict[str, Solved]]) -> str:
    """Markdown table: by winding and mesh, the largest error of each quantity, and the limits' intervals."""
    rows = [
        "| winding | mesh | unknowns | " + " | ".join(_QUANTITIES.values()) + " |",
        "|" + " --- |" * (3 + len(_QUANTITIES)),
    ]
    for winding, meshes in found.items():
        for name in (mesh for mesh in JUDGED if mesh in meshes):
            cells = []
            for key in _QUANTITIES:
                pair = worst(meshes, name, key)
                cells.append(
                    "" if pair is None else f"{100 * pair[0]:+.1f} ± {100 * pair[1].half_width:.1f} %"
                )
            rows.append(
                f"| {winding} | {_TITLES.get(name, name)} | {meshes[name].unknowns} | {' | '.join(cells)} |"
            )
    return "\n".join(rows)


def upright_table(found: dict[str, dict[str, Solved]]) -> str:
    """Markdown table: angles of chamber 1 held upright, by mesh; nothing where walls fold before."""
    shown = [pressure for pressure in UPRIGHT if pressure >= 50.0]
    rows = [
        "| winding | mesh | " + " | ".join(f"{pressure:g} kPa" for pressure in shown) + " |",
        "|" + " --- |" * (2 + len(shown)),
    ]
    for winding, meshes in found.items():
        for name in (mesh.name for mesh in (*MESHES, FINEST)):
            if name in meshes and UPRIGHT_PATH in meshes[name].states:
                angles = [meshes[name].value(UPRIGHT_PATH, pressure, "angle_deg") for pressure in shown]
                cells = [f"{angle:.1f}°" if np.isfinite(angle) else "folded" for angle in angles]
                rows.append(f"| {winding} | {_TITLES.get(name, name)} | {' | '.join(cells)} |")
    return "\n".join(rows)


def draw(found: dict[str, dict[str, Solved]], file: Path) -> None:
    """Error of the angle under chamber 1 over the pressure, a panel for each winding."""
    columns = min(4, len(found) if len(found) <= 4 else -(-len(found) // 2))
    rows = -(-len(found) // columns)
    figure, axes = plt.subplots(
        rows,
        columns,
        figsize=(2.8 * columns + 0.6, 2.4 * rows + 0.6),
        sharex=True,
        sharey=True,
        layout="constrained",
        squeeze=False,
    )
    colours = {name: f"C{number}" for number, name in enumerate(JUDGED)}
    for axis, (winding, meshes) in zip(axes.flat, found.items(), strict=False):
        limits = [limit(meshes, "chamber 1", p, "angle_deg") for p in ONE]
        known = [(p, one) for p, one in zip(ONE, limits, strict=True) if one is not None]
        width = np.array([100 * one.half_width for _, one in known])
        axis.fill_between([p for p, _ in known], -width, width, color="0.85")
        for name in (mesh for mesh in JUDGED if mesh in meshes):
            errors = [100 * one.error(meshes[name].value("chamber 1", p, "angle_deg")) for p, one in known]
            axis.plot([p for p, _ in known], errors, "o-", ms=3, lw=1, color=colours[name])
        axis.set_title(winding.replace("psi", "ψ ="), fontsize=9)
        axis.axhline(0.0, color="0.5", lw=0.5)
        axis.set_ylim(-9, 5)
    for number, axis in enumerate(axes.flat):
        axis.tick_params(labelbottom=number + columns >= len(found))
    for axis in axes.flat[len(found) :]:
        axis.set_axis_off()
    figure.supxlabel("pressure in chamber 1 [kPa]", fontsize=9)
    figure.supylabel("angle relative to the limit [%]", fontsize=9)
    handles = [Patch(color="0.85", label="limit")] + [
        Line2D([], [], color=colours[name], marker="o", ms=3, lw=1, label=_TITLES.get(name, name))
        for name in JUDGED
        if any(name in meshes for meshes in found.values())
    ]
    figure.legend(handles=handles, loc="outside upper center", ncols=3, frameon=False, fontsize=8)
    figure.savefig(file, dpi=150)
    plt.close(figure)


def main() -> int:
    """Print the table, and draw the figure if asked to."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("run", nargs="?", type=Path, default=None)
    parser.add_argument("--plot", type=Path, default=None, metavar="FILE")
    parser.add_argument("--record", action="store_true", help="write the run's states to the record")
    parser.add_argument("--json", action="store_true", help="one JSON object on stdout")
    arguments = parser.parse_args()
    found = gathered(arguments.run)
    if arguments.record:
        RECORD.write_text(json.dumps(_rows(found), indent=0, separators=(",", ":")) + "\n")
    found = _known(found)
    if arguments.plot is not None:
        draw(found, arguments.plot)
    if arguments.json:
        errors = {
            winding: {
                name: {key: _error(meshes, name, key) for key in _QUANTITIES}
                for name in JUDGED
                if name in meshes
            }
            for winding, meshes in found.items()
        }
        print(json.dumps({"largest_errors": errors}))
    else:
        print(table(found))
        print(f"\nChamber 1 held upright in its plane of symmetry:\n\n{upright_table(found)}")
    return 0


def _error(meshes: dict[str, Solved], name: str, key: str) -> dict[str, float] | None:
    pair = worst(meshes, name, key)
    return None if pair is None else {"error": pair[0], "half_width": pair[1].half_width}


def _rows(found: dict[str, dict[str, Solved]]) -> list[dict[str, Any]]:
    order = [mesh.name for mesh in (*MESHES, FINEST)]
    return [vars(meshes[name]) for meshes in found.values() for name in order if name in meshes]


if __name__ == "__main__":
    sys.exit(main())
