"""Assembly of the silicone's stiffness: ours, felupe's and scikit-fem's `BilinearForm`; and a Newton step.

Run as ``python -m tests.benchmark.bench_assembly``; ``--json`` for one object. The meshes are bodies of the
coarse level, 3, 12 and 48 mm long. All three evaluate stress and tangent of the same Ogden solid with mean
dilatation at the same positions and put the stiffness into a sparse matrix: felupe with its own
`SolidBodyNearlyIncompressible` and Ogden solid; scikit-fem with our tangent at the Gauss points, so that only
its loops over pairs of basis functions are its own, and without the dilatation's rank-one term, which a
bilinear form does not express. Each runs in a process of its own, for its peak memory, which keeps the memory
of its arrays, as our programs do. The Newton step, linearisation and factorisation, is that of actuators of
15, 30 and 60 mm. Medians of warm calls, more of them where they are short. All take turns, in several rounds,
as a machine's speed changes from one minute to the next; ratios and growth are medians of those of the
rounds. Threads as ``OMP_NUM_THREADS`` says.
"""

import argparse
import json
import resource
import statistics
import subprocess
import sys
import time
from collections.abc import Callable
from typing import Any

import numpy as np
import skfem

from fem_reference import LEVELS, Actuator, ActuatorGeometry, ActuatorLoad, Ogden, prepare_process
from fem_reference.algebra import SparsePattern
from fem_reference.elements import SolidElements
from fem_reference.mesh import BodyMesh, body_mesh
from tests.fem_fixtures import isochoric_tangent

LENGTHS_MM = (3.0, 12.0, 48.0)
BODIES_MM = (15.0, 30.0, 60.0)
REPEATS = {"ours": 21, "felupe": 5, "scikit-fem": 3}
ROUNDS, STEP_ROUNDS = 3, 7


def median_seconds(function: Callable[[], object], repeats: int) -> float:
    """Median time of a call; the first one, which fills caches, is left out."""
    function()
    times = []
    for _ in range(repeats):
        start = time.perf_counter()
        function()
        times.append(time.perf_counter() - start)
    return statistics.median(times)


def positions(mesh: BodyMesh) -> np.ndarray:
    """A smooth bend, so that no stretches are equal."""
    x, y, z = mesh.points.T
    return np.column_stack([1.05 * x + 0.002 * z**2 / 48.0, 0.97 * y + 0.001 * x * y, z + 0.01 * x])


def ours(mesh: BodyMesh) -> Callable[[], object]:
    """Element forces and stiffness, added to the cached pattern."""
    solid, x = SolidElements(mesh, Ogden()), positions(mesh)
    dofs = (3 * solid.connectivity[:, :, None] + np.arange(3)).reshape(len(solid), 24)
    none = np.empty(0, np.int64)
    pattern = SparsePattern(x.size, {"solid": dofs}, (none, none))

    def assemble() -> object:
        _, stiffness, *_ = solid.response(x)
        data = np.zeros(len(pattern))
        pattern.add_group(data, "solid", stiffness)
        return pattern.matrix(data)

    return assemble


def felupes(mesh: BodyMesh) -> Callable[[], object]:
    """Force and stiffness of felupe's nearly incompressible solid body."""
    import felupe

    material, x = Ogden(), positions(mesh)
    # felupe counts a hexahedron's corners around its bottom and then its top face.
    cells = mesh.elements[:, [0, 1, 3, 2, 4, 5, 7, 6]]
    region = felupe.RegionHexahedron(felupe.Mesh(mesh.points, cells, "hexahedron"))
    field = felupe.FieldContainer([felupe.Field(region, dim=3)])
    models = felupe.constitution.tensortrax.models.hyperelastic
    ogden = felupe.constitution.tensortrax.Hyperelastic(
        felupe.constitution.isochoric_volumetric_split(models.ogden),
        mu=[m / 1e6 for m in material.shear_moduli],
        alpha=list(material.exponents),
    )
    bulk = SolidElements(mesh, material).bulk_modulus
    solid = felupe.SolidBodyNearlyIncompressible(ogden, field, bulk=bulk)
    field[0].values[:] = x - mesh.points

    def assemble() -> object:
        solid.assemble.vector(field)
        return solid.assemble.matrix(field)

    return assemble


