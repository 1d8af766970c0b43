"""Finite-element points of the moment-curvature maps: one chamber under pressure, then a moment on top.

Run as ``python examples/points/moment_points.py [FILE] [--only NAME ...]``; every path that is done is kept,
so a run that was stopped goes on. The points that ship were made on the coarse mesh, in
examples/data/moment_points.json. A moment is positive where it bends the section on, the way that the chamber
bends it.
"""

import math
from pathlib import Path
from typing import Any

import numpy as np
from points_file import END_COMPLIANCE, arguments, complete, wound_cell

from fem_reference import CellError, Load, converged_level, follow, layout

# Windings and chambers; chamber 3 of the double helix mirrors chamber 2.
MAPPED = (("double-helix", 1), ("double-helix", 2), ("ring", 1), ("six-helix", 1))
FILE = Path(__file__).parents[1] / "data" / "moment_points.json"
PRESSURES_KPA = (0.0, 20.0, 40.0)
MOMENTS_NMM = [0.6 * n for n in range(6)]
STEP_KPA = 5.0
# name, layout, chamber, pressure [kPa], sign of the moment
Path_ = tuple[str, str, int, float, float]


def paths() -> list[Path_]:
    """All paths."""
    return [
        (f"{name}-chamber{chamber}-{kpa:g}-{way}", name, chamber, kpa, sign)
        for name, chamber in MAPPED
        for kpa in PRESSURES_KPA
        for way, sign in (("on", 1.0), ("back", -1.0))
    ]


def trace(path: Path_, level: str | None) -> dict[str, Any]:
    """Raise the pressure, then the moment, as far as the cell follows without a jump."""
    _, winding, chamber, kpa, sign = path
    wound = layout(winding)
    level = level or converged_level(wound)
    cell = wound_cell(wound, level)
    azimuth, alone = 2.0 * math.pi / 3.0 * (chamber - 1), np.eye(3)[chamber - 1]
    axis = np.array([math.sin(azimuth), -math.cos(azimuth), 0.0])

    def load(pressure: float, nmm: float) -> Load:
        p, q, r = 1e3 * pressure * alone
        a, b, c = 1e-3 * sign * nmm * axis
        return Load((p, q, r), (a, b, c))

    ramp = [load(p, 0.0) for p in np.arange(STEP_KPA, kpa, STEP_KPA)]
    found: dict[str, list[float]] = {"moment_nmm": [], "curvature_per_m": []}
    end = "reached"
    try:
        states = list(follow(cell, ramp + [load(kpa, m) for m in MOMENTS_NMM]))[len(ramp) :]
    except CellError as error:
        end, states = str(error).split(";")[0], []
    for state in states:
        if state.jumped:
            end = "walls snapped"
            break
        found["moment_nmm"].append(round(1e3 * float(state.moment @ axis), 6))
        found["curvature_per_m"].append(float(state.curvature @ axis))
    return {
        "layout": winding,
        "chamber": chamber,
        "pressure_kpa": kpa,
        "mesh": level,
        "end_compliance_m_per_n": END_COMPLIANCE,
        "end": end,
        **found,
    }


def main() -> None:
    """Follow what the file lacks."""
    complete(arguments(__doc__, FILE).parse_args(), paths(), trace)


if __name__ == "__main__":
    main()
