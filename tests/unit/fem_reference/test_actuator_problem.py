"""How far a step of the actuator may go before its walls meet."""

import numpy as np
import pytest

from fem_reference import ActuatorGeometry, DoubleHelix, Ogden, Thread
from fem_reference.actuator_equations import ActuatorEquations
from fem_reference.actuator_model import ActuatorModel, Deformation
from fem_reference.actuator_problem import ActuatorProblem
from fem_reference.wall_contact import TIE_BREAK
from tests.fem_fixtures import TINY

GEOMETRY = ActuatorGeometry(body_length=9e-3, cap_length=3e-3)
RADIUS = 10.0
#: Inner and outer arc of a chamber, at x on its mid-plane [mm].
INNER, OUTER = 2.5, 5.0


@pytest.fixture(scope="module")
def problem() -> ActuatorProblem:
    model = ActuatorModel(GEOMETRY, Ogden(), DoubleHelix(), Thread(), TINY, 1070.0, "cap", False, False)
    return ActuatorProblem(ActuatorEquations(model))


def bent(positions: np.ndarray) -> np.ndarray:
    """Sections follow an arc of RADIUS rigidly, towards negative x."""
    x, y, z = positions.T
    angle, out = z / RADIUS, RADIUS + x
    return np.column_stack([out * np.cos(angle) - RADIUS, y, out * np.sin(angle)])


def nearly_closed(problem: ActuatorProblem, gap: float) -> Deformation:
    """Bent, the inner arc of chamber 1 at a distance from the outer one, half an element farther along."""
    equations, rest = problem.equations, problem.equations.rest()
    mesh = equations.mesh.points
    nodes = np.unique(equations.chambers[0].quads)
    x, y, z = mesh[nodes].T
    inner = nodes[(np.hypot(x, y) < INNER + 1e-6) & (z > 2.0) & (z < 7.0)]
    section = mesh.copy()
    section[inner] += [OUTER - INNER - gap, 0.0, 0.5 * TINY.axial_size]
    basis = equations.basis
    curve = bent(np.outer(basis.greville, [0.0, 0.0, 1.0]))
    controls = np.linalg.solve(basis.values(basis.greville), curve)
    positions = np.concatenate([bent(section), controls])
    return Deformation(positions, rest.element_pressure, rest.segment_tension, rest.axis_tension)


def test_walls_of_a_bent_body_meet_where_their_chords_do(problem):
    """Nodes of the inner arc meet edges of the outer one, which are off its curve by h²/(8 r) in the middle.

    Seen from the rod, where edges are straight again, they would not meet at all.
    """
    from_gap, to_gap = 0.03, 0.005
    start, end = (nearly_closed(problem, gap) for gap in (from_gap, to_gap))
    radius = RADIUS + OUTER
    edge = TINY.axial_size * radius / RADIUS
    sagitta = radius - np.sqrt(radius**2 - (0.5 * edge) ** 2)
    assert to_gap < 0.5 * sagitta
    nodes, walls = problem.equations.nodes, problem.equations.walls
    assert not walls.intersects(start.positions[:nodes])
    assert walls.intersects(end.positions[:nodes])
    seen = [problem._frame.straightened(at.positions) for at in (start, end)]
    assert walls.step_limit(*seen) == 1.0

    share = problem.start_share(start, end)
    meet = (from_gap - sagitta) / (from_gap - to_gap)
    # Both sides have tie-breaking offsets, and the search for the touch stops short of it; 0.6 of the way to
    # where walls meet is allowed.
    assert share / 0.6 == pytest.approx(meet, abs=3.0 * TIE_BREAK / (from_gap - to_gap))
    trial = start.positions + share * (end.positions - start.positions)
    assert not walls.intersects(trial[:nodes])
