"""A cell that leans over, under three unequal pressures: ``python -m tests.benchmark.studies.leaning``.

By mesh of the refinement study: θ and γ of 60 mm. The full actuator's runs beside it are the cases
``triple-51-17-20`` and ``psi90-triple-51-17-20`` of `rodmodel-calibrate truth`.
"""

import argparse
import sys

import jax
import numpy as np

from calibration.truth.dataset import case_of
from fem_reference import CellError, Load, PeriodCell, follow, prepare_process
from tests.benchmark.refinement.meshes import MESHES, WINDINGS
from tests.benchmark.refinement.solve import END_COMPLIANCE

CASES = {"psi 0": "triple-51-17-20", "psi 90": "psi90-triple-51-17-20"}


def main() -> int:
    """Solve, and print a line for each mesh."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("winding", nargs="?", choices=list(CASES), default="psi 90")
    parser.add_argument("--meshes", nargs="+", choices=[m.name for m in MESHES], metavar="NAME")
    options = parser.parse_args()
    jax.config.update("jax_enable_x64", True)
    prepare_process()
    case = WINDINGS[options.winding]
    loads = [Load(load.pressure) for load in case_of(CASES[options.winding]).loads]
    for mesh in MESHES:
        if options.meshes and mesh.name not in options.meshes:
            continue
        cell = PeriodCell(winding=case.winding, level=mesh.level(case), end_compliance=END_COMPLIANCE)
        print(f"{options.winding}, {mesh.name}, {cell.unknowns} unknowns")
        try:
            for state in follow(cell, loads, jumps=False):
                angle, plane = np.degrees(state.bending(cell.geometry.body_length))
                pressures = np.round(np.array(state.load.pressure) / 1e3, 1)
                print(f"  {pressures} kPa: {angle:.1f}°, γ {plane:.1f}°", flush=True)
        except CellError as error:
            print(f"  {error}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
