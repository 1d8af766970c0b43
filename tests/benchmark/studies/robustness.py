"""Does the solver converge for designs nobody has tried? Random valid actuators on random paths of pressure.

Run as ``python -m tests.benchmark.studies.robustness [cell|thin|coarse] [--elements coarse] [--designs 50]
[--first 0] [--seed 0] [--out DIR]``; ``--json`` for one object. What is followed is the cell, on that mesh
level, or the full actuator on a thin mesh of 3 600 hexahedra or on the coarse one; ``--first`` goes on with
later designs. Walls differ by up to 25 % from
the paper's, pitches lie between 1.5 and 6 mm, ψ between 0 and 180°, the layout is any. A path goes
through three random triples of pressures up to 40 kPa, so that chambers are also let go. A design that cannot
be built is refused before it is meshed, and drawn anew. A path that fails says where, and its last good state
is kept in DIR.
"""

import math
import time
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from fem_reference import (
    LAYOUTS,
    LEVELS,
    Actuator,
    ActuatorError,
    ActuatorGeometry,
    ActuatorLoad,
    CellError,
    CellState,
    Load,
    MeshLevel,
    PeriodCell,
    Winding,
    follow,
)
from fem_reference.geometry import Thread, layout
from fem_reference.mesh import mesh_level
from tests.benchmark.studies.random_study import arguments, report

PRESSURE_MAX = 40e3
WAYPOINTS = 3
WALL_VARIATION = 0.25
PITCHES = (1.5e-3, 6e-3)
THIN = MeshLevel(4, 8, 2, 4, 1, 1, 1, 1.0)
#: What may be followed: the cell, or the actuator on one of these meshes.
MESHES: dict[str, MeshLevel | None] = {"cell": None, "thin": THIN, "coarse": mesh_level("coarse")}


@dataclass(frozen=True)
class Design:
    """An actuator and a path of pressures."""

    geometry: ActuatorGeometry
    winding: Winding
    loads: tuple[Load, ...]

    def described(self) -> dict[str, Any]:
        """For people: walls [mm], the winding, and the pressures [kPa]."""
        walls = [
            1e3 * getattr(self.geometry, name) for name in ("outer_wall", "inner_wall", "partition_wall")
        ]
        return {
            "walls_mm": np.round(walls, 3).tolist(),
            "winding": repr(self.winding),
            "pressures_kpa": [np.round(np.array(load.pressure) / 1e3, 1).tolist() for load in self.loads],
        }


def designs(seed: int) -> Iterator[Design]:
    """Endless designs that can be built."""
    rng = np.random.default_rng(seed)
    paper = ActuatorGeometry()
    while True:
        walls = {
            name: getattr(paper, name) * rng.uniform(1.0 - WALL_VARIATION, 1.0 + WALL_VARIATION)
            for name in ("outer_wall", "inner_wall", "partition_wall")
        }
        name, psi, pitch = rng.choice(sorted(LAYOUTS)), rng.uniform(0.0, math.pi), rng.uniform(*PITCHES)
        pressures = rng.uniform(0.0, PRESSURE_MAX, (WAYPOINTS, 3))
        try:
            geometry, winding = replace(paper, **walls), layout(str(name), float(psi), float(pitch))
            winding.refuse_overlap(Thread())
        except ValueError:
            continue
        yield Design(geometry, winding, tuple(Load(tuple(p.tolist())) for p in pressures))


def outcome(
    design: Design, level: MeshLevel | None, keep: Path | None, elements: str = "coarse"
) -> dict[str, Any]:
    """What became of a path: in the cell with those ``elements``, or in the actuator on a ``level``."""
    start = time.perf_counter()
    record: dict[str, Any] = design.described()
    try:
        iterations, jumps = _in_cell(design, elements) if level is None else _in_actuator(design, level)
        record |= {"converged": True, "iterations": iterations, "snapped": jumps}
    except (CellError, ActuatorError) as error:
        record |= {"converged": False, "error": str(error)}
        if keep is not None and error.last_good is not None:
            good = error.last_good
            at = good.configuration if isinstance(good, CellState) else good.deformation
            np.savez(keep, positions=at.positions, pressure=good.load.pressure)
            record["last_good_state"] = str(keep)
    return record | {"seconds": round(time.perf_counter() - start, 1)}


def _in_cell(design: Design, elements: str) -> tuple[int, int]:
    """Newton's iterations, those of steps in vain left out, and how often walls snapped."""
    states = list(follow(PeriodCell(design.geometry, design.winding, elements), design.loads))
    return sum(state.iterations for state in states), sum(state.jumped for state in states)


def _in_actuator(design: Design, level: MeshLevel) -> tuple[int, int]:
    """The same."""
    actuator = Actuator(design.geometry, design.winding, level)
    settled = [
        state.settled for state in actuator.follow([ActuatorLoad(load.pressure) for load in design.loads])
    ]
    return sum(state.iterations for state in settled), sum(state.jumped for state in settled)


def told(record: dict[str, Any]) -> str:
    """What became of a path, in a line."""
    end = f": {record.get('error')}"
    if record["converged"]:
        end = f", {record['iterations']} iterations, walls snapped on {record['snapped']} legs"
    return (
        f"{record['winding']} walls {record['walls_mm']} mm, {record['pressures_kpa']} kPa: "
        f"{'converged' if record['converged'] else 'FAILED'}, {record['seconds']} s{end}"
    )


def main() -> None:
    """Draw designs, follow their paths, and report."""
    parser = arguments(__doc__, 50)
    parser.add_argument("what", nargs="?", choices=MESHES, default="cell", help="(default: %(default)s)")
    parser.add_argument("--elements", choices=LEVELS, default="coarse", help="of the cell (default: coarse)")
    parser.add_argument("--out", type=Path, default=None, help="directory for last good states")
    options = parser.parse_args()
    if options.out is not None:
        options.out.mkdir(parents=True, exist_ok=True)

    def of_path(number: int, design: Design) -> dict[str, Any]:
        keep = None if options.out is None else options.out / f"design_{number:03d}.npz"
        return outcome(design, MESHES[options.what], keep, options.elements)

    report(options, designs(options.seed), of_path, told, "converged", "converge")


if __name__ == "__main__":
    main()
