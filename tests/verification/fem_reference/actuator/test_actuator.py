"""The full actuator against the cell, closed forms and itself: statics, symmetry, work, buckling, runs."""

import json
import math

import numpy as np
import pytest

from fem_reference import Actuator, ActuatorGeometry, ActuatorLoad, Load, PeriodCell
from fem_reference.actuator.pose import bending
from fem_reference.geometry import Thread
from fem_reference.io import ActuatorRun, RunError
from tests.fem_fixtures import TINY

SHORT = ActuatorGeometry(body_length=9e-3, cap_length=3e-3)


@pytest.fixture(scope="module")
def short() -> Actuator:
    return Actuator(SHORT, level=TINY)


@pytest.fixture(scope="module")
def whole() -> Actuator:
    """The paper's actuator on the fewest elements."""
    return Actuator(level=TINY)


@pytest.fixture(scope="module")
def cell() -> PeriodCell:
    return PeriodCell(level=TINY)


@pytest.fixture(scope="module")
def cell_stiffness(cell) -> np.ndarray:
    """The cell's, at rest."""
    return cell.solve(Load((0.0, 0.0, 0.0))).hessian


@pytest.fixture(scope="module")
def bent(whole) -> dict:
    return {s.load.pressure[0]: s for s in whole.follow([ActuatorLoad((p, 0.0, 0.0)) for p in (10e3, 20e3)])}


def test_reactions_balance_the_loads(short):
    force, moment, gravity = (0.03, -0.01, 0.02), (2e-4, 0.0, 1e-4), (0.0, 3.0, -9.81)
    state = short.solve(ActuatorLoad((6e3, 2e3, 1e3), force, moment, gravity))
    equations = short.equations
    weight = equations.mass[:, None] * np.multiply(gravity, 1e3)
    # The largest nodal force left, on some thousand nodes.
    slack = 1e3 * state.settled.residual
    np.testing.assert_allclose(state.settled.base_force, -np.asarray(force) - weight.sum(axis=0), atol=slack)
    x = state.deformation.positions
    arm = np.cross(x, weight).sum(axis=0) / 1e3
    expected = -np.asarray(moment) - np.cross(state.tip_position, force) - arm
    np.testing.assert_allclose(state.settled.base_moment, expected, atol=66e-3 * slack)


def test_chambers_two_and_three_are_mirror_images(short):
    """But for the quadrilaterals that fill the cap, the mesh is mirror symmetric.

    The cap of the tiny mesh is six uneven elements a chamber, and bends by some 0.1° of its own.
    """
    second, third = (short.solve(ActuatorLoad(p)) for p in ((0.0, 9e3, 0.0), (0.0, 0.0, 9e3)))
    assert second.bending_angle == pytest.approx(third.bending_angle, rel=1e-3)
    assert second.bending_plane + third.bending_plane == pytest.approx(2.0 * math.pi, abs=3e-3)


def test_at_equilibrium_segments_are_slack_where_they_are_shortened(short):
    """The branch of a segment's law, its own while Newton's method iterates, is that of its strain."""
    load = ActuatorLoad(tip_moment=(2e-3, 0.0, 0.0))
    yarn = Actuator(SHORT, level=TINY, thread=Thread(slack_share=1e-4))
    state = yarn.solve(load)
    thread = yarn.equations.thread
    tension = thread.tension(state.deformation.positions)
    assert 0.1 < (tension < 0.0).mean() < 0.9
    # A residual of 1e-9 N, or a last step of 1e-6 mm: of a slack segment's 0.04 N/mm next to nothing.
    np.testing.assert_allclose(state.deformation.segment_tension, tension, rtol=0, atol=2e-6)
    assert state.thread_tension == tension.max()
    # Bars push where the yarn does not.
    assert state.bending_angle > 1.01 * short.solve(load).bending_angle


def test_the_work_of_the_pressure_is_the_change_of_energy(short):
    """∫ p dV = p V − ∫ V dp, by Gauss–Legendre quadrature of V(p); both sides to 1e-6."""
    top = 12e3
    nodes, weights = np.polynomial.legendre.leggauss(12)
    pressures = [*(0.5 * top * (1.0 + nodes)), top]
    rest, *states = short.follow([ActuatorLoad((p, 0.0, 0.0)) for p in (0.0, *pressures)])
    volumes = np.array([s.chamber_volume[0] for s in states])
    work = top * volumes[-1] - 0.5 * top * float(weights @ volumes[:-1])
    assert states[-1].strain_energy - rest.strain_energy == pytest.approx(work, rel=1e-6)


