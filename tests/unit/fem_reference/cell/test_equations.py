"""The cell's residual and Hessian are exact derivatives of its energy less the pressures' work."""

import dataclasses

import numpy as np
import pytest
import scipy.sparse as sparse

from fem_reference import ActuatorGeometry, DoubleHelix, Ogden, Thread
from fem_reference.cell.equations import CellEquations
from fem_reference.cell.screw_motion import screw_series
from fem_reference.cell.state import Step
from fem_reference.mesh import MeshLevel
from tests.fem_fixtures import (
    QUADRATIC,
    TINY,
    asymmetry,
    bent_configuration,
    difference,
    polar_second_moment,
    relative_error,
    tiny_equations,
)

CURVATURE = np.array([0.006, -0.02, 0.004])
STRETCH = 1.008
PRESSURE = np.array([0.03, 0.01, 0.02])


def thin_chambers() -> CellEquations:
    """Chambers 0.04 mm thin, so that their walls are in contact from the start."""
    geometry = ActuatorGeometry(inner_wall=3.96e-3)
    level = MeshLevel(4, 4, 2, 1, 1, 1, 1, 1.0)
    return CellEquations(geometry, Ogden(), DoubleHelix(), Thread(), level)


def sliding() -> CellEquations:
    """The fewest elements, beside ends that give."""
    return CellEquations(ActuatorGeometry(), Ogden(), DoubleHelix(), Thread(), TINY, axial_stiffness=250.0)


def wired() -> CellEquations:
    """The fewest elements, with a thread that bends."""
    return CellEquations(ActuatorGeometry(), Ogden(), DoubleHelix(), Thread(bends=True), TINY)


def quadratic() -> CellEquations:
    return CellEquations(ActuatorGeometry(), Ogden(), DoubleHelix(), Thread(), QUADRATIC)


# Steps in positions [mm] and in u [1/mm] and the stretch. The rod's barrier bends over 0.02 mm, and a step of
# u moves nodes by up to 30 mm² times it, one of the stretch by up to 6 mm times it: the differences lose less
# than (1e-3)⁴ and 1e-9 to round-off. Walls change the kind of their contacts at places closer than that, and
# take steps smaller by 100 at 1e-8 of round-off.
CASES = {
    "open": (tiny_equations, 1e-5, 1e-6),
    "sliding": (sliding, 1e-5, 1e-6),
    "wired": (wired, 1e-5, 1e-6),
    "quadratic": (quadratic, 1e-5, 1e-6),
    "walls in contact": (thin_chambers, 1e-7, 1e-8),
}


@dataclasses.dataclass
class Case:
    """Equations at a configuration far from equilibrium, with the steps for differences about it."""

    equations: CellEquations
    position_step: float
    strain_step: float

    def __post_init__(self):
        self.at = bent_configuration(self.equations, CURVATURE, stretch=STRETCH)
        self.linear = self.linearise(self.at)
        self.direction = np.random.default_rng(9).uniform(-1.0, 1.0, self.at.positions.shape)

    def linearise(self, at, pressure=PRESSURE):
        return self.equations.linearise(at, pressure, exact=True)

    def potential(self, at, pressure=PRESSURE):
        return self.equations.energy(at) - pressure @ self.equations.volumes(at)

    def moved(self, t):
        return dataclasses.replace(self.at, positions=self.at.positions + t * self.direction)

    def strained(self, t, i):
        return dataclasses.replace(self.at, strain=self.at.strain + t * np.eye(4)[i])

    def hessian(self):
        upper = self.equations.pattern.matrix(self.linear.data)
        return (upper + sparse.triu(upper, 1).T).tocsr()

    def along(self, q):
        """Component along the direction of a residual or of columns in q, the multipliers left out."""
        return self.direction.ravel() @ q[:-2]


@pytest.fixture(scope="module", params=list(CASES.values()), ids=list(CASES))
def case(request) -> Case:
    make, *steps = request.param
    return Case(make(), *steps)


def test_the_configurations_are_what_the_cases_say(case):
    x = case.equations.all_positions(case.at)
    series = case.equations.series(case.at)
    assert case.equations.core_contact.admissible(x, series)
    # The rod's barrier is at work too.
    assert case.equations.core_contact.gap(x, series).min() < 0.002
    assert case.linear.walls_touch is (case.position_step < 1e-6)
    assert not case.equations.walls.intersects(x)
    assert np.abs(case.equations.thread.tension(x)).max() > 0.1


