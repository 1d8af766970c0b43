"""A body that keeps its plane of symmetry: half the unknowns, and what the whole body does in that plane."""

from unittest import mock

import numpy as np
import pytest

from fem_reference import Actuator, ActuatorGeometry, ActuatorLoad, DoubleHelix, Ring, SixHelix
from fem_reference.actuator import Deformation
from fem_reference.actuator.equations import ActuatorEquations
from fem_reference.mesh import mirror_images, symmetrised
from tests.fem_fixtures import QUADRATIC, TINY, relative_error
from tests.unit.fem_reference.actuator.test_equations import LOAD, SHORT, model

MIRROR = np.array([1.0, -1.0, 1.0])
IN_PLANE = ActuatorLoad((9e3, 2e3, 2e3), (0.01, 0.0, 0.02), (0.0, 1e-3, 0.0), (1.0, 0.0, -9.81))


class Both:
    """The equations with and without the plane kept, at a deformation that keeps it."""

    def __init__(self, level) -> None:
        self.half = ActuatorEquations(model(level=level, symmetric=True))
        # On the same mesh: that of the half is its own image to round-off, the other one to 3e-8 mm.
        with mock.patch("fem_reference.actuator.equations.actuator_mesh", return_value=self.half.mesh):
            self.whole = ActuatorEquations(model(level=level))
        rest = self.whole.rest_positions
        image = mirror_images(rest)
        noise = 1e-3 * np.random.default_rng(0).normal(size=rest.shape)
        x = 1.004 * rest + [0.004, 0.0, 0.0] * rest[:, 2:] ** 2 + noise + noise[image] * MIRROR
        x = np.where(self.whole.clamped, rest, x)
        # The plane's own points stay in it.
        x[:, 1] = np.where(image == np.arange(len(x)), 0.0, x[:, 1])
        unloaded = self.whole.rest()
        self.at = Deformation(x, unloaded.element_pressure, unloaded.segment_tension, unloaded.axis_tension)


@pytest.fixture(scope="module", params=[TINY, pytest.param(QUADRATIC, marks=pytest.mark.slow)])
def both(request) -> Both:
    return Both(request.param)


def test_the_residual_and_the_stiffness_are_the_whole_bodys_along_what_keeps_the_plane(both):
    target = IN_PLANE.target()
    whole, half = (e.linearise(both.at, target, exact=True) for e in (both.whole, both.half))
    # How the whole body's unknowns follow from the half's.
    follow = both.whole.fold @ both.half.fold.T
    np.testing.assert_allclose(half.residual, follow.T @ whole.residual, atol=1e-12)
    upper = both.whole.pattern.matrix(whole.data)
    full = upper + upper.T
    full.setdiag(upper.diagonal())
    expected = (follow.T @ full @ follow).toarray()
    found = both.half.pattern.matrix(half.data).toarray()
    assert relative_error(np.triu(expected), found) < 1e-12
    np.testing.assert_allclose(half.load_columns, follow.T @ whole.load_columns, atol=1e-15)
    # A point in the plane is one of the whole's unknowns; two images are two.
    assert both.half.size < 0.56 * both.whole.size


def test_energy_mass_and_reactions_are_the_whole_bodys(both):
    target = IN_PLANE.target()
    whole, half = (e.linearise(both.at, target, exact=True) for e in (both.whole, both.half))
    assert both.half.strain_energy(both.at) == pytest.approx(both.whole.strain_energy(both.at), rel=1e-12)
    assert both.half.mass.sum() == pytest.approx(both.whole.mass.sum(), rel=1e-12)
    # The fans that close the chambers at the clamp are not their own images, all of them together are.
    expected = symmetrised(both.whole.reaction(whole, target), mirror_images(both.half.rest_positions))
    np.testing.assert_allclose(
        both.half.reaction(half, target), expected, atol=1e-12 * np.abs(expected).max()
    )


