"""The hard cases: small bodies on paths that are hard for the solvers, each for a reason of its own."""

import math
from collections.abc import Iterable
from itertools import islice
from typing import Any

from fem_reference import (
    Actuator,
    ActuatorGeometry,
    ActuatorLoad,
    DoubleHelix,
    Load,
    MeshLevel,
    PeriodCell,
    Ring,
    SixHelix,
    Thread,
)
from fem_reference.algebra import SymmetricSolver
from fem_reference.solver import SolverOptions
from tests.benchmark.hard_cases.outcome import Case
from tests.benchmark.studies.robustness import designs
from tests.fem_fixtures import TINY

#: More elements around a chamber: its walls are not crushed above 57 kPa, as those of `TINY` are.
FINER = MeshLevel(3, 8, 2, 2, 1, 1, 1, 0.75)
SHORT = ActuatorGeometry(body_length=9e-3, cap_length=3e-3)
MIDDLE = ActuatorGeometry(body_length=20e-3, cap_length=3e-3)
LONG = ActuatorGeometry(body_length=30e-3, cap_length=3e-3)
_SLACK = Thread(slack_share=1e-4)


def _kpa(*pressures: tuple[float, float, float]) -> Iterable[tuple[float, float, float]]:
    return (tuple(1e3 * p for p in triple) for triple in pressures)  # type: ignore[misc]


def _cell(why: str, loads: Iterable[Load], jumps: bool = True, **body: Any) -> Case:
    def build(solver: SymmetricSolver, options: SolverOptions) -> PeriodCell:
        whole: dict[str, Any] = {"level": TINY} | body
        return PeriodCell(**whole, solver=solver, options=options)

    return Case(why, build, tuple(loads), jumps)


def _free(why: str, *pressures: tuple[float, float, float], jumps: bool = True, **body: Any) -> Case:
    """A cell in free bending, under pressures [kPa]."""
    return _cell(why, [Load(p) for p in _kpa(*pressures)], jumps, **body)


def _random(why: str, number: int) -> Case:
    """A cell of one of the random designs of the robustness study, on its random path."""
    (design,) = islice(designs(0), number, number + 1)
    return _cell(why, design.loads, geometry=design.geometry, winding=design.winding)


def _actuator(why: str, loads: Iterable[ActuatorLoad], **body: Any) -> Case:
    def build(solver: SymmetricSolver, options: SolverOptions) -> Actuator:
        whole: dict[str, Any] = {"geometry": SHORT, "level": TINY} | body
        return Actuator(**whole, solver=solver, options=options)

    return Case(why, build, tuple(loads), single=False)


def _pressed(why: str, *pressures: tuple[float, float, float], **body: Any) -> Case:
    """An actuator under pressures alone [kPa]."""
    return _actuator(why, [ActuatorLoad(p) for p in _kpa(*pressures)], **body)


CASES: dict[str, Case] = {
    "walls-press": _free("the walls of two chambers press on each other", (30, 30, 0), (50, 50, 0)),
    "rings": _free("one chamber within rings, to 60 kPa", (60, 0, 0), winding=Ring(), level=FINER),
    "six-helices": _free("two chambers in a period of two layers", (40, 40, 0), winding=SixHelix()),
    "sliding": _free("the silicone slides on the rod", (30, 30, 0), (50, 0, 0), end_compliance=0.23e-3),
    "slack-thread": _cell(
        "a moment of either sign presses the thread together, which goes slack",
        [Load((5e3, 0.0, 0.0), moment=(0.0, m, 0.0)) for m in (2e-3, -4e-3)],
        thread=_SLACK,
    ),
    "reversed-curvature": _cell(
        "the imposed curvature turns over with the pressures",
        [
            Load((30e3, 0.0, 0.0), curvature=(0.0, 20.0, 0.0)),
            Load((0.0, 30e3, 0.0), curvature=(5.0, -20.0, 1.0)),
        ],
    ),
    "chamber-1-70-kpa": _free("70 kPa at once in the plane of symmetry", (70, 0, 0), level=FINER),
    "psi-45-saddle": _free(
        "the path goes on along a saddle", (0, 66, 0), winding=DoubleHelix(psi=math.pi / 4), level=FINER
    ),
    "psi-90-saddle": _free(
        "the same by another crossing", (66, 0, 0), winding=DoubleHelix(psi=math.pi / 2), level=FINER
    ),
    "unloading": _free("up beyond buckling and down again", (0, 55, 0), (0, 66, 0), (0, 55, 0), level=FINER),
    "ends-at-instability": _free(
        "walls lose their balance, where the path is to end", (0, 50, 0), (0, 70, 0), jumps=False
    ),
    "random-0": _random("a chamber is let go at a long pitch, and walls snap", 0),
    "random-2": _random("walls snap within six helices, on loading and on unloading", 2),
    "random-8": _random("chambers within rings are let go one after another", 8),
    "random-18": _random("a body without a winding swells until the solver gives up", 18),
    "short-up-and-down": _pressed("chamber 2 of an actuator, loaded and unloaded", (0, 70, 0), (0, 30, 0)),
    "short-slack-thread": _pressed(
        "an actuator whose thread goes slack", (10, 0, 0), (60, 0, 0), thread=_SLACK
    ),
    "follower-force": _actuator(
        "a dead force, then one that follows the tip",
        [
            ActuatorLoad((20e3, 0.0, 0.0), tip_force=(0.0, 0.1, -0.2)),
            ActuatorLoad((40e3, 0.0, 0.0), tip_force=(0.05, 0.0, -0.5), follower=True),
        ],
    ),
    "middle-two-chambers": _pressed(
        "two unequal chambers sway about the rod: viscosity and the rod's curvature",
        (45, 50, 0),
        geometry=MIDDLE,
    ),
    "long-chamber-2": _pressed("a longer body in wall contact, out of its plane", (0, 70, 0), geometry=LONG),
}
