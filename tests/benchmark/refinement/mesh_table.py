"""Table of how far each mesh's angle, volumes and torsion are from the limit, for the rods.

Run as ``python -m tests.benchmark.refinement.mesh_table [RUN] [--out FILE]`` on what
``python -m tests.benchmark.refinement RUN`` has solved; without RUN, on the record that ships. It replaces
the table that ships in ``calibration/truth``.
"""

import argparse
import shlex
import sys
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from calibration.provenance import code_version, today
from calibration.truth import ONE_CHAMBER, SHIPPED_LIMITS, TWO_CHAMBERS, MeshRatio, layout_of, save_limits
from fem_reference import LEVELS, Ring
from tests.benchmark.refinement.limits import limit
from tests.benchmark.refinement.meshes import WINDINGS
from tests.benchmark.refinement.report import gathered
from tests.benchmark.refinement.solve import ONE, TWO, UPRIGHT, UPRIGHT_PATH, Solved

#: Mesh of the study for each level that runs of the full actuator are on.
OF_LEVELS = {"coarse": "linear x1", "layered": "linear x2", "fine": "fine", "finer": "finer"}
_PATHS = {"chamber 1": (ONE_CHAMBER, ONE), "chambers 1+2": (TWO_CHAMBERS, TWO)}
# Pressure beyond which chamber 1 is taken from the cell that is held upright, where there is one [kPa]: the
# cell leans, on finer meshes earlier, where the full actuator does not.
_LEANS = 50.0


def ratios(found: dict[str, dict[str, Solved]]) -> list[MeshRatio]:
    """Return the ratios of all windings and meshes whose limit the study tells."""
    rows = []
    for name, meshes in found.items():
        winding = WINDINGS[name].winding
        for level, mesh in OF_LEVELS.items():
            # With an odd number of layers from ring to ring a ring lies within a layer, unlike in the study.
            odd = round(1e3 * winding.period / LEVELS[level].axial_size) % 2 == 1
            if mesh not in meshes or (isinstance(winding, Ring) and LEVELS[level].order == 1 and odd):
                continue
            for name_of_path, (title, pressures) in _PATHS.items():
                known = []
                for path, pressure in _states(name_of_path, pressures, meshes[mesh]):
                    interval = limit(meshes, path, pressure, "angle_deg")
                    value = meshes[mesh].value(path, pressure, "angle_deg")
                    volumes = _volume_change(meshes, mesh, path, pressure)
                    if interval is not None and volumes is not None and np.isfinite(value):
                        known.append((1e3 * pressure, interval.least / value, interval.most / value, volumes))
                if known:
                    at, least, most, change = (tuple(column) for column in zip(*known, strict=True))
                    torsion = _torsion(meshes, mesh, name_of_path, pressures)
                    rows.append(MeshRatio(layout_of(winding), level, title, at, least, most, change, torsion))
    return rows


def _states(path: str, pressures: Sequence[float], solved: Solved) -> list[tuple[str, float]]:
    """Paths and pressures of the states that tell the ratios of a path [kPa]."""
    if path != "chamber 1" or UPRIGHT_PATH not in solved.states:
        return [(path, pressure) for pressure in pressures]
    below = [(path, pressure) for pressure in pressures if pressure <= _LEANS]
    return below + [(UPRIGHT_PATH, pressure) for pressure in UPRIGHT if pressure > _LEANS]


def _torsion(
    meshes: dict[str, Solved], mesh: str, path: str, pressures: Sequence[float]
) -> tuple[tuple[float, float], ...]:
    """Intervals of the torsional stiffness over that on a mesh, of a path's states whose limit is told.

    The cell that is held upright is half a cell, which does not twist.
    """
    intervals = []
    for pressure in pressures:
        interval, value = (
            limit(meshes, path, pressure, "torsion"),
            meshes[mesh].value(path, pressure, "torsion"),
        )
        if interval is not None and np.isfinite(value):
            intervals.append((interval.least / value, interval.most / value))
    return tuple(intervals)


def _volume_change(
    meshes: dict[str, Solved], mesh: str, path: str, pressure: float
) -> tuple[float, ...] | None:
    """Volumes per length in the middle of their intervals less those on a mesh [m²]; None if not told."""
    changes = []
    for key in ("volume_1", "volume_2", "volume_3"):
        interval = limit(meshes, path, pressure, key)
        if interval is None:
            return None
        changes.append(1e-6 * (interval.middle - meshes[mesh].value(path, pressure, key)))
    return tuple(changes)


def main() -> int:
    """Write the table."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("run", nargs="?", type=Path, default=None)
    parser.add_argument("--out", type=Path, default=SHIPPED_LIMITS, metavar="FILE")
    arguments = parser.parse_args()
    rows = ratios(gathered(arguments.run))
    provenance = {
        "command": shlex.join(["python", "-m", "tests.benchmark.refinement.mesh_table", *sys.argv[1:]]),
        "code_version": code_version(),
        "date": today(),
    }
    save_limits(rows, provenance, arguments.out)
    windings = dict.fromkeys(f"{row.layout.name} {row.layout.psi} {row.layout.pitch}" for row in rows)
    print(f"{len(rows)} paths of {len(windings)} windings written to {arguments.out}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
