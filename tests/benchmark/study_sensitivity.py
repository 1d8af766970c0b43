"""What the bending angle depends on: the same pressures under other assumptions, cell and actuator.

Run as ``python -m tests.benchmark.study_sensitivity``; it prints the tables of docs/actuator.md, row by row.
Chamber 1 alone. The cell is that of the coarse mesh; the actuator has a thinner one, of 3 600 hexahedra, on
which the changes are taken, not the angles.
"""

import dataclasses
import math
import time
from collections.abc import Iterator

from fem_reference import (
    Actuator,
    ActuatorError,
    ActuatorLoad,
    CellError,
    Load,
    MeshLevel,
    Ogden,
    PeriodCell,
    Thread,
    follow,
)

THIN = MeshLevel(4, 8, 2, 4, 1, 1, 1, 1.0)
CELL_KPA, ACTUATOR_KPA = (20.0, 40.0, 60.0), (20.0, 40.0)


def variants() -> Iterator[tuple[str, dict, dict]]:
    """Name, and the arguments that differ: of the cell and the actuator, and of the actuator alone."""
    thread, material = Thread(), Ogden()
    yield "default", {}, {}
    for factor in (0.1, 10.0):
        stiff = dataclasses.replace(thread, young_modulus=factor * thread.young_modulus)
        yield f"thread's E times {factor:g}", {"thread": stiff}, {}
    for factor in (0.1, 10.0):
        bulky = dataclasses.replace(material, bulk_modulus=factor * material.bulk_modulus)
        yield f"bulk modulus times {factor:g}", {"material": bulky}, {}
    yield "thread coupled on its axis", {"thread": Thread(coupling="axis")}, {}
    yield "cavity bonded to the rod at the outer face only", {}, {"bonded": "tip"}
    yield "cavity bonded to the rod all along", {}, {"bonded": "all"}


def cell_angles(**changes: object) -> Iterator[float]:
    """Angle over 60 mm [deg] at each pressure."""
    cell = PeriodCell(**changes)
    for state in follow(cell, [Load((1e3 * p, 0.0, 0.0)) for p in CELL_KPA]):
        yield math.degrees(60e-3 * math.hypot(*state.curvature[:2]))


def actuator_angles(**changes: object) -> Iterator[float]:
    """Angle of the tip [deg] at each pressure."""
    actuator = Actuator(level=THIN, **changes)
    for state in actuator.follow([ActuatorLoad((1e3 * p, 0.0, 0.0)) for p in ACTUATOR_KPA]):
        yield math.degrees(state.bending_angle)


def row(name: str, angles: Iterator[float], reference: list[float]) -> list[float]:
    """Print angles and their changes against the default's, with the time that they took."""
    start, found = time.perf_counter(), []
    try:
        found.extend(angles)
    except (ActuatorError, CellError) as error:
        print(f"({name}: {error})")
    cells = [
        f"{angle:.2f}" + (f" ({100.0 * (angle / base - 1.0):+.2f} %)" if reference else "")
        for angle, base in zip(found, reference or found, strict=False)
    ]
    print("| " + " | ".join([name, *cells, f"{time.perf_counter() - start:.0f} s"]) + " |", flush=True)
    return found


def main() -> None:
    """Print both tables."""
    print("cell, at", CELL_KPA, "kPa")
    reference: list[float] = []
    for name, changes, own in variants():
        if not own:
            found = row(name, cell_angles(**changes), reference)
            reference = reference or found
    print("actuator, at", ACTUATOR_KPA, "kPa")
    reference = []
    for name, changes, own in variants():
        found = row(name, actuator_angles(**changes, **own), reference)
        reference = reference or found


if __name__ == "__main__":
    main()