def test_residual_is_the_slope_of_the_potential_in_the_nodes(case):
    slope = difference(lambda t: case.potential(case.moved(t)), case.position_step)
    assert case.along(case.linear.residual) == pytest.approx(float(slope), rel=1e-6)


def test_strain_residual_is_the_slope_of_the_potential_in_the_strain(case):
    slope = [
        difference(lambda t, i=i: case.potential(case.strained(t, i)), case.strain_step) for i in range(4)
    ]
    assert relative_error(case.linear.strain_residual, slope) <= 1e-6


def test_volumes_are_the_slopes_of_the_potential_in_the_pressures(case):
    # Linear in p, whatever the step.
    slope = [difference(lambda t, e=e: case.potential(case.at, PRESSURE + t * e), 0.1) for e in np.eye(3)]
    assert relative_error(-case.linear.volume, slope) <= 1e-10
    np.testing.assert_array_equal(case.linear.volume, case.equations.volumes(case.at))


def test_hessian_in_the_nodes_is_the_slope_of_the_residual(case):
    slope = difference(lambda t: case.linearise(case.moved(t)).residual[:-2], case.position_step)
    product = case.hessian()[:-2, :-2] @ case.direction.ravel()
    assert relative_error(product, slope) <= 1e-6


def test_mixed_hessian_is_the_slope_in_the_strain_and_in_the_nodes(case):
    node_strain = case.linear.node_strain
    for i in range(4):
        slope = difference(lambda t, i=i: case.linearise(case.strained(t, i)).residual[:-2], case.strain_step)
        assert relative_error(node_strain[:-2, i], slope) <= 1e-6
    slope = difference(lambda t: case.linearise(case.moved(t)).strain_residual, case.position_step)
    assert relative_error(case.along(node_strain), slope) <= 1e-6
    np.testing.assert_array_equal(node_strain[-2:], 0.0)


def test_hessian_in_the_strain_is_the_symmetric_slope_of_its_residual(case):
    def residual(t, i):
        return case.linearise(case.strained(t, i)).strain_residual

    slope = [difference(lambda t, i=i: residual(t, i), case.strain_step) for i in range(4)]
    assert relative_error(case.linear.strain_strain, slope) <= 1e-6
    assert asymmetry(case.linear.strain_strain) <= 1e-10


def test_hessian_in_the_pressures_is_the_slope_of_the_residuals(case):
    for k, e in enumerate(np.eye(3)):

        def moved(t, e=e):
            return case.linearise(case.at, PRESSURE + t * e)

        # Linear in p: round-off of residuals of 10 N over steps of 1 MPa, with gradients of 0.1 mm².
        slope = difference(lambda t: moved(t).residual[:-2], 1.0)
        assert relative_error(case.linear.node_pressure[:-2, k], slope) <= 1e-10
        slope = difference(lambda t: moved(t).strain_residual, 1.0)
        assert relative_error(case.linear.strain_pressure[:, k], slope) <= 1e-10


def test_pressures_mixed_hessian_is_the_slope_of_the_volumes(case):
    slope = difference(lambda t: case.equations.volumes(case.moved(t)), 1e-3)
    np.testing.assert_allclose(case.along(-case.linear.node_pressure), slope, rtol=0, atol=1e-9)
    for i in range(4):
        slope = difference(lambda t, i=i: case.equations.volumes(case.strained(t, i)), 1e-4)
        np.testing.assert_allclose(-case.linear.strain_pressure[i], slope, rtol=0, atol=1e-7)


def test_top_nodes_are_the_rods_motion_of_bottom_nodes(equations):
    at = bent_configuration(equations, CURVATURE)
    x = equations.all_positions(at)
    rest = equations.mesh.points.T
    motion = screw_series(CURVATURE, 6.0).at(3.0)[0]
    for top in np.flatnonzero(rest[2] > 3.0 - 1e-9):
        distance = np.abs(rest[:2] - rest[:2, top, None]).max(axis=0) + np.abs(rest[2])
        bottom = int(np.argmin(distance))
        assert distance[bottom] < 1e-9
        np.testing.assert_allclose(x[top], motion[:3, :3] @ x[bottom] + motion[:3, 3], rtol=0, atol=1e-14)


def test_one_cell_of_a_uniformly_bent_rod_is_like_the_next(equations):
    """The energy and the volumes stay when the whole cell is carried along by a rigid motion of the rod."""
    at = bent_configuration(equations, CURVATURE)
    x = equations.all_positions(at)
    motion = screw_series(CURVATURE, 6.0).at(3.0)[0]
    moved = x @ motion[:3, :3].T + motion[:3, 3]
    assert equations.solid.energy(moved) == pytest.approx(equations.solid.energy(x), rel=1e-10)
    for chamber in equations.chambers:
        assert chamber.volume(moved) == pytest.approx(chamber.volume(x), rel=1e-12)