def test_half_the_elements_and_facets_stand_for_all(both):
    halves = both.half.halves
    # Quadratic elements of one partition, and their facets, lie across the plane.
    assert len(both.half.solid) < 0.57 * len(both.whole.solid)
    assert len(both.half.contact.connectivity) < 0.57 * len(both.whole.contact.connectivity)
    # The mean dilatation is the same in both of a pair; linear ones change their sign with the place.
    x = both.at.positions
    np.testing.assert_allclose(
        halves.expand(both.half.solid.dilatation(x))[:, 0], both.whole.solid.dilatation(x)[:, 0], atol=1e-12
    )


def test_unknowns_move_points_as_mirror_images(both):
    move = (both.half.fold.T @ np.random.default_rng(1).normal(size=both.half.size)).reshape(-1, 3)
    np.testing.assert_array_equal(move[mirror_images(both.half.rest_positions)], move * MIRROR)
    assert np.abs(move).max() > 0.0


def test_what_breaks_the_symmetry_leaves_no_force(both):
    """A pressure in chamber 2 alone, and less the same in chamber 3."""
    at, target = both.half.rest(), LOAD
    force = np.zeros_like(at.positions)
    for weight, chamber in zip((0.0, 1.0, -1.0), both.half.chambers, strict=True):
        for patch in chamber.patches:
            local = patch.gradient(at.positions).reshape(-1, 3)
            np.add.at(force, patch.connectivity.ravel(), weight * local)
    assert np.abs(force).max() > 1e-3 * np.abs(target.pressure).max()
    np.testing.assert_allclose(both.half.fold @ force.ravel(), 0.0, atol=1e-6 * np.abs(force).max())


@pytest.mark.slow
def test_states_are_the_whole_bodys():
    loads = [ActuatorLoad((p, 0.0, 0.0)) for p in (6e3, 12e3)]
    whole, half = (Actuator(SHORT, level=TINY, symmetric=s) for s in (False, True))
    for one, other in zip(whole.follow(loads), half.follow(loads), strict=True):
        # To forces of 1e-5 N with a kept stiffness, of 1e-2 N.
        np.testing.assert_allclose(one.tip_position, other.tip_position, atol=1e-3 * 1e-4)
        np.testing.assert_allclose(one.chamber_volume, other.chamber_volume, rtol=1e-4)
        assert one.settled.stable
        assert other.settled.stable
        np.testing.assert_allclose(other.settled.base_force, 0.0, atol=1e-4)
        assert other.bending_plane == pytest.approx(0.0, abs=1e-9)


@pytest.mark.parametrize("winding", [DoubleHelix(), Ring(), SixHelix()])
def test_windings_with_the_plane_are_taken(winding):
    assert Actuator(SHORT, winding, TINY, symmetric=True).unknowns > 0


def test_what_has_not_the_plane_is_refused_by_name():
    with pytest.raises(ValueError, match="symmetric: got a winding without it, expected"):
        Actuator(SHORT, DoubleHelix(psi=0.5), TINY, symmetric=True)
    thicker = ActuatorGeometry(body_length=9e-3, cap_length=3e-3, outer_wall_variation=(0.0, 0.1, 0.0))
    with pytest.raises(ValueError, match="symmetric: got a geometry without it, expected"):
        Actuator(thicker, level=TINY, symmetric=True)
    actuator = Actuator(SHORT, level=TINY, symmetric=True)
    for load in (
        ActuatorLoad((0.0, 1e3, 0.0)),
        ActuatorLoad(tip_force=(0.0, 0.01, 0.0)),
        ActuatorLoad(tip_moment=(1e-3, 0.0, 0.0)),
        ActuatorLoad(gravity=(0.0, 1.0, 0.0)),
    ):
        with pytest.raises(ValueError, match=r"symmetric: got ActuatorLoad.*on both sides of y = 0"):
            actuator.solve(load)
