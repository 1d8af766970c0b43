"""Torsional stiffness of the laws that ship, against the limit of fine meshes.

Run as ``python -m tests.benchmark.refinement.law_torsion``. The ratio by which a law is carried to the limit
is the mean over these same states: what is left is how much the ratio changes over them, and what the law
errs by. No other state's limit is known.
"""

import sys

import numpy as np

from calibration.truth import layout_of, on_its_mesh
from rodmodel import Calibration, CoreRod, shipped_calibrations
from rodmodel.io import find_among
from tests.benchmark.refinement.limits import limit
from tests.benchmark.refinement.meshes import WINDINGS
from tests.benchmark.refinement.report import gathered
from tests.benchmark.refinement.solve import ONE, TWO, Solved
from tests.unit.rodmodel.sections import section_at

_PATHS = (("chamber 1", ONE, (1, 0, 0)), ("chambers 1+2", TWO, (1, 1, 0)))


def pairs(study: dict[str, dict[str, Solved]]) -> list[tuple[str, Calibration]]:
    """Windings whose limit the study tells, each with the calibrations that are of it or of all its ψ."""
    found = []
    for name, meshes in study.items():
        if all(limit(meshes, "chamber 1", kpa, "torsion") is None for kpa in ONE):
            continue
        own = layout_of(WINDINGS[name].winding)
        for calibration in shipped_calibrations():
            layout = calibration.layout
            alike = layout.name == own.name and np.isclose(layout.pitch, own.pitch)
            if alike and (layout.psi is None or np.isclose(layout.psi, own.psi or 0.0)):
                found.append((name, calibration))
    return found


def errors(study: dict[str, dict[str, Solved]], name: str, calibration: Calibration) -> np.ndarray:
    """Relative errors of ∂²Π/∂u₃² at the free states under one chamber and two, inside the domain."""
    own = layout_of(WINDINGS[name].winding)
    rod = CoreRod.of(find_among([calibration], own.name, own.psi or 0.0, own.pitch))
    found = []
    for path, pressures, chambers in _PATHS:
        for kpa in pressures:
            known, pressure = limit(study[name], path, kpa, "torsion"), 1e3 * kpa * np.array(chambers)
            if known is not None and calibration.domain.covers_pressure(pressure):
                free = rod.solve_many(pressure=pressure)["free_curvature"][0]
                found.append(known.error(section_at(rod.handle, free, pressure).stiffness[2, 2]))
    return np.array(found)


def main() -> int:
    """Print the least and the largest error of each law, as it was fitted and as it ships."""
    study = gathered(None)
    print("| winding | law | as fitted [%] | carried [%] |\n| --- | --- | --- | --- |")
    for name, calibration in pairs(study):
        of = "of any ψ" if calibration.layout.psi is None else "of its own"
        both = (100.0 * errors(study, name, one) for one in (on_its_mesh(calibration), calibration))
        cells = (f"{of_law.min():+.1f} to {of_law.max():+.1f}" for of_law in both)
        print(f"| {name} | {of} | {' | '.join(cells)} |")
    return 0


if __name__ == "__main__":
    sys.exit(main())
