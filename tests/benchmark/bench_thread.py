"""How the thread's discretisation moves the cell's bending angle: chamber 1 under pressure, angle over 60 mm.

Run as ``python -m tests.benchmark.bench_thread``. Three questions, each a table:

* how many straight segments per host element, and where they end;
* where the threads lie in the mesh: the whole winding is shifted along the rod, which a uniform body does not
  notice;
* how fine the mesh is around the rod, along it, and in all directions, for a thread coupled to the body on
  its axis and for one coupled over its circumference.
"""

import json
import math
import time
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from fem_reference import (
    LEVELS,
    ActuatorGeometry,
    DoubleHelix,
    Load,
    MeshLevel,
    PeriodCell,
    Thread,
    Winding,
    follow,
)
from fem_reference.geometry.winding import COUPLINGS
from tests.benchmark.bench_mesh import refined

COARSE = LEVELS["coarse"]


@dataclass(frozen=True)
class Placed(DoubleHelix):
    """Double helix with its segments where they are wanted.

    Parameters
    ----------
    per_element : segments per host element, evenly spaced.
    cuts : azimuths at which segments end instead [rad].
    shift : of the winding along the rod [m].
    """

    per_element: float = 1.0
    cuts: tuple[float, ...] = ()
    shift: float = 0.0

    def polylines(
        self, radius: float, length: float, points_per_turn: int, start: float = 0.0
    ) -> list[np.ndarray]:
        """See `Winding.polylines`."""
        lines = []
        for hand in (1.0, -1.0):
            z = np.linspace(0.0, length, round(points_per_turn * self.per_element * length / self.pitch) + 1)
            if self.cuts:
                turn = (hand * np.array(self.cuts) / (2.0 * math.pi) + self.shift / self.pitch) % 1.0
                turn = turn[(turn > 1e-9) & (turn < 1.0 - 1e-9)]
                z = np.concatenate([[0.0], np.sort(turn) * self.pitch, [length]])
            skipped = int(np.searchsorted(z, start - 1e-9 * length))
            z = np.concatenate([z[skipped:], z[1 : skipped + 1] + length])
            azimuth = hand * 2.0 * math.pi * (z - self.shift) / self.pitch
            lines.append(np.column_stack([radius * np.cos(azimuth), radius * np.sin(azimuth), z]))
        return lines


def columns(level: MeshLevel) -> tuple[float, ...]:
    """Azimuths of the element faces that the threads meet, from chamber 1's centre on [rad]."""
    geometry = ActuatorGeometry()
    half = geometry.chamber_half_angle(geometry.chamber_outer_radius)
    third = 2.0 * math.pi / 3.0
    chamber = np.linspace(-half, half, level.outer_arc + 1)
    partition = np.linspace(half, third - half, level.partition_across + 1)[1:-1]
    around = np.concatenate([np.concatenate([chamber, partition]) + third * k for k in range(3)])
    return tuple(np.sort(np.round(around % (2.0 * math.pi), 12)).tolist())


def report(
    name: str, winding: Winding, level: MeshLevel, kilopascals: Sequence[float], coupling: str = "axis"
) -> None:
    """Solve, and print the angles."""
    start = time.process_time()
    cell = PeriodCell(winding=winding, level=level, thread=Thread(coupling=coupling))
    loads = [Load((1e3 * p, 0.0, 0.0)) for p in kilopascals]
    angles = {
        f"{p:g} kPa": round(math.degrees(state.bending(cell.geometry.body_length)[0]), 3)
        for p, state in zip(kilopascals, follow(cell, loads), strict=True)
    }
    seconds = round(time.process_time() - start, 1)
    print(
        f"{name:44s} {cell.elements:5d} hexahedra, {len(cell.equations.thread):3d} segments  "
        f"{json.dumps(angles)}  ({seconds} s)",
        flush=True,
    )


def main() -> None:
    """Print the three tables."""
    path = (5.0, 10.0, 15.0, 20.0, 25.0, 30.0, 35.0, 40.0)
    faces = columns(COARSE)
    for share in (0.5, 1.0, 2.0, 4.0):
        report(f"{share:g} segments per element", Placed(per_element=share), COARSE, path)
    report("one segment from face to face", Placed(cuts=faces), COARSE, path)
    report("one segment over two elements", Placed(cuts=faces[::2]), COARSE, path)

    for share in (0.0, 0.25, 0.5, 0.75):
        shift = share * 1e-3 * COARSE.axial_size
        report(f"even segments, shifted by {share:g} elements", Placed(shift=shift), COARSE, (5.0,))
        report(
            f"face to face, shifted by {share:g} elements", Placed(cuts=faces, shift=shift), COARSE, (5.0,)
        )

    levels = {
        "coarse": COARSE,
        "18 elements on a chamber's outer arc, not 12": replace(COARSE, outer_arc=18),
        "24": replace(COARSE, outer_arc=24),
        "36": replace(COARSE, outer_arc=36),
        "0.375 mm long, not 0.5": replace(COARSE, axial_size=0.375),
        "0.25 mm": replace(COARSE, axial_size=0.25),
        "0.125 mm": replace(COARSE, axial_size=0.125),
        "24 and 0.25 mm": replace(COARSE, outer_arc=24, axial_size=0.25),
        "24 and 0.125 mm": replace(COARSE, outer_arc=24, axial_size=0.125),
        "twice as many inside the thread": replace(COARSE, outer_wall_inside=4),
        "twice as many outside the thread": replace(COARSE, outer_wall_outside=2),
        "twice as many in the inner wall": replace(COARSE, inner_wall=4),
        "twice as many along partitions": replace(COARSE, partition_along=8),
        "twice as many across partitions": replace(COARSE, partition_across=8),
        "every count times 1.5": refined(COARSE, 1.5),
        "every count times 2": refined(COARSE, 2.0),
    }
    for coupling in COUPLINGS:
        for name, level in levels.items():
            report(f"{coupling}, even: {name}", DoubleHelix(), level, (5.0, 15.0), coupling)
            if coupling == "axis":
                report(f"face to face: {name}", Placed(cuts=columns(level)), level, (5.0, 15.0))


if __name__ == "__main__":
    main()
