"""Solve every winding on every mesh: ``python -m tests.benchmark.refinement [RUN] [--only NAME …]``.

``--upright`` bends by chamber 1 alone, in its plane of symmetry and to 70 kPa, where the winding has one.
"""

import argparse
import sys
import time
from pathlib import Path

import jax

from fem_reference import prepare_process
from tests.benchmark.refinement.meshes import FINEST, MESHES, WINDINGS
from tests.benchmark.refinement.solve import UPRIGHT, UPRIGHT_PATH, solved, solved_upright

_SHOWN: tuple[float, ...] = (5.0, 20.0, 40.0, 50.0, 55.0)


def main() -> int:
    """Solve what is not solved yet."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("run", nargs="?", type=Path, default=Path("build/refinement"))
    parser.add_argument("--only", nargs="+", choices=list(WINDINGS), metavar="NAME", help="these alone")
    parser.add_argument("--upright", action="store_true", help="chamber 1 in its plane of symmetry")
    parser.add_argument("--meshes", nargs="+", choices=[m.name for m in (*MESHES, FINEST)], metavar="NAME")
    arguments = parser.parse_args()
    jax.config.update("jax_enable_x64", True)
    prepare_process()
    arguments.run.mkdir(parents=True, exist_ok=True)
    for winding in arguments.only or WINDINGS:
        if arguments.upright and not WINDINGS[winding].winding.mirror_in_place:
            continue
        for mesh in (*MESHES, FINEST) if arguments.upright else MESHES:
            if arguments.meshes and mesh.name not in arguments.meshes:
                continue
            clock = time.perf_counter()
            solve, path = (solved_upright, UPRIGHT_PATH) if arguments.upright else (solved, "chamber 1")
            found, shown = solve(arguments.run, winding, mesh), UPRIGHT if arguments.upright else _SHOWN
            last = [f"{found.value(path, p, 'angle_deg'):.3f}" for p in shown]
            took = time.perf_counter() - clock
            row = f"{winding:12s} {mesh.name:14s} {found.unknowns:6d}  {'  '.join(last)}"
            print(f"{row}  {took:.0f} s", flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
