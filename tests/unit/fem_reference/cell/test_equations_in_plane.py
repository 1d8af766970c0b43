"""The equations of a cell that keeps its plane of symmetry, in its unknowns; energy of core and thread."""

import dataclasses
from dataclasses import replace

import numpy as np
import pytest
import scipy.sparse as sparse

from fem_reference import ActuatorGeometry, Core, DoubleHelix, Ogden, Thread
from fem_reference.cell.equations import ACROSS, CellEquations
from fem_reference.cell.state import Step
from fem_reference.elements import body_groups
from fem_reference.mesh import MeshLevel
from tests.fem_fixtures import (
    TINY,
    asymmetry,
    bent_configuration,
    difference,
    relative_error,
    tiny_equations,
)

# In the plane y = 0, as mirror images have: pressures of chambers 2 and 3 are equal.
CURVATURE = np.array([0.0, -0.02, 0.0])
PRESSURE = np.array([0.03, 0.01, 0.01])
#: Thin chambers, whose walls are in contact from the start.
THIN = ActuatorGeometry(inner_wall=3.96e-3)
CONTACT_LEVEL = MeshLevel(4, 4, 2, 1, 1, 1, 1, 1.0)
# Kinds and steps as in `test_equations`.
CASES = {
    "open": (ActuatorGeometry(), TINY, 1e-5, 1e-6),
    "walls in contact": (THIN, CONTACT_LEVEL, 1e-7, 1e-8),
}


def half_cell(geometry: ActuatorGeometry, level: MeshLevel) -> CellEquations:
    return CellEquations(geometry, Ogden(), DoubleHelix(), Thread(), level, symmetric=True)


@dataclasses.dataclass
class Case:
    """Half a cell at a configuration in the plane, far from equilibrium, and a direction of its unknowns."""

    geometry: ActuatorGeometry
    level: MeshLevel
    position_step: float
    strain_step: float

    def __post_init__(self) -> None:
        self.equations = half_cell(self.geometry, self.level)
        bent = bent_configuration(self.equations, CURVATURE, stretch=1.008)
        self.at = self.equations.symmetrised(bent)
        self.linear = self.equations.linearise(self.at, PRESSURE, exact=True)
        self.direction = np.random.default_rng(9).uniform(-1.0, 1.0, self.equations.size - 2)

    def moved(self, t: float):
        way = self.equations.nodal.displacement(t * self.direction)
        return replace(self.at, positions=self.at.positions + way)

    def strained(self, t: float, i: int):
        return replace(self.at, strain=self.at.strain + t * np.eye(4)[i])

    def potential(self, at) -> float:
        return self.equations.energy(at) - PRESSURE @ self.equations.volumes(at)

    def linearise(self, at):
        return self.equations.linearise(at, PRESSURE, exact=True)


@pytest.fixture(scope="module", params=list(CASES.values()), ids=list(CASES))
def case(request) -> Case:
    return Case(*request.param)


def test_what_moves_with_its_unknowns_stays_its_own_mirror_image(case):
    for at in (case.at, case.moved(1e-3)):
        again = case.equations.symmetrised(at)
        np.testing.assert_allclose(again.positions, at.positions, rtol=0, atol=1e-14)
        np.testing.assert_array_equal(again.strain, at.strain)
    nodes = len(case.at.positions)
    assert 1.4 * nodes < case.equations.size < 1.8 * nodes
    # On the plane nodes move along it; others move in all directions.
    moved = case.moved(1.0).positions - case.at.positions
    on_plane = np.abs(case.equations.rest().positions[:, 1]) < 1e-9
    assert on_plane.any()
    np.testing.assert_array_equal(moved[on_plane, 1], 0.0)
    assert (np.abs(moved[~on_plane]) > 0.0).all()


def test_its_energy_and_volumes_are_those_of_the_whole_cell(case):
    """Half of the hexahedra count twice."""
    whole = CellEquations(case.geometry, Ogden(), DoubleHelix(), Thread(), case.level)
    at = whole.rest()
    at = replace(at, positions=case.at.positions, strain=case.at.strain)
    assert case.equations.energy(case.at) == pytest.approx(whole.energy(at), rel=1e-12)
    np.testing.assert_allclose(case.equations.volumes(case.at), whole.volumes(at), rtol=1e-12)


def test_residuals_are_slopes_of_the_potential(case):
    slope = difference(lambda t: case.potential(case.moved(t)), case.position_step)
    assert case.direction @ case.linear.residual[:-2] == pytest.approx(float(slope), rel=1e-6)
    slopes = [
        difference(lambda t, i=i: case.potential(case.strained(t, i)), case.strain_step) for i in (1, 3)
    ]
    assert relative_error(case.linear.strain_residual[[1, 3]], slopes) <= 1e-6
    np.testing.assert_array_equal(case.linear.strain_residual[ACROSS], 0.0)


