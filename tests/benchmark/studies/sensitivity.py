"""What the bending angle depends on: the same pressures under other assumptions, cell and actuator.

Run as ``python -m tests.benchmark.studies.sensitivity [cell] [actuator]``; it prints the table of
docs/notes/actuator.md and docs/notes/paper.md, row by row, at ``--pressures-kpa``. Chamber 1 alone. Cell and
actuator are of the coarse mesh but in the rows of meshes; the actuator keeps the plane of symmetry. An
asterisk: walls have snapped since the pressure before. Times are from rest on, with what a row is the first
to compile.
"""

import argparse
import dataclasses
import math
import time
from collections.abc import Callable, Iterator, Sequence
from functools import partial
from typing import Any

import numpy as np

from calibration.sweep import usual_end_compliance
from fem_reference import (
    Actuator,
    ActuatorError,
    ActuatorLoad,
    CellError,
    Design,
    Load,
    Ogden,
    PeriodCell,
    Thread,
    follow,
    prepare_process,
)
from fem_reference.walls import WallContact

END_COMPLIANCE = usual_end_compliance(Design())
SLACK = Thread(slack_share=1e-4)
PRESSURES_KPA = (20.0, 40.0, 60.0, 70.0)
Found = tuple[float, bool]  # angle [deg], and whether walls have snapped on the way to it
Angles = Callable[[Sequence[float]], Iterator[Found]]  # at pressures [kPa]


def assumptions() -> Iterator[tuple[str, dict]]:
    """Name, and the arguments that differ from the default's, of cell and actuator."""
    thread, material = Thread(), Ogden()
    bulk_modulus = 100e6  # the default's [Pa]
    yield "default", {}
    for factor in (0.1, 10.0):
        stiff = dataclasses.replace(thread, young_modulus=factor * thread.young_modulus)
        yield f"thread's E times {factor:g}", {"thread": stiff}
    for factor in (0.1, 10.0):
        bulky = dataclasses.replace(material, bulk_modulus=factor * bulk_modulus)
        yield f"bulk modulus times {factor:g}", {"material": bulky}
    yield "thread coupled on its axis", {"thread": Thread(coupling="axis")}
    yield "thread that goes slack in compression", {"thread": SLACK}
    yield "thread that resists bending as a solid wire", {"thread": Thread(bends=True)}


def of_cell() -> Iterator[tuple[str, Angles]]:
    """Rows of the cell's table."""
    for name, changes in assumptions():
        yield name, partial(cell_angles, **changes)
    yield "silicone that slides as the ends let it", partial(cell_angles, end_compliance=END_COMPLIANCE)
    yield "walls that pass through each other", partial(cell_angles, touching=False)
    for level in ("medium", "paper"):
        yield f"{level} mesh", partial(cell_angles, level=level)


def of_actuator() -> Iterator[tuple[str, Angles]]:
    """Rows of the actuator's table: first the interface with the rod, which only it has."""
    yield "default", actuator_angles
    yield "cavity bonded to the rod at the tip only", partial(actuator_angles, bonded="tip")
    yield "cavity bonded to the rod all along", partial(actuator_angles, bonded="all")
    yield "thread over the cap too", partial(actuator_angles, cap_wound=True)
    for name, changes in assumptions():
        if changes:
            yield name, partial(actuator_angles, **changes)
    for level in ("medium", "paper"):  # whose bars fold
        yield f"{level} mesh, thread that goes slack", partial(actuator_angles, level=level, thread=SLACK)


TABLES = {"cell": of_cell, "actuator": of_actuator}


class PassingWalls(WallContact):
    """Contact between chamber walls that never acts."""

    def force(self, positions: np.ndarray) -> None:
        """As where no walls are near."""

    def iterate(self, positions: np.ndarray, before: object) -> None:
        """As where no walls are near."""

    def concave_part(self, positions: np.ndarray) -> None:
        """As where no walls are near."""

    def energy(self, positions: np.ndarray) -> float:
        """Of no barrier."""
        return 0.0

    def step_limit(self, start: np.ndarray, end: np.ndarray, seen: object = None) -> float:
        """Nothing stops a step."""
        return 1.0


def cell_angles(pressures_kpa: Sequence[float], touching: bool = True, **changes: Any) -> Iterator[Found]:
    """Angle over the body at each pressure."""
    cell = PeriodCell(level="coarse", **changes)
    if not touching:
        walls = np.concatenate([chamber.quads for chamber in cell.equations.chambers])
        cell.equations.walls = PassingWalls(cell.equations.mesh.points, walls)
    for state in follow(cell, [Load((1e3 * p, 0.0, 0.0)) for p in pressures_kpa]):
        yield math.degrees(state.bending(cell.geometry.body_length)[0]), state.jumped


def actuator_angles(pressures_kpa: Sequence[float], **changes: Any) -> Iterator[Found]:
    """Angle of the tip at each pressure."""
    actuator = Actuator(symmetric=True, **changes)
    for state in actuator.follow([ActuatorLoad((1e3 * p, 0.0, 0.0)) for p in pressures_kpa]):
        yield math.degrees(state.bending_angle), state.settled.jumped


def row(name: str, angles: Angles, pressures_kpa: Sequence[float], reference: list[Found]) -> list[Found]:
    """Print angles, or their changes against the reference's, with the time that they took."""
    start = time.perf_counter()
    found: list[Found] = []
    failure = ""
    try:
        found.extend(angles(pressures_kpa))
    except (ActuatorError, CellError) as error:
        failure = f" ({error})"
    cells = []
    for (angle, jumped), (base, _) in zip(found, reference or found, strict=False):
        told = f"{angle:.2f}°"
        if reference:
            told = f"{angle - base:+.2f}° ({100.0 * (angle / base - 1.0):+.2f} %)"
        cells.append(told + ("*" if jumped else ""))
    cells += ["not reached"] * (len(pressures_kpa) - len(cells))
    print(
        "| " + " | ".join([name + failure, *cells, f"{time.perf_counter() - start:.0f} s"]) + " |", flush=True
    )
    return found


def main() -> None:
    """Print the tables."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("tables", nargs="*", metavar="TABLE", help=f"of {', '.join(TABLES)} (default: all)")
    parser.add_argument("--pressures-kpa", nargs="+", type=float, default=PRESSURES_KPA, metavar="P")
    options = parser.parse_args()
    prepare_process()
    pressures = options.pressures_kpa
    for table in options.tables or TABLES:
        print(f"| {table} | " + " | ".join(f"{p:g} kPa" for p in pressures) + " | time |")
        print("|---" * (len(pressures) + 2) + "|", flush=True)
        reference: list[Found] = []
        for name, angles in TABLES[table]():
            found = row(name, angles, pressures, reference)
            reference = reference or found


if __name__ == "__main__":
    main()
