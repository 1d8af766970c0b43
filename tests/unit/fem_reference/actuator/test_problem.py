"""How far a step of the actuator may go before its walls meet."""

from dataclasses import replace

import numpy as np
import pytest

from fem_reference import ActuatorGeometry, DoubleHelix, Ogden, Thread
from fem_reference.actuator import Deformation
from fem_reference.actuator.equations import ActuatorEquations
from fem_reference.actuator.model import ActuatorModel
from fem_reference.actuator.motion import _behind
from fem_reference.actuator.problem import ActuatorProblem
from fem_reference.central_rod import PRESSED
from fem_reference.mesh import mirror_images
from fem_reference.walls.self_contact import TIE_BREAK
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
    straight = problem.motion.candidate_positions(start.positions, end.positions)
    assert walls.step_limit(*straight) == 1.0

    share = problem.start_share(start, end)
    meet = (from_gap - sagitta) / (from_gap - to_gap)
    # Both sides have tie-breaking offsets, and the search for the touch stops short of it; 0.6 of the way to
    # where walls meet is allowed.
    assert share / 0.6 == pytest.approx(meet, abs=3.0 * TIE_BREAK / (from_gap - to_gap))
    trial = start.positions + share * (end.positions - start.positions)
    assert not walls.intersects(trial[:nodes])


def test_a_step_does_not_bring_the_cavitys_wall_into_the_rod(problem):
    """Where it was free it is left pressed on the rod, and where it was deeper inside, as deep as it was.

    Nothing moves from the chambers on.
    """
    rest, cavity = problem.equations.rest(), problem.equations.sliding
    mesh = problem.equations.mesh.points

    def inwards(by: np.ndarray) -> Deformation:
        positions = rest.positions.copy()
        positions[cavity, :2] *= (1.0 - by / np.hypot(*mesh[cavity, :2].T))[:, None]
        return replace(rest, positions=positions)

    rng = np.random.default_rng(0)
    before, after = rng.uniform(0.0, 0.03, len(cavity)), rng.uniform(0.0, 0.3, len(cavity))
    trial = inwards(after)
    held = problem.keep_core_apart(inwards(before), trial).positions
    radius = np.hypot(*mesh[cavity, :2].T)
    expected = radius - np.minimum(after, np.maximum(before, PRESSED))
    np.testing.assert_allclose(np.hypot(*held[cavity, :2].T), expected, atol=1e-12)
    np.testing.assert_allclose(held[cavity, 2], mesh[cavity, 2], atol=1e-12)

    moved = np.linalg.norm(held - trial.positions, axis=1)[: len(mesh)]
    assert moved.max() == pytest.approx((after - np.maximum(before, PRESSED)).max(), abs=1e-12)
    beyond = np.hypot(*mesh[:, :2].T) > INNER - 1e-6
    # gmsh's arcs are accurate to 3e-8 mm.
    np.testing.assert_allclose(moved[beyond], 0.0, atol=1e-8)
    np.testing.assert_array_equal(held[len(mesh) :], rest.positions[len(mesh) :])


def test_walls_that_are_held_apart_or_off_the_rod_keep_the_plane():
    """The pairs of walls that are in the way, and their tie-breaking offsets, have no mirror images."""
    model = ActuatorModel(GEOMETRY, Ogden(), DoubleHelix(), Thread(), TINY, 1070.0, "cap", False, True)
    problem = ActuatorProblem(ActuatorEquations(model))
    image = mirror_images(problem.equations.rest_positions)
    start, end = (nearly_closed(problem, gap) for gap in (0.03, -0.005))
    for at in (start, end):
        # Where the walls cross the plane they are the mirror images of themselves.
        at.positions[:] = problem.equations.symmetrised(at.positions)
    held = problem.contact.keep_walls_apart(start, end)
    assert held is not end
    np.testing.assert_array_equal(held.positions[image], held.positions * [1.0, -1.0, 1.0])
    pressed = replace(start, positions=start.positions.copy())
    pressed.positions[problem.equations.sliding, :2] *= 0.95
    off = problem.keep_core_apart(start, pressed)
    assert np.abs(off.positions - pressed.positions).max() > 0.01
    np.testing.assert_array_equal(off.positions[image], off.positions * [1.0, -1.0, 1.0])


def test_what_is_behind_the_cavitys_wall_moves_with_the_node_in_front_of_it_and_less():
    """Three rings of eight nodes at each of three levels, the second a fifth of a radian off the others."""
    azimuth, height = np.arange(8) * np.pi / 4.0, np.array([0.0, 0.3, 0.6])
    rings = [
        [radius * np.cos(phi + turn), radius * np.sin(phi + turn), z]
        for radius, turn in ((1.0, 0.0), (1.6, 0.2), (INNER, 0.0))
        for z in height
        for phi in azimuth
    ]
    # Above the highest of those that slide nothing moves.
    points = np.array([*rings, [1.6, 0.0, 0.9]])
    nodes, nearest, share = _behind(points, np.arange(24), INNER - 1e-9)
    np.testing.assert_array_equal(nodes, np.arange(48))
    np.testing.assert_array_equal(nearest, np.tile(np.arange(24), 2))
    np.testing.assert_allclose(share, np.repeat([1.0, (INNER - 1.6) / (INNER - 1.0)], 24), rtol=1e-8)


def test_what_does_not_touch_the_rod_is_left_as_it_is(problem):
    rest = problem.equations.rest()
    wider = rest.positions * [1.01, 1.01, 1.0]
    trial = replace(rest, positions=wider)
    np.testing.assert_array_equal(problem.keep_core_apart(rest, trial).positions, wider)
