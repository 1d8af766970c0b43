"""What of the contact with the rod's curve comes with its roundness: nodes that slide off around it."""

import numpy as np
import pytest

from tests.unit.fem_reference.test_actuator_equations import ActuatorEquations, Case, model

# Products of some ten numbers in each entry.
ROUNDING = 1e-12


@pytest.fixture(scope="module")
def pressed():
    """Contact, tangents and their concave part of free nodes that press on a bent rod, and their offsets."""
    case = Case(ActuatorEquations(model()))
    contact, x = case.equations.contact, case.x.copy()
    # The cavity of the wider section, pressed on the rod on one side.
    x[contact.nodes, 0] -= 0.006
    keep = ~contact.bonded & (contact.pressure(x) > 0.0)
    assert keep.sum() >= 5
    tangents, concave = contact.response(x)[1][keep], contact.concave_part(x)[keep]
    return contact, x, keep, tangents, concave


def test_it_takes_stiffness_from_one_motion_of_a_node_and_its_window(pressed):
    """One-signed: without it a matrix is stiffer in every direction, and a step with it goes downhill."""
    *_, concave = pressed
    values = np.linalg.eigvalsh(concave)
    scale = np.abs(values).max(axis=1)
    assert (values[:, 0] < 0.0).all()
    assert (np.abs(values[:, 1:]) <= ROUNDING * scale[:, None]).all()


def test_without_it_a_node_moves_freely_around_the_rod(pressed):
    contact, x, keep, tangents, concave = pressed
    _, offset, tangent, _ = contact._closest(x)
    around = np.cross(tangent, offset)[keep]
    around /= np.linalg.norm(around, axis=1)[:, None]
    stiffness = [np.einsum("ni,nij,nj->n", around, part[:, :3, :3], around) for part in (tangents, concave)]
    assert (stiffness[0] < 0.0).all()
    np.testing.assert_allclose(stiffness[0], stiffness[1], rtol=1e-9)


def test_it_says_nothing_of_what_moves_with_the_rod(pressed):
    *_, concave = pressed
    together = np.tile(np.eye(3), concave.shape[1] // 3)
    assert np.abs(together @ concave).max() <= ROUNDING * np.abs(concave).max()