def test_a_dead_force_far_from_the_base_bends_the_actuator_like_a_cantilever(whole, cell_stiffness):
    """Tip of a body of the cell's EI with a rigid cap: F (l³ − c³)/3EI, l = 66 mm, c = 6 mm.

    The body's ends are stiffer than the cell, within a diameter; a diameter of 60 mm at each end bounds it.
    """
    force = 1e-3
    stiffness = cell_stiffness[1, 1]
    length, cap = 66e-3, 6e-3
    expected = force * (length**3 - cap**3) / 3.0 / stiffness
    found = whole.solve(ActuatorLoad(tip_force=(force, 0.0, 0.0))).tip_position[0]
    assert 0.9 * expected < found < 1.02 * expected


def test_an_unpressurised_actuator_buckles_at_eulers_load(whole, cell_stiffness):
    """Clamped body of the cell's EI with a rigid cap under a dead axial force: kL tan(kL) = L/c."""
    stiffness = cell_stiffness
    body, cap = 60e-3, 6e-3
    low, high = 0.0, 0.5 * math.pi
    for _ in range(60):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if middle * math.tan(middle) < body / cap else (low, middle)
    critical = min(stiffness[0, 0], stiffness[1, 1]) * (low / body) ** 2
    below, above = 0.95 * critical, 1.10 * critical
    stable = [
        s.settled.stable
        for s in whole.follow([ActuatorLoad(tip_force=(0.0, 0.0, -f)) for f in (below, above)])
    ]
    # Stiffer ends raise the load by less than a tenth; the straight rod stays an equilibrium beyond it.
    assert stable == [True, False]


def test_the_middle_of_the_actuator_is_the_cell(bent, cell):
    """Curvature, with three diameters to either end."""
    for pressure, state in bent.items():
        uniform = cell.solve(Load((pressure, 0.0, 0.0)))
        middle = np.abs(state.shape.arc_length - 30e-3) < 4.5e-3
        found = state.shape.curvature[middle, 1].mean()
        assert found == pytest.approx(uniform.curvature[1], rel=0.01)


def test_pressures_enlarge_their_chambers_and_turn_the_tip_away(bent):
    state = bent[20e3]
    # The tiny mesh's cap is not mirror symmetric: some 0.5°; on the coarse mesh 0.00°.
    assert math.cos(state.bending_plane) > math.cos(math.radians(1.0))
    assert state.tip_position[0] < 0.0
    assert state.chamber_volume[0] > 1.3 * state.chamber_volume[1]
    # 1, 2 and 3 are 120° apart: the tip's tangent leans towards −x.
    assert state.tip_rotation[0, 2] < 0.0


@pytest.mark.parametrize("angle", [30.0, 170.0, 190.0, 300.0, 400.0])
@pytest.mark.parametrize("plane", [0.0, 60.0, 180.0, 300.0])
def test_the_bending_angle_of_an_arc_is_continued_past_half_turns(angle, plane):
    s = np.deg2rad(angle) * np.linspace(0.0, 1.0, 60)
    towards = -np.array([math.cos(math.radians(plane)), math.sin(math.radians(plane))])
    tangents = np.column_stack([np.sin(s)[:, None] * towards, np.cos(s)])
    chord = np.concatenate([(1.0 - np.cos(s[-1])) * towards, [np.sin(s[-1])]])
    found = np.rad2deg(bending(tangents, chord))
    # Past a whole turn the chord alone tells the plane.
    assert found[0] == pytest.approx(angle, abs=1e-9)
    assert math.cos(math.radians(found[1] - plane)) == pytest.approx(1.0, abs=1e-12)


def test_a_run_that_was_cut_short_ends_as_if_it_had_not_been(short, tmp_path):
    loads = [ActuatorLoad((p, 0.0, 0.0)) for p in (3e3, 6e3, 9e3)]
    whole = ActuatorRun(tmp_path / "whole", {"case": 1})
    list(whole.states(short, loads))
    cut = ActuatorRun(tmp_path / "cut", {"case": 1})
    states = cut.states(short, loads)
    next(states)
    states.close()
    # What a kill in the middle of writing leaves behind.
    part = tmp_path / "cut" / ".1-0a.part"
    part.write_bytes(b"half")
    again = ActuatorRun(tmp_path / "cut", {"case": 1})
    assert not part.exists()
    assert len(again.records()) == 1
    assert len(list(again.states(Actuator(SHORT, level=TINY), loads))) == 2
    for a, b in zip(whole.records(), again.records(), strict=True):
        assert a["iterations"] == b["iterations"]
        np.testing.assert_allclose(b["tip_position_mm"], a["tip_position_mm"], atol=1e-8)
        assert b["bending_angle_deg"] == pytest.approx(a["bending_angle_deg"], abs=1e-8)
    assert json.loads((tmp_path / "cut" / "run.json").read_text()) == {"case": 1}


def test_a_directory_of_another_run_is_refused(tmp_path):
    ActuatorRun(tmp_path / "run", {"loads": [1], "model": 2})
    with pytest.raises(RunError, match="another loads"):
        ActuatorRun(tmp_path / "run", {"loads": [2], "model": 2})