def test_the_hessian_is_the_slope_of_the_residuals(case):
    upper = case.equations.pattern.matrix(case.linear.data)
    hessian = (upper + sparse.triu(upper, 1).T).tocsr()
    slope = difference(lambda t: case.linearise(case.moved(t)).residual[:-2], case.position_step)
    assert relative_error(hessian[:-2, :-2] @ case.direction, slope) <= 1e-6
    slope = difference(lambda t: case.linearise(case.moved(t)).strain_residual, case.position_step)
    assert relative_error(case.direction @ case.linear.node_strain[:-2], slope) <= 1e-6
    for i in (1, 3):

        def strained(t: float, i: int = i):
            return case.linearise(case.strained(t, i))

        slope = difference(lambda t: strained(t).residual[:-2], case.strain_step)
        assert relative_error(case.linear.node_strain[:-2, i], slope) <= 1e-6
        slope = difference(lambda t: strained(t).strain_residual, case.strain_step)
        assert relative_error(case.linear.strain_strain[[1, 3], i], slope[[1, 3]]) <= 1e-6
    assert asymmetry(case.linear.strain_strain) <= 1e-10


def test_nothing_couples_to_strains_across_the_plane(case):
    linear = case.linear
    np.testing.assert_array_equal(linear.node_strain[:, ACROSS], 0.0)
    np.testing.assert_array_equal(linear.strain_pressure[ACROSS], 0.0)
    across = linear.strain_strain[ACROSS]
    np.testing.assert_array_equal(across[:, [1, 3]], 0.0)
    # What keeps them at zero couples them to nothing, and is not singular.
    np.testing.assert_array_equal(across[[0, 1], [2, 0]], 0.0)
    assert (across[[0, 1], ACROSS] > 0.0).all()


def test_pressures_work_on_the_unknowns_as_on_the_volumes(case):
    slope = difference(lambda t: case.equations.volumes(case.moved(t)), 1e-3)
    np.testing.assert_allclose(case.direction @ -case.linear.node_pressure[:-2], slope, rtol=0, atol=1e-9)


def test_forces_alone_are_those_of_the_full_linearisation(case):
    other = case.moved(1e-4)
    renewed = case.equations.update_forces(case.linear, other, PRESSURE)
    fresh = case.linearise(other)
    np.testing.assert_allclose(renewed.residual, fresh.residual, rtol=1e-12, atol=1e-12)
    np.testing.assert_allclose(renewed.strain_residual, fresh.strain_residual, rtol=1e-12, atol=1e-12)
    np.testing.assert_array_equal(renewed.data, case.linear.data)


def test_a_state_of_the_whole_cell_is_taken_over(case):
    """Own forces of its hexahedra: those of the half that is kept, or the half's own as they are."""
    halves, rest = case.equations.halves, case.equations.rest()
    both = np.arange(len(halves.standing_for) * rest.element_pressure.shape[1], dtype=float)
    both = both.reshape(len(halves.standing_for), -1)
    leaning = replace(rest, element_pressure=both, strain=np.array([0.1, 0.2, 0.3, 1.1]))
    taken = case.equations.symmetrised(leaning)
    np.testing.assert_array_equal(taken.element_pressure, both[halves.kept])
    assert len(taken.element_pressure) == len(case.equations.solid) < len(both)
    np.testing.assert_array_equal(taken.strain, [0.0, 0.2, 0.0, 1.1])
    np.testing.assert_array_equal(case.equations.symmetrised(taken).element_pressure, taken.element_pressure)
    whole = tiny_equations()
    bent = bent_configuration(whole, (0.01, 0.02, 0.03))
    assert whole.symmetrised(bent) is bent


@pytest.mark.parametrize("symmetric", [False, True])
def test_the_gauges_hold_positions_softly(symmetric):
    """Multipliers yield by the gauge's compliance, in the residual as in the matrix."""
    cell = half_cell(ActuatorGeometry(), TINY) if symmetric else tiny_equations()
    at = bent_configuration(cell, CURVATURE)
    held = replace(at, multipliers=np.array([2e3, -3e3]))
    plain, with_forces = (cell.linearise(one, PRESSURE, exact=True) for one in (at, held))
    upper = cell.pattern.matrix(plain.data)
    slack = upper[-2:, -2:].toarray() @ held.multipliers
    change = with_forces.residual[-2:] - plain.residual[-2:]
    np.testing.assert_allclose(change, slack, rtol=1e-6)
    assert (np.diag(upper[-2:, -2:].toarray()) < 0.0).all()
    gauge = upper[:-2, -2:]
    np.testing.assert_allclose(
        with_forces.residual[:-2] - plain.residual[:-2], gauge @ held.multipliers, rtol=0, atol=1e-9
    )
    # How far the gauge is violated is the slope in the multipliers of what they act by.
    direction = np.random.default_rng(3).uniform(-1.0, 1.0, cell.size - 2)
    moved = replace(at, positions=at.positions + cell.nodal.displacement(direction))
    slip = cell.linearise(moved, PRESSURE, exact=True).residual[-2:] - plain.residual[-2:]
    np.testing.assert_allclose(slip, gauge.T @ direction, rtol=1e-9, atol=1e-12)


