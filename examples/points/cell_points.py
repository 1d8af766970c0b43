"""Finite-element points for the figures of the other examples: bending of the period cell, path by path.

Run as ``python examples/points/cell_points.py [FILE] [--only NAME ...]``. It takes some half an hour, keeps
every path as soon as it is finished, and passes over those that the file has. The file that ships is
examples/data/cell_points.json.

One chamber alone depends on the winding by the angle from its centre to the nearest crossing of the threads
alone (the paper's ψ'), by the symmetries of the section: chamber 1 at ψ = 0, 15, ..., 90 degrees stands for
every chamber at every orientation in those steps.
"""

import math
from pathlib import Path
from typing import Any

from points_file import END_COMPLIANCE, Three, arguments, complete, pascals, wound_cell

from fem_reference import CellError, Load, converged_level, follow, layout

FILE = Path(__file__).parents[1] / "data" / "cell_points.json"
SINGLE_KPA = [5.0 * n for n in range(1, 15)]
PAIR_KPA = [5.0 * n for n in range(1, 11)]
# name, layout, ψ [deg], pitch [mm], which chambers, pressures [kPa]
Path_ = tuple[str, str, float, float, Three, list[float]]


def paths() -> list[Path_]:
    """All paths."""
    first = (1.0, 0.0, 0.0)
    listed: list[Path_] = [
        (f"psi{psi}", "double-helix", float(psi), 3.0, first, SINGLE_KPA) for psi in range(0, 91, 15)
    ]
    for pitch in (2.0, 4.0):
        for psi in (0.0, 60.0):
            listed.append((f"pitch{pitch:g}-psi{psi:g}", "double-helix", psi, pitch, first, SINGLE_KPA))
    listed += [(name, name, 0.0, 3.0, first, SINGLE_KPA) for name in ("ring", "six-helix")]
    listed += [
        ("psi0-pair12", "double-helix", 0.0, 3.0, (1.0, 1.0, 0.0), PAIR_KPA),
        ("psi0-pair23", "double-helix", 0.0, 3.0, (0.0, 1.0, 1.0), PAIR_KPA),
    ]
    return listed


def trace(path: Path_, level: str | None, last_kpa: float) -> dict[str, Any]:
    """Follow one path up to a pressure, over jumps where walls snap; on the winding's own mesh by default."""
    _, winding, psi, pitch, way, pressures = path
    wound = layout(winding, math.radians(psi), 1e-3 * pitch)
    level = level or converged_level(wound)
    pressures = [p for p in pressures if p <= last_kpa]
    loads = [Load(pascals(p, way)) for p in pressures]
    found: dict[str, list[Any]] = {
        "pressure_kpa": [],
        "angle_deg": [],
        "plane_deg": [],
        "jumped": [],
        "stable": [],
    }
    end = "reached"
    try:
        cell = wound_cell(wound, level)
        for p, state in zip(pressures, follow(cell, loads), strict=False):
            angle, plane = state.bending(cell.geometry.body_length)
            found["pressure_kpa"].append(p)
            found["angle_deg"].append(math.degrees(angle))
            found["plane_deg"].append(math.degrees(plane) % 360.0)
            found["jumped"].append(bool(state.jumped))
            found["stable"].append(state.stable)
    except CellError as error:
        end = str(error)
    return {
        "layout": winding,
        "psi_deg": psi,
        "pitch_mm": pitch,
        "chambers": list(way),
        "mesh": level,
        "end_compliance_m_per_n": END_COMPLIANCE,
        "end": end,
        **found,
    }


def main() -> None:
    """Follow what the file lacks."""
    parser = arguments(__doc__, FILE)
    parser.add_argument(
        "--last-kpa", type=float, default=70.0, help="largest pressure (default: %(default)s)"
    )
    options = parser.parse_args()
    complete(options, paths(), lambda path, level: trace(path, level, options.last_kpa))


if __name__ == "__main__":
    main()