def bilinear(mesh: BodyMesh) -> Callable[[], object]:
    """Stiffness by scikit-fem's own form, from the tangent at the Gauss points."""
    element = skfem.ElementVector(skfem.ElementHex1())
    basis = skfem.Basis(mesh.linear(), element, intorder=3)
    solid, x = SolidElements(mesh, Ogden()), positions(mesh)

    @skfem.BilinearForm
    def form(u: skfem.DiscreteField, v: skfem.DiscreteField, w: Any) -> np.ndarray:
        return np.einsum("iJkLeq,iJeq,kLeq->eq", w["A"], v.grad, u.grad)

    def assemble() -> object:
        _, tangent = isochoric_tangent(Ogden(), 1e6, solid.deformation_gradient(x))
        elements, points = tangent.shape[:2]
        field = np.moveaxis(tangent.reshape(elements, points, 3, 3, 3, 3), (0, 1), (4, 5))
        return form.assemble(basis, A=skfem.DiscreteField(np.ascontiguousarray(field)))

    return assemble


CODES = {"ours": ours, "felupe": felupes, "scikit-fem": bilinear}


def one(code: str, length: float) -> dict[str, float]:
    """Time of one assembly and peak memory of this process [MiB]."""
    prepare_process()
    mesh = body_mesh(ActuatorGeometry(), 1e-3 * length, LEVELS["coarse"])
    seconds = median_seconds(CODES[code](mesh), REPEATS[code])
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0
    return {"hexahedra": len(mesh.elements), "seconds": seconds, "peak_mib": peak}


def assemblies(length: float) -> dict[str, dict[str, float]]:
    """Of each code: median time over the rounds, largest memory, and median of its times over ours."""
    rounds: list[dict[str, dict[str, float]]] = []
    for _ in range(ROUNDS):
        found = {}
        for code in CODES:
            command = [sys.executable, "-m", "tests.benchmark.bench_assembly", "--one", code, str(length)]
            done = subprocess.run(command, check=True, capture_output=True, text=True)
            found[code] = json.loads(done.stdout)
        rounds.append(found)
    return {
        code: {
            "hexahedra": rounds[0][code]["hexahedra"],
            "seconds": statistics.median(r[code]["seconds"] for r in rounds),
            "peak_mib": max(r[code]["peak_mib"] for r in rounds),
            "times_ours": statistics.median(r[code]["seconds"] / r["ours"]["seconds"] for r in rounds),
        }
        for code in CODES
    }


def newton_step(body: float) -> tuple[int, Callable[[], object]]:
    """Unknowns of an actuator with a body of some length [mm], and its linearisation and factorisation."""
    actuator = Actuator(ActuatorGeometry(body_length=1e-3 * body))
    equations, target = actuator.equations, ActuatorLoad((5e3, 0.0, 0.0)).target()
    at = equations.rest()

    def step() -> None:
        linear = equations.linearise(at, target)
        pattern = equations.pattern
        actuator._solver.factorise(pattern.matrix(linear.data), pattern.revision)

    return actuator.unknowns, step


def newton_steps() -> tuple[list[dict[str, float]], float]:
    """Median times of all bodies, and the median of the power of the unknowns with which they grow."""
    prepare_process()
    unknowns, steps = zip(*map(newton_step, BODIES_MM), strict=True)
    # Each is called once before it is timed, so that caches are filled.
    seconds = np.array([[median_seconds(step, 1) for step in steps] for _ in range(STEP_ROUNDS)])
    powers = np.polyfit(np.log(unknowns), np.log(seconds.T), 1)[0]
    middle = np.median(seconds, axis=0).tolist()
    rows = [{"unknowns": n, "seconds": t} for n, t in zip(unknowns, middle, strict=True)]
    return rows, float(np.median(powers))


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--json", action="store_true")
    parser.add_argument("--one", nargs=2, metavar=("CODE", "LENGTH"), help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.one is not None:
        print(json.dumps(one(options.one[0], float(options.one[1]))))
        return
    table = [assemblies(length) for length in LENGTHS_MM]
    steps, growth = newton_steps()
    if options.json:
        print(json.dumps({"assembly": table, "newton_steps": steps, "growth": growth}))
        return
    for row in table:
        for code, found in row.items():
            print(
                f"{found['hexahedra']:6.0f} hexahedra  {code:10s} {found['seconds']:8.3f} s  "
                f"{found['times_ours']:6.1f} x ours  peak {found['peak_mib']:6.0f} MiB"
            )
    for step in steps:
        print(f"{step['unknowns']:7.0f} unknowns: a Newton step takes {step['seconds']:.2f} s")
    print(f"a Newton step grows as n^{growth:.2f}")


if __name__ == "__main__":
    main()