def test_the_unloaded_cell_has_no_forces_of_its_own():
    for cell in (tiny_equations(), half_cell(ActuatorGeometry(), TINY)):
        rest = cell.rest()
        x = cell.all_positions(rest)
        np.testing.assert_allclose(x[: len(cell.mesh.points)], cell.mesh.points, rtol=0, atol=1e-12)
        np.testing.assert_allclose(rest.segment_tension, cell.thread.tension(x), rtol=0, atol=1e-9)
        np.testing.assert_array_equal(rest.element_pressure, 0.0)
        np.testing.assert_array_equal(rest.multipliers, 0.0)


def test_the_core_bends_as_a_round_rod_does():
    """E π r⁴/4 κ²/2 for each length: between two moduli nothing else differs."""
    energies = []
    geometry = ActuatorGeometry()
    for modulus in (2e6, 6e6):
        cell = CellEquations(
            geometry, Ogden(), DoubleHelix(), Thread(), TINY, core=Core(young_modulus=modulus)
        )
        at = bent_configuration(cell, (0.01, -0.02, 0.0))
        energies.append(cell.energy(at) / cell.units.newton / cell.units.metre)
    radius = geometry.cavity_diameter / 2.0
    curvature, period = 1e3 * np.hypot(0.01, 0.02), cell.period / cell.units.metre
    expected = 4e6 * np.pi * radius**4 / 4.0 * curvature**2 / 2.0 * period
    assert energies[1] - energies[0] == pytest.approx(expected, rel=1e-9)


def test_a_thread_that_bends_goes_on_into_the_next_period():
    """The joints in the period stand for the one across its cut too: all lengths of the thread bend."""
    thread = Thread(bends=True)
    cell = CellEquations(ActuatorGeometry(), Ogden(), DoubleHelix(), thread, TINY)
    x = cell.all_positions(bent_configuration(cell, (0.01, -0.02, 0.0)))
    own = (cell.solid, cell.thread, thread, cell.helical.continued.points, cell.units)
    periodic, ended = (body_groups(*own, is_periodic=so)["thread bending"] for so in (True, False))
    joints, segments = len(ended.connectivity), len(cell.thread)
    assert joints == segments - 2  # of two threads
    assert periodic.energy(x) == pytest.approx(ended.energy(x) * segments / joints, rel=1e-12)
    assert cell.groups["thread bending"].energy(x) == pytest.approx(periodic.energy(x), rel=1e-12)


def test_the_next_period_follows_by_the_rods_motion():
    cell = tiny_equations()
    at = bent_configuration(cell, (0.006, -0.02, 0.004))
    rotation, translation = cell.period_motion(at)
    assert rotation.shape == (3, 3)
    assert translation.shape == (3,)
    x, rest = cell.all_positions(at), cell.mesh.points
    bottom, top = (np.flatnonzero(np.abs(rest[:, 2] - z) < 1e-9) for z in (0.0, rest[:, 2].max()))
    times = round(float(rest[:, 2].max() / cell.period))
    for node in top:
        below = bottom[np.argmin(np.linalg.norm(rest[bottom, :2] - rest[node, :2], axis=1))]
        moved = x[below]
        for _ in range(times):
            moved = rotation @ moved + translation
        np.testing.assert_allclose(x[node], moved, rtol=0, atol=1e-12)
    # The mesh goes on above the top as far as the threads' circumference reaches.
    above = cell.helical.continued.points[:, 2].max() - rest[:, 2].max()
    assert above >= Thread().radius * cell.units.metre
    # Closest points are sought on the core beyond both ends of the cell.
    assert cell.reach >= 2.0 * rest[:, 2].max() - 1e-12


@pytest.mark.parametrize("symmetric", [False, True])
def test_half_a_step_takes_half_of_everything(symmetric):
    cell = half_cell(ActuatorGeometry(), TINY) if symmetric else tiny_equations()
    at = replace(cell.symmetrised(bent_configuration(cell, CURVATURE)), multipliers=np.array([1.0, -2.0]))
    linear = cell.linearise(at, PRESSURE, exact=True)
    way = cell.nodal.displacement(1e-4 * np.random.default_rng(1).uniform(-1.0, 1.0, cell.size - 2))
    step = Step(way, np.array([0.0, 1e-5, 0.0, 1e-5]), np.array([0.5, 3.0]))
    half = cell.advance(at, step, 0.5, linear)
    np.testing.assert_allclose(half.positions, at.positions + 0.5 * way, rtol=0, atol=1e-15)
    np.testing.assert_allclose(half.strain, at.strain + 0.5 * step.strain, rtol=0, atol=1e-15)
    np.testing.assert_allclose(half.multipliers, [1.25, -0.5])
