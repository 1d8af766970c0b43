"""States of one winding on one mesh, kept in a file so that an interrupted study goes on."""

import json
import math
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from fem_reference import CellError, CellState, Load, PeriodCell, follow
from tests.benchmark.refinement.meshes import WINDINGS, Mesh

#: Sliding ends, as in the calibrations that ship [m/N].
END_COMPLIANCE = 0.23e-3
#: Pressures of one chamber, and of two [kPa].
ONE = (5.0, 20.0, 40.0, 50.0, 55.0)
TWO = (5.0, 20.0, 40.0, 50.0)
PATHS = {"chamber 1": [(p, 0.0, 0.0) for p in ONE], "chambers 1+2": [(p, p, 0.0) for p in TWO]}
#: Chamber 1 in its plane of symmetry, where the winding has one: the cell is held upright, as the full
#: actuator holds its sections beyond the pressure at which they would lean.
UPRIGHT_PATH = "chamber 1 upright"
UPRIGHT = (20.0, 40.0, 50.0, 55.0, 60.0, 65.0, 70.0)
# Largest step between states that are solved for [kPa]. The finest meshes give up on longer ones, near a
# pressure at which walls lean and, at ψ = 12°, at 12 kPa too.
_STEP = 3.0


@dataclass(frozen=True)
class Solved:
    """What a mesh says of a winding: ``states`` by path, and the cell's size."""

    winding: str
    mesh: str
    elements: int
    unknowns: int
    states: dict[str, list[dict[str, Any]]]

    def joined(self, other: "Solved") -> "Solved":
        """These states with other paths of the same winding and mesh; the larger number of unknowns."""
        most = max(self.unknowns, other.unknowns)
        return replace(self, unknowns=most, states={**self.states, **other.states})

    def value(self, path: str, pressure_kpa: float, key: str) -> float:
        """A number of the state at that pressure; NaN if the path did not come so far.

        ``plane_bending`` is the stiffness in the plane of bending: the stiffer one at the path's begin, and
        from there on that which is nearer to the last. Beyond the loss of the lateral one that is larger.
        """
        in_plane = math.inf
        for state in self.states.get(path, ()):
            both = [state[name] for name in ("soft_bending", "stiff_bending") if name in state]
            if both:
                in_plane = min(both, key=lambda k: abs(k - in_plane)) if in_plane < math.inf else max(both)
            if max(state["pressure_kpa"]) == pressure_kpa:
                found = in_plane if key == "plane_bending" and both else state.get(key, math.nan)
                return float(found)
        return math.nan


def solved(run: Path, winding: str, mesh: Mesh) -> Solved:
    """Read the states from the run's file, or solve for them and write it."""
    return _on_file(run / f"{winding} {mesh.name}.json", lambda: _solve(winding, mesh, PATHS))


def solved_upright(run: Path, winding: str, mesh: Mesh) -> Solved:
    """As `solved`, of chamber 1 in its plane of symmetry alone."""
    path = {UPRIGHT_PATH: [(p, 0.0, 0.0) for p in UPRIGHT]}
    return _on_file(run / f"{winding} {mesh.name} upright.json", lambda: _solve(winding, mesh, path, True))


def _on_file(file: Path, solve: Callable[[], Solved]) -> Solved:
    file = file.with_name(file.name.replace(" ", "_"))
    if not file.exists():
        whole = file.with_suffix(".new")
        whole.write_text(json.dumps(vars(solve()), indent=1) + "\n")
        whole.replace(file)
    return Solved(**json.loads(file.read_text()))


def _solve(
    winding: str,
    mesh: Mesh,
    paths: Mapping[str, Sequence[tuple[float, float, float]]],
    symmetric: bool = False,
) -> Solved:
    case = WINDINGS[winding]
    cell = PeriodCell(
        winding=case.winding, level=mesh.level(case), end_compliance=END_COMPLIANCE, symmetric=symmetric
    )
    states: dict[str, list[dict[str, Any]]] = {}
    for path, pressures in paths.items():
        loads, wanted = _in_steps(pressures)
        states[path], clock = [], time.perf_counter()
        try:
            for number, state in enumerate(follow(cell, loads, jumps=False)):
                if number in wanted:
                    states[path].append(_record(cell, state) | {"seconds": time.perf_counter() - clock})
                    clock = time.perf_counter()
        except CellError as error:
            reached = [] if error.reached is None else [p / 1e3 for p in error.reached.pressure]
            states[path].append({"pressure_kpa": reached or [0.0], "error": str(error)})
    return Solved(winding, mesh.name, cell.elements, cell.unknowns, states)


def _in_steps(pressures: Sequence[tuple[float, float, float]]) -> tuple[list[Load], set[int]]:
    """Return loads from rest that pass through pressures [kPa] in short steps, and the places of these."""
    loads, wanted, last = [], set(), np.zeros(3)
    for end in np.array(pressures):
        number = math.ceil(np.abs(end - last).max() / _STEP)
        for share in np.arange(1, number + 1) / number:
            first, second, third = (1e3 * (last + share * (end - last))).tolist()
            loads.append(Load((first, second, third)))
        wanted.add(len(loads) - 1)
        last = end
    return loads, wanted


def _record(cell: PeriodCell, state: CellState) -> dict[str, Any]:
    """Angle of the body's length [deg], stiffnesses [N m²] and volumes per length [mm²] of a state."""
    angle, plane = np.degrees(state.bending(cell.geometry.body_length))
    bending = np.linalg.eigvalsh(state.hessian[:2, :2])
    return {
        "pressure_kpa": [p / 1e3 for p in state.load.pressure],
        "angle_deg": float(angle),
        "plane_deg": float(plane),
        "soft_bending": float(bending[0]),
        "stiff_bending": float(bending[1]),
        "torsion": float(state.hessian[2, 2]),
        **{f"volume_{k}": 1e6 * float(v) for k, v in enumerate(state.volume, start=1)},
        "stretch": state.stretch,
        "negative_directions": state.negative_directions,
        "stable": state.stable,
        "iterations": state.iterations,
    }
