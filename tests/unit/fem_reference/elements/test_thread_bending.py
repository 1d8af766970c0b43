"""Bending of the thread: the energy of an elastica in closed form, exact derivatives, off by default."""

import jax
import numpy as np
import pytest

from fem_reference import DoubleHelix, Load, NoWinding, PeriodCell, Ring, Thread
from fem_reference.elements import ThreadBending, ThreadSegments
from fem_reference.geometry import Winding
from fem_reference.geometry.winding import COUPLINGS
from tests.fem_fixtures import (
    TINY,
    assemble,
    asymmetry,
    deformed,
    difference,
    relative_error,
    times,
    tiny_equations,
)

RADIUS, PITCH = 5.6, 3.0
EI = 1.5  # N mm²


def bending(
    winding: Winding, coupling: str = "circumference", around: int = TINY.around, is_periodic: bool = False
) -> ThreadBending:
    mesh = tiny_equations(1).mesh
    thread = Thread(coupling=coupling)
    segments = ThreadSegments(mesh, winding, thread, RADIUS * 1e-3, PITCH * 1e-3, around)
    return ThreadBending(segments, mesh.points, EI, is_periodic)


@pytest.fixture(scope="module")
def rest() -> np.ndarray:
    return tiny_equations(1).mesh.points


@pytest.fixture(scope="module", params=COUPLINGS)
def joints(request) -> ThreadBending:
    return bending(DoubleHelix(), request.param)


@pytest.fixture(scope="module")
def x(rest) -> np.ndarray:
    return deformed(rest / 6.0) * 6.0


@pytest.fixture(scope="module")
def direction(rest) -> np.ndarray:
    return np.random.default_rng(2).uniform(-1.0, 1.0, rest.shape)


def test_it_is_worked_out_in_double_precision_whatever_the_process_has(joints, x):
    energy, (forces, tangents) = joints.energy(x), joints.response(x)
    with jax.enable_x64(False):
        assert joints.energy(x) == energy
        again = joints.response(x)
    np.testing.assert_array_equal(again[0], forces)
    np.testing.assert_array_equal(again[1], tangents)


def test_a_ring_made_oval_has_the_energy_of_an_elastica(rest):
    """x ↦ (1 + a) x, y ↦ (1 − a) y turns a ring's tangent by a sin 2θ: 2π EI a²/R, for each of two rings.

    An affine motion is the mesh's own, so that the error is the polyline's, of second order.
    """
    a = 1e-3
    oval = rest * [1.0 + a, 1.0 - a, 1.0]
    exact = 2.0 * 2.0 * np.pi * EI * a**2 / RADIUS
    errors = []
    for around in (18, 36, 72):
        errors.append(bending(Ring(PITCH * 1e-3 / 2.0), "axis", around).energy(oval) / exact - 1.0)
    np.testing.assert_allclose(np.log2(np.divide(errors[:-1], errors[1:])), 2.0, atol=0.05)


def test_as_wound_and_in_rigid_motion_nothing_resists(joints, rest):
    c, s = np.cos(0.7), np.sin(0.7)
    turned = rest @ np.array([[c, -s, 0.0], [0.6 * s, 0.6 * c, -0.8], [0.8 * s, 0.8 * c, 0.6]]).T + 2.0
    for positions in (rest, turned, 1.1 * rest):
        # Round-off of an angle, 1e-16, and of places, over a segment's length.
        assert joints.energy(positions) <= 1e-20
        assert np.abs(joints.force(positions)).max() <= 1e-11


def test_force_is_the_slope_of_the_energy(joints, x, direction):
    force = assemble(joints.connectivity, joints.force(x), len(x))
    slope = difference(lambda t: joints.energy(x + t * direction), 1e-4)
    assert np.sum(force * direction) == pytest.approx(float(slope), rel=1e-6)
    np.testing.assert_array_equal(joints.response(x)[0], joints.force(x))


def test_tangent_is_the_symmetric_slope_of_the_force(joints, x, direction):
    stiffness = joints.response(x)[1]
    slope = difference(lambda t: assemble(joints.connectivity, joints.force(x + t * direction), len(x)), 1e-4)
    assert relative_error(times(joints.connectivity, stiffness, direction), slope) <= 1e-6
    assert asymmetry(stiffness) <= 1e-10


def test_joints_of_open_and_closed_threads():
    """Two helices of so many segments have one joint less each; a ring has as many as segments."""
    assert len(bending(DoubleHelix())) == 2 * (TINY.around - 1)
    assert len(bending(Ring(PITCH * 1e-3 / 2.0))) == 2 * TINY.around
    assert len(bending(NoWinding())) == 0


def test_threads_that_go_on_are_stiffer_by_the_joint_at_their_end(x):
    alone, on = (bending(DoubleHelix(), is_periodic=is_periodic).energy(x) for is_periodic in (False, True))
    assert on == pytest.approx(alone * TINY.around / (TINY.around - 1), rel=1e-12)


def test_it_is_off_unless_asked_for_and_stiffens_the_section():
    assert "thread bending" not in PeriodCell(level=TINY).equations.groups
    plain, stiff = (PeriodCell(level=TINY, thread=Thread(bends=bends)) for bends in (False, True))
    soft, hard = (cell.solve(Load((0.0, 0.0, 0.0))).hessian[:3, :3] for cell in (plain, stiff))
    assert np.linalg.eigvalsh(hard - soft).min() > 0.0
