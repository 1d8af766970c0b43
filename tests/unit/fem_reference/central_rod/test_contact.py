"""Contact of the cavity's facets with the rod's curve, and what of it comes with the rod's roundness."""

from dataclasses import replace

import numpy as np
import pytest

from fem_reference.central_rod import ACTIVATION, REST_SHARE, barrier
from tests.fem_fixtures import TINY, assemble, difference, relative_error
from tests.unit.fem_reference.actuator.test_equations import ActuatorEquations, Case, model

# Products of some ten numbers in each entry.
ROUNDING = 1e-12


@pytest.fixture(scope="module")
def case() -> Case:
    return Case(ActuatorEquations(model()))


@pytest.fixture(scope="module")
def pressed(case):
    """Contact, and positions with the cavity of the wider section pressed on the bent rod on one side."""
    contact, x = case.equations.contact, case.x.copy()
    x[wall(case), 0] -= 0.006
    assert (contact.pressure(x) > 0.0).sum() >= 20
    return contact, x


def wall(case) -> np.ndarray:
    """Nodes of the facets that are not bonded."""
    nodes = case.equations.contact.connectivity
    return np.unique(nodes[nodes < case.equations.nodes])


def test_facets_just_touch_the_rod_at_rest(case):
    """Points on chords as nodes do: the wall is centred by the barrier's slope there, 0.6 kPa."""
    contact, rest = case.equations.contact, case.equations.rest_positions
    np.testing.assert_allclose(contact.gap(rest), 0.0, atol=1e-12)
    _, slope, _ = barrier(np.array([REST_SHARE * ACTIVATION]))
    np.testing.assert_allclose(contact.pressure(rest), -slope[0], rtol=1e-9)
    # The wall's mean push along x and y is that of a ring: none.
    force = assemble(contact.connectivity, contact.force(rest), len(rest))
    np.testing.assert_allclose(force[: case.equations.nodes].sum(axis=0), 0.0, atol=1e-12)


def test_a_wall_in_the_rod_is_not_admissible_nor_one_that_slips_along_it_by_some_spans(case):
    contact, x = case.equations.contact, case.x.copy()
    assert contact.admissible(x)
    radius = np.hypot(*case.equations.rest_positions[wall(case)[0], :2])
    x[wall(case), 0] -= radius
    assert not contact.admissible(x)
    x = case.x.copy()
    x[wall(case), 2] += 3.0 * case.equations.basis.span
    assert not contact.admissible(x)


@pytest.mark.parametrize(("bonded", "lowest"), [("all", 0.0), ("cap", 9.0), ("tip", 10.0)])
def test_the_cavity_is_bonded_from_where_it_is_said_to_be_and_slides_below(bonded, lowest):
    """Of 12 mm, with nodes every 0.5 mm in the cap; bonded on both sides of a facet it is not in contact."""
    equations = ActuatorEquations(model(bonded, replace(TINY, axial_size=0.5)))
    heights = equations.rest_positions[:, 2]
    cavity = heights[equations.mesh.nodes("cavity")]
    assert len(equations.bond.connectivity) == (cavity > lowest - 1e-6).sum()
    if lowest > 0.0:
        facets = equations.contact.connectivity[:, :4]
        assert heights[facets].min(axis=1).max() < lowest
        assert heights[facets].max() == pytest.approx(lowest)


def test_a_wall_that_is_bonded_all_along_is_not_in_contact():
    equations = ActuatorEquations(model("all"))
    assert len(equations.contact.connectivity) == 0
    assert equations.contact.energy(equations.rest_positions) == 0.0
    assert len(equations.bond.connectivity) == len(equations.mesh.nodes("cavity"))


def test_forces_are_the_gradient_of_the_energy_and_tangents_that_of_the_forces(case, pressed):
    contact, x = pressed
    local, tangents = contact.response(x)
    along = case.direction[contact.connectivity].reshape(len(local), -1)

    def at(t: float) -> np.ndarray:
        return x + t * case.direction

    slope = difference(lambda t: contact.energy(at(t)), 1e-6)
    # Energies of 1e-3 N mm have round-off of 1e-15, over steps that move points by parts of the barrier.
    assert slope == pytest.approx(float((local * along).sum()), rel=1e-6)
    np.testing.assert_allclose(contact.force(x), local, atol=ROUNDING * np.abs(local).max())
    change = difference(lambda t: contact.force(at(t)), 1e-6)
    assert relative_error(np.einsum("fij,fj->fi", tangents, along), change) < 1e-6


def test_roundness_only_takes_stiffness(pressed):
    """One-signed: without it a matrix is stiffer in every direction, and a step with it goes downhill.

    It is of one motion of each of the facet's four points.
    """
    contact, x = pressed
    values = np.linalg.eigvalsh(contact.concave_part(x)[(contact.pressure(x) > 0.0).all(axis=0)])
    scale = np.abs(values).max(axis=1)
    assert (values[:, 0] < 0.0).all()
    assert (np.abs(values[:, 4:]) <= ROUNDING * scale[:, None]).all()


def test_without_it_a_pressed_facet_turns_freely_around_the_straight_rod(case):
    """A turn leaves every gap as it is: what a straight move loses by roundness is its second order."""
    contact, x = case.equations.contact, case.equations.rest_positions.copy()
    x[wall(case), :2] *= 0.995
    assert (contact.pressure(x) > 1e-3).all()
    turn = np.cross([0.0, 0.0, 1.0], x)
    turn[case.equations.nodes :] = 0.0
    turn = turn[contact.connectivity].reshape(len(contact.connectivity), -1)
    whole, round_part = (
        np.einsum("fi,fij,fj->f", turn, part, turn)
        for part in (contact.response(x)[1], contact.concave_part(x))
    )
    assert (whole < 0.0).all()
    np.testing.assert_allclose(whole, round_part, rtol=1e-9)


def test_roundness_says_nothing_of_what_moves_with_the_rod(pressed):
    contact, x = pressed
    concave = contact.concave_part(x)
    together = np.tile(np.eye(3), concave.shape[1] // 3)
    assert np.abs(together @ concave).max() <= ROUNDING * np.abs(concave).max()
