"""Runs whose answers are kept: made anew by ``python -m tests.ground_truth.gold``."""

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from fem_reference import (
    Actuator,
    ActuatorGeometry,
    ActuatorLoad,
    DoubleHelix,
    Load,
    MeshLevel,
    PeriodCell,
    Ring,
    SixHelix,
    Winding,
    follow,
)

FILE = Path(__file__).with_name("gold.json")
# Every wall one element thick: seconds a run.
TINY = MeshLevel(2, 4, 2, 2, 1, 1, 1, 0.75)
SHORT = ActuatorGeometry(body_length=9e-3, cap_length=3e-3)
CELLS: dict[str, tuple[Winding, list[Load]]] = {
    "double helix, chamber 1": (DoubleHelix(), [Load((p, 0.0, 0.0)) for p in (5e3, 10e3, 15e3)]),
    "double helix, pair and moment": (
        DoubleHelix(),
        [Load((6e3, 6e3, 0.0)), Load((10e3, 10e3, 0.0), moment=(2e-4, -1e-4, 1e-4))],
    ),
    "double helix at 30°, chamber 2": (DoubleHelix(psi=0.5235987755982988), [Load((0.0, 10e3, 0.0))]),
    "ring, chamber 3": (Ring(), [Load((0.0, 0.0, 15e3))]),
    "six helices, all chambers": (SixHelix(), [Load((15e3, 15e3, 15e3))]),
}
ACTUATORS: dict[str, list[ActuatorLoad]] = {
    "chamber 1": [ActuatorLoad((p, 0.0, 0.0)) for p in (6e3, 12e3)],
    "tip force and gravity": [ActuatorLoad((6e3, 0.0, 0.0), (0.02, 0.03, 0.0), gravity=(0.0, 0.0, -9.81))],
    "follower moment": [ActuatorLoad(tip_moment=(2e-3, 0.0, 0.0), follower=True)],
}


def runs() -> Iterator[tuple[str, dict[str, Any]]]:
    """Name of every run, and what is kept of it."""
    for name, (winding, loads) in CELLS.items():
        states = list(follow(PeriodCell(winding=winding, level=TINY), loads))
        yield (
            f"cell: {name}",
            {
                "curvature_per_m": [s.curvature.tolist() for s in states],
                "volume_m2": [s.volume.tolist() for s in states],
            },
        )
    actuator = Actuator(SHORT, level=TINY)
    for name, actuator_loads in ACTUATORS.items():
        found = list(actuator.follow(actuator_loads))
        yield (
            f"actuator: {name}",
            {
                "tip_position_m": [s.tip_position.tolist() for s in found],
                "volume_m3": [s.chamber_volume.tolist() for s in found],
            },
        )


if __name__ == "__main__":
    FILE.write_text(json.dumps(dict(runs()), indent=1) + "\n")
