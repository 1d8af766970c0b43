"""The full actuator's equations on a short body: gradients, stiffness, loads and reactions."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from fem_reference import ActuatorGeometry, ActuatorLoad, DoubleHelix, Ogden, Thread
from fem_reference.actuator import Deformation
from fem_reference.actuator.equations import ActuatorEquations
from fem_reference.actuator.load import ActuatorTarget
from fem_reference.actuator.model import ActuatorModel
from fem_reference.actuator.pose import axis_shape
from fem_reference.elements import pressure_groups
from fem_reference.mesh import MeshLevel
from tests.fem_fixtures import QUADRATIC, TINY, assemble, difference, relative_error, rotation, times

SHORT = ActuatorGeometry(body_length=9e-3, cap_length=3e-3)
LOAD = ActuatorLoad((9e3, 4e3, 2e3), gravity=(1.0, 2.0, -9.81)).target()


def model(
    bonded: str = "cap", level: MeshLevel = TINY, wire: bool = False, symmetric: bool = False
) -> ActuatorModel:
    """With a thread that bends and goes on over the cap, if it is a wire."""
    thread = Thread(bends=wire)
    return ActuatorModel(SHORT, Ogden(), DoubleHelix(), thread, level, 1070.0, bonded, wire, symmetric)


@pytest.fixture(scope="module")
def equations() -> ActuatorEquations:
    return ActuatorEquations(model())


class Case:
    """A deformation far from equilibrium, and a direction with nothing in the clamped components."""

    def __init__(self, equations: ActuatorEquations) -> None:
        self.equations = equations
        rng = np.random.default_rng(0)
        rest = equations.rest_positions
        free = ~equations.clamped
        smooth = rest.copy()
        # Wider sections keep the cavity off the barrier's wall; the bend is one of the whole body.
        smooth[: equations.nodes, :2] *= 1.002
        smooth[:, 0] += 0.004 * rest[:, 2] ** 2
        x = smooth + 5e-4 * rng.uniform(-1.0, 1.0, rest.shape)
        self.x = np.where(free, x, rest)
        self.direction = np.where(free, rng.normal(size=rest.shape), 0.0)

    def at(self, t: float = 0.0) -> Deformation:
        rest = self.equations.rest()
        return Deformation(
            self.x + t * self.direction, rest.element_pressure, rest.segment_tension, rest.axis_tension
        )

    def residual(self, target: ActuatorTarget, t: float = 0.0) -> np.ndarray:
        return self.equations.linearise(self.at(t), target, exact=True).residual


CASES = {
    "cap": ("cap", TINY),
    "all": ("all", TINY),
    "quadratic": ("cap", QUADRATIC),
    "wire": ("cap", TINY, True),
}


@pytest.fixture(scope="module", params=CASES)
def case(request) -> Case:
    return Case(ActuatorEquations(model(*CASES[request.param])))


def potential(case: Case, target: ActuatorTarget, t: float) -> float:
    equations, at = case.equations, case.at(t)
    weight = float((equations.mass[:, None] * target.gravity * at.positions).sum())
    return equations.strain_energy(at) - float(target.pressure @ equations.volumes(at)) - weight


def test_the_residual_is_the_gradient_of_the_potential(case):
    slope = difference(lambda t: potential(case, LOAD, t), 1e-5)
    free = case.equations.fold @ case.direction.ravel()
    # The energy, about 1e3 N mm, has 1e-13 relative of round-off: 1e-10 over the step of 1e-5, of 1e3 N.
    assert slope == pytest.approx(float(case.residual(LOAD) @ free), rel=1e-6)


def test_the_stiffness_is_the_gradient_of_the_residual(case):
    equations = case.equations
    linear = equations.linearise(case.at(), LOAD, exact=True)
    upper = equations.pattern.matrix(linear.data)
    free = equations.fold @ case.direction.ravel()
    product = upper @ free + upper.T @ free - upper.diagonal() * free
    assert relative_error(product, difference(lambda t: case.residual(LOAD, t), 1e-6)) < 1e-6


def test_forces_and_stiffness_of_every_group_are_derivatives_of_its_energy(case):
    """Own forces are those of the law, so that the stiffness is the Hessian."""
    equations, x, direction = case.equations, case.x, case.direction
    groups = {**equations.groups, **pressure_groups(equations.chambers, LOAD.pressure)}
    for name, group in groups.items():
        nodes = group.connectivity

        def forces(t, group=group, nodes=nodes):
            return assemble(nodes, group.force(x + t * direction, None).force, len(x))

        response = group.response(x, None)
        np.testing.assert_allclose(
            assemble(nodes, response.force, len(x)), forces(0.0), rtol=0, atol=1e-12, err_msg=name
        )
        slope = difference(lambda t, group=group: group.energy(x + t * direction), 1e-5)
        # Energies of up to 1e3 N mm with round-off of 1e-16 of it, over steps of 1e-5.
        assert (forces(0.0) * direction).sum() == pytest.approx(float(slope), rel=1e-6, abs=1e-7), name
        expected = difference(forces, 1e-6)
        product = times(nodes, response.stiffness, direction)
        # Contact that is open has neither.
        atol = 1e-6 * np.abs(expected).max(initial=0.0)
        np.testing.assert_allclose(product, expected, rtol=0, atol=atol, err_msg=name)


def test_the_thread_ends_with_the_body_or_goes_on_over_the_cap(equations):
    wound = ActuatorEquations(model(wire=True))
    for each, length in ((equations, 9.0), (wound, 12.0)):
        assert each.thread.points(each.rest_positions)[:, 2].max() == pytest.approx(length, abs=1e-6)


@pytest.mark.parametrize("follower", [False, True])
def test_the_tip_loads_stiffness_is_that_of_a_face_that_turns_rigidly(equations, follower):
    load = ActuatorLoad(
        tip_force=(0.02, -0.03, 0.01), tip_moment=(1e-3, 2e-3, -1e-3), follower=follower
    ).target()
    x = equations.rest().positions @ rotation((1.0, 0.3, 0.2), 0.4).T
    axis = np.array([0.3, -0.5, 0.8])
    centre = equations.tip.frame(x).position

    def forces(t: float) -> np.ndarray:
        turned = (x - centre) @ rotation(tuple(axis), t * np.linalg.norm(axis)).T + centre
        return equations.fold @ equations.load.response(turned, load).force.ravel()

    _, columns, rows = equations.load.response(x, load)
    spin = equations.fold @ np.cross(axis, x - centre).ravel()
    np.testing.assert_allclose(rows @ spin, axis, atol=1e-12)
    slope = difference(forces, 1e-3)
    assert relative_error(columns @ (rows @ spin), slope) < 1e-9


def test_tip_loads_have_their_resultant_and_moment(equations):
    force, moment = (0.02, -0.03, 0.01), (1e-3, 2e-3, -1e-3)
    load = ActuatorLoad(tip_force=force, tip_moment=moment).target()
    x = equations.rest_positions
    nodal = equations.load.response(x, load).force
    centre = equations.tip.frame(x).position
    np.testing.assert_allclose(nodal.sum(axis=0), force, atol=1e-15)
    np.testing.assert_allclose(np.cross(x - centre, nodal).sum(axis=0), np.multiply(moment, 1e3), atol=1e-12)


def test_the_mass_is_that_of_the_silicone_and_the_rod(equations):
    silicone = equations.solid.volume.sum()
    assert equations.mass.sum() == pytest.approx(1070e-12 * (silicone + np.pi * 12.0), rel=1e-9)


def test_chambers_are_closed_by_base_and_cap(equations):
    """The tiny section's polygons hold less than the circles', by some percent."""
    volumes = equations.volumes(equations.rest())
    exact = SHORT.chamber_area * SHORT.body_length * 1e9
    np.testing.assert_allclose(volumes, volumes[0], rtol=1e-9)
    assert 0.9 * exact < volumes[0] < exact
    x = equations.rest_positions
    pressure_on = sum(
        assemble(patch.connectivity, patch.gradient(x), len(x))
        for chamber in equations.chambers
        for patch in chamber.patches
    )
    # A closed surface under uniform pressure has no resultant.
    np.testing.assert_allclose(pressure_on.sum(axis=0), 0.0, atol=1e-10)


def test_sections_that_lean_against_a_straight_axis_are_told(equations: ActuatorEquations) -> None:
    """Each section turned as a whole; what takes it back to the plane across the axis is the reverse."""
    lean = np.array([0.02, -0.013, 0.0])
    turned = equations.rest_positions.copy()
    nodes, height = equations.nodes, equations.rest_positions[: equations.nodes, 2]
    arms = turned[:nodes] * [1.0, 1.0, 0.0]
    turned[:nodes] = arms @ Rotation.from_rotvec(lean).as_matrix().T
    turned[:nodes, 2] += height
    shape = axis_shape(equations, turned)
    # The tilt is about an axis across the rod; the lean is that, to its cube.
    np.testing.assert_allclose(shape.shear, np.broadcast_to(-lean[:2], shape.shear.shape), atol=1e-5)
    np.testing.assert_allclose(shape.rotations, np.broadcast_to(np.eye(3), shape.rotations.shape), atol=1e-6)


def test_sections_that_turn_with_the_axis_do_not_lean(equations: ActuatorEquations) -> None:
    turn = Rotation.from_rotvec([0.3, -0.2, 0.5])
    shape = axis_shape(equations, turn.apply(equations.rest_positions))
    np.testing.assert_allclose(shape.shear, 0.0, atol=1e-9)
    np.testing.assert_allclose(
        shape.rotations[:, :, 2], np.tile(turn.as_matrix()[:, 2], (len(shape.shear), 1)), atol=1e-9
    )
