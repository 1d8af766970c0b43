"""Bending by chamber 1 to where the walls of the others touch: nothing passes through anything."""

import numpy as np
import pytest

from fem_reference import Load, PeriodCell, Ring, follow
from fem_reference.cell.screw_motion import screw_series
from fem_reference.walls.self_contact import ACTIVATION


@pytest.fixture(scope="module")
def path(cell, bending_path):
    loads = [Load((kpa * 1e3, 0.0, 0.0)) for kpa in (35, 45, 55, 60)]
    return list(follow(cell, loads, start=bending_path[25]))


def test_no_wall_passes_through_another(cell, path):
    walls = cell.equations.walls
    distances = []
    for state in path:
        x = cell.equations.all_positions(state.configuration)
        assert not walls.intersects(x)
        distances.append(walls.minimum_distance(x))
    # They are in contact, from 35 kPa on, and pressed closer and closer.
    assert max(distances) < ACTIVATION
    assert 0.0 < distances[-1] < distances[0]


def test_no_node_of_the_cavity_enters_the_rod(cell, path):
    """The barrier lets it lean 0.018 mm inwards at most, under any pressure."""
    equations = cell.equations
    for state in path:
        x = equations.all_positions(state.configuration)
        gap = equations.core_contact.gap(x, screw_series(state.configuration.curvature, equations.reach))
        assert gap.min() > -0.018
        # It lies on the rod on one side and leaves it on the other.
        assert gap.max() > 0.0


def test_no_element_is_inverted(cell, path):
    for state in path:
        F = cell.equations.solid.deformation_gradient(cell.equations.all_positions(state.configuration))
        assert np.linalg.det(F).min() > 0.0


def test_bending_grows_with_the_pressure_and_stays_in_its_plane(path):
    bending = [-state.curvature[1] for state in path]
    assert np.all(np.diff(bending) > 0.0)
    assert np.rad2deg(0.06 * bending[-1]) > 120.0
    stable = [state for state in path if state.stable]
    assert len(stable) >= 3
    for state in stable:
        # A mirror-symmetric path, as long as the section does not buckle sideways; contacts are left to their
        # tie-breaking offsets of 1e-4 mm.
        assert np.abs(state.curvature[[0, 2]]).max() <= 1e-3 * abs(state.curvature[1])


@pytest.mark.slow  # stored points say so as well: `validation/test_paper_claims.py`
def test_chamber_1_which_faces_a_crossing_bends_the_most(cell, path):
    """At ψ = 0 chamber 1 is the least stiff; 2 and 3, which the winding alone sets apart, are stiffer."""
    other = cell.solve(Load((0.0, 45e3, 0.0)))
    bending = np.hypot(*other.curvature[:2])
    assert path[1].pressure[0] == pytest.approx(45e3)
    assert np.hypot(*path[1].curvature[:2]) > 1.02 * bending


def test_states_in_contact_are_in_equilibrium(path):
    """Accepted at the barrier's own jumps at worst: 1e-3 N of a wall's 0.01 N or more."""
    for state in path:
        assert state.residual <= 1e-3
        # u is good to 1e-4 1/m there, against a stiffness of 3e-4 N m² or so.
        np.testing.assert_allclose(state.moment, 0.0, rtol=0, atol=1e-7)


@pytest.mark.slow
def test_steps_that_are_long_end_on_the_same_branch_as_short_ones():
    """A section between rings has a second equilibrium under these loads, 4.6 degrees from the first.

    Long steps once ended there, by way of nineteen iterations with another stiffness than the true one.
    """
    cell = PeriodCell(winding=Ring(), level="coarse", end_compliance=0.23e-3)
    # To the last digit: whether such a way ends in the wrong place is chance.
    middle = np.array([7611.1277, 8310.0575, 17078.8147, -3.0139079e-3, -1.3548792e-3, 0.1837586e-3])
    end = np.array([16490.77677, 18005.12463, 37004.09861, -4.3842921e-3, 2.4005727e-3, -1.9530259e-3])

    def ramp(start, goal, steps):
        shares = np.arange(1, steps + 1)[:, None] / steps
        return [Load(tuple(row[:3]), tuple(row[3:])) for row in start + shares * (goal - start)]

    none = np.zeros(6)
    *_, short = follow(cell, ramp(none, end, 20))
    *_, long = follow(cell, [*ramp(none, middle, 3), *ramp(middle, end, 3)])
    # Each may be accepted where the contact's noise moves u by 2e-3 1/m.
    np.testing.assert_allclose(long.curvature, short.curvature, rtol=0, atol=4e-3)