def test_the_gauges_measure_mean_slip_and_mean_rotation(equations):
    rest = equations.rest()
    slipped = dataclasses.replace(rest, positions=rest.positions + np.array([0.0, 0.0, 1e-3]))
    assert equations.linearise(slipped, np.zeros(3)).residual[-2:] == pytest.approx([1e-3, 0.0], abs=1e-12)
    x, y, _ = rest.positions.T
    turned = dataclasses.replace(rest, positions=rest.positions + 1e-3 * np.column_stack([-y, x, 0.0 * x]))
    slip = equations.linearise(turned, np.zeros(3)).residual[-2:]
    # A rotation counts by its arc at the section's root mean square radius: that of a ring from 1 to 6 mm
    # less the chambers. Chords, and areas shared among nodes, are off by (0.44 rad)²/6 at most.
    geometry = ActuatorGeometry()
    radius = np.sqrt(polar_second_moment(geometry) / geometry.body_area)
    assert slip[0] == pytest.approx(0.0, abs=1e-12)
    assert slip[1] == pytest.approx(radius, rel=0.03)


def test_multipliers_act_through_the_gauges(equations):
    at = bent_configuration(equations, CURVATURE)
    held = dataclasses.replace(at, multipliers=np.array([0.2, -0.3]))
    plain, with_forces = (equations.linearise(c, PRESSURE, exact=True) for c in (at, held))
    upper = equations.pattern.matrix(plain.data)
    gauge = upper[:-2, -2:]
    np.testing.assert_allclose(
        with_forces.residual[:-2] - plain.residual[:-2], gauge @ [0.2, -0.3], rtol=0, atol=1e-12
    )
    # Each is a mean over the section: the slip's shares add up to one.
    assert gauge[:, 0].sum() == pytest.approx(1.0, rel=1e-12)


def test_mixed_unknowns_change_the_matrix_but_not_the_residual(equations):
    at = bent_configuration(equations, CURVATURE)
    x = equations.all_positions(at)
    consistent = dataclasses.replace(
        at,
        element_pressure=equations.solid.bulk_modulus * equations.solid.dilatation(x),
        segment_tension=equations.thread.tension(x),
    )
    # The thread is slack where it was.
    light = dataclasses.replace(at, segment_tension=1e-9 * consistent.segment_tension)
    exact = equations.linearise(at, PRESSURE, exact=True)
    mixed = equations.linearise(consistent, PRESSURE)
    other = equations.linearise(light, PRESSURE)
    np.testing.assert_array_equal(mixed.residual, exact.residual)
    assert relative_error(mixed.data, exact.data) <= 1e-12
    np.testing.assert_array_equal(other.residual, exact.residual)
    assert relative_error(other.data, exact.data) > 1e-6


def test_the_mixed_unknowns_follow_a_step_to_first_order(equations):
    """κ ϑ_j and EA(l/L0 − 1) at the step's end, but for its square."""
    at = bent_configuration(equations, CURVATURE)
    linear = equations.linearise(at, PRESSURE, exact=True)
    rng = np.random.default_rng(4)
    nodes = rng.uniform(-1.0, 1.0, at.positions.shape)
    errors = []
    for size in (1e-3, 5e-4, 2.5e-4):
        step = Step(size * nodes, size * np.array([0.1, -0.2, 0.1, 0.1]), np.ones(2))
        end = equations.advance(at, step, 1.0, linear)
        x = equations.all_positions(end)
        pressure = equations.solid.bulk_modulus * equations.solid.dilatation(x)
        tension = equations.thread.tension(x)
        errors.append(
            [np.abs(end.element_pressure - pressure).max(), np.abs(end.segment_tension - tension).max()]
        )
    orders = np.log2(np.divide(errors[:-1], errors[1:]))
    np.testing.assert_allclose(orders, 2.0, atol=0.1)
    half = equations.advance(at, step, 0.5, linear)
    np.testing.assert_allclose(half.positions, at.positions + 0.5 * step.positions, rtol=0, atol=1e-15)
    np.testing.assert_allclose(half.element_pressure, 0.5 * (at.element_pressure + end.element_pressure))
    np.testing.assert_allclose(half.multipliers, 0.5)
