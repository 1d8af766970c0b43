"""Finite-element points of an actuator whose first outer wall is a tenth thicker than the others.

Run as ``python examples/points/twin_points.py [FILE] [--only NAME ...]``. It takes an hour on the coarse
mesh, keeps every path as soon as it is finished, and passes over those that the file has. The file that ships
is examples/data/twin_points.json: the actuator that examples/12_twin.py measures.

The thicker wall is that of chamber 1, so that the actuator is its own mirror image in the plane of that
chamber: chamber 3 is not followed.
"""

import math
from pathlib import Path
from typing import Any

from points_file import Three, arguments, complete, pascals

from fem_reference import Actuator, ActuatorGeometry, ActuatorLoad

FILE = Path(__file__).parents[1] / "data" / "twin_points.json"
VARIATION = (0.1, 0.0, 0.0)
SINGLE_KPA = (10.0, 20.0, 30.0, 40.0, 50.0)
PAIR_KPA = (10.0, 20.0, 30.0, 40.0)
# name, which chambers, pressures [kPa]
Path_ = tuple[str, Three, tuple[float, ...]]
PATHS: list[Path_] = [
    ("chamber1", (1.0, 0.0, 0.0), SINGLE_KPA),
    ("chamber2", (0.0, 1.0, 0.0), SINGLE_KPA),
    ("pair23", (0.0, 1.0, 1.0), PAIR_KPA),
]


def trace(path: Path_, level: str) -> dict[str, Any]:
    """Follow one path of the full actuator."""
    _, way, pressures = path
    actuator = Actuator(ActuatorGeometry(outer_wall_variation=VARIATION), level=level)
    loads = [ActuatorLoad(pascals(p, way)) for p in pressures]
    states = list(actuator.follow(loads))
    return {
        "outer_wall_variation": list(VARIATION),
        "mesh": level,
        "pressure_kpa": [[p * w for w in way] for p in pressures],
        "angle_deg": [math.degrees(state.bending_angle) for state in states],
        "plane_deg": [math.degrees(state.bending_plane) % 360.0 for state in states],
        "tip_mm": [[1e3 * float(x) for x in state.tip_position] for state in states],
        "jumped": [state.settled.jumped for state in states],
    }


def main() -> None:
    """Follow what the file lacks."""
    complete(arguments(__doc__, FILE, "coarse").parse_args(), PATHS, trace)


if __name__ == "__main__":
    main()
