"""Contact between chamber walls: silent while they are apart, with exact derivatives once they are close."""

import numpy as np
import pytest
import scipy.sparse as sparse

from fem_reference.walls import WallContact
from fem_reference.walls.self_contact import ACTIVATION, TIE_BREAK
from tests.fem_fixtures import asymmetry, difference, relative_error


@pytest.fixture(scope="module")
def walls(equations) -> WallContact:
    return equations.walls


@pytest.fixture(scope="module")
def rest(equations) -> np.ndarray:
    return equations.mesh.points


@pytest.fixture(scope="module")
def x(rest) -> np.ndarray:
    """All flattened along y to 0.012 of its width, with noise.

    An affine map is one-to-one, so that no wall meets another, though chamber 1 is only 0.04 to 0.09 mm thin.
    """
    return rest * [1.0, 0.012, 1.0] + 1e-3 * np.random.default_rng(2).uniform(-1.0, 1.0, rest.shape)


@pytest.fixture(scope="module")
def direction(rest) -> np.ndarray:
    return np.random.default_rng(1).uniform(-1.0, 1.0, rest.shape)


def response(walls: WallContact, positions: np.ndarray) -> tuple[np.ndarray, sparse.csr_matrix]:
    """Force and Hessian: those of a first iterate."""
    force, hessian, _ = walls.iterate(positions, None)
    return force, hessian


def test_open_chambers_feel_nothing(walls, rest):
    assert walls.iterate(rest, None) is None
    assert walls.force(rest) is None
    assert walls.energy(rest) == 0.0
    assert walls.minimum_distance(rest) == np.inf
    assert not walls.intersects(rest)


def test_walls_within_the_activation_distance_feel_each_other(walls, x):
    assert not walls.intersects(x)
    assert 0.0 < walls.minimum_distance(x) < ACTIVATION
    assert walls.energy(x) > 0.0


def test_the_same_positions_give_the_same_energy_and_force_every_time(walls, x):
    energies = {walls.energy(x) for _ in range(30)}
    assert len(energies) == 1
    forces = np.array([response(walls, x)[0] for _ in range(10)])
    assert np.ptp(forces, axis=0).max() == 0.0


# The potential is smooth only between the places where contact pairs change kind; steps of 1e-7 mm from these
# positions meet none. Against distances of 0.01 mm they lose (1e-5)⁴ of a difference, and round-off leaves
# 1e-8 of it.
STEP = 1e-7


def test_force_is_the_slope_of_the_energy(walls, x, direction):
    force, _ = response(walls, x)
    slope = difference(lambda t: walls.energy(x + t * direction), STEP)
    assert np.sum(force * direction) == pytest.approx(float(slope), rel=1e-6)


def test_hessian_is_the_symmetric_slope_of_the_force(walls, x, direction):
    _, hessian = response(walls, x)
    slope = difference(lambda t: response(walls, x + t * direction)[0], STEP)
    product = (hessian.tocsr() @ direction.ravel()).reshape(-1, 3)
    assert relative_error(product, slope) <= 1e-6
    assert asymmetry(hessian.toarray()) <= 1e-10


def test_what_makes_the_hessian_convex_has_no_positive_eigenvalue_and_leaves_no_negative_one(walls, rest, x):
    assert walls.concave_part(rest) is None
    (_, hessian), concave = response(walls, x), walls.concave_part(x)
    whole, part = hessian.toarray(), concave.toarray()
    # Round-off of a matrix of this size and number of entries in a row.
    noise = 1e-12 * np.linalg.norm(whole)
    assert np.linalg.eigvalsh(part)[-1] <= noise
    assert np.linalg.eigvalsh(whole)[0] < -1e3 * noise
    assert np.linalg.eigvalsh(whole - part)[0] >= -noise


def test_the_force_alone_is_that_of_the_response(walls, x):
    np.testing.assert_array_equal(walls.force(x), response(walls, x)[0])


def test_an_iterate_has_the_barriers_force_and_the_laws_stiffness_near_the_one_before(walls, x, direction):
    force, _, pairs = walls.iterate(x, None)
    np.testing.assert_array_equal(force, walls.force(x))
    np.testing.assert_array_equal(pairs.stiffness, pairs.law)
    # Edges (kind 2) may be all but parallel, and their distance then turns within any step; they share little
    # area. Of other pairs 1e-5 mm change the force by a twentieth only where it is below 1e-4 MPa.
    near = walls.iterate(x + 1e-5 * direction, pairs)[2]
    smooth = (near.kinds != 2) & (near.force > 1e-4)
    assert smooth.sum() > 100
    np.testing.assert_array_equal(near.stiffness[smooth], near.law[smooth])


def test_after_a_long_step_the_hessian_of_an_iterate_is_another_but_symmetric(walls, x, rest):
    wider = rest * [1.0, 0.016, 1.0]
    force, hessian, _ = walls.iterate(x, walls.iterate(wider, None)[2])
    np.testing.assert_array_equal(force, response(walls, x)[0])
    assert abs(hessian - response(walls, x)[1]).max() > 0.01 * abs(hessian).max()
    assert asymmetry(hessian.toarray()) <= 1e-10


def test_forces_on_the_walls_balance(walls, x):
    force, _ = response(walls, x)
    assert np.abs(force.sum(axis=0)).max() <= 1e-12 * np.abs(force).sum()


def test_only_wall_nodes_are_pushed(walls, rest, x):
    force, hessian = response(walls, x)
    others = np.setdiff1d(np.arange(len(rest)), walls.nodes)
    assert len(others) > 0
    np.testing.assert_array_equal(force[others], 0.0)
    assert sparse.csr_matrix(hessian)[(3 * others[:, None] + np.arange(3)).ravel()].nnz == 0


def test_the_energy_grows_as_the_walls_close(walls, rest):
    energies = [walls.energy(rest * [1.0, share, 1.0]) for share in (0.02, 0.012, 0.008, 0.006)]
    assert np.all(np.diff(energies) > 0.0)


def with_inner_arc_moved(equations, by: float) -> np.ndarray:
    """The inner arc of chamber 1 moved outwards, along x."""
    rest = equations.mesh.points
    nodes = np.unique(equations.chambers[0].quads)
    inner = nodes[np.hypot(*rest[nodes, :2].T) < 2.5 + 1e-6]
    moved = rest.copy()
    moved[inner, 0] += by
    return moved


def test_a_step_through_a_wall_is_cut_before_it_touches(walls, equations, rest):
    beyond = with_inner_arc_moved(equations, 4.0)
    limit = walls.step_limit(rest, beyond)
    # The arcs' middle nodes, 2.5 mm apart, meet first, but for the tie-breaking offsets and the search's
    # tolerance.
    assert limit == pytest.approx(2.5 / 4.0, abs=1e-3)
    assert not walls.intersects(rest + limit * (beyond - rest))
    assert walls.step_limit(rest, with_inner_arc_moved(equations, 2.4)) == 1.0


def test_where_pairs_are_seen_does_not_tell_when_they_touch(walls, equations, rest):
    """Seen apart by 0.03 mm, or passing through each other, where they do the contrary."""
    through, apart = (with_inner_arc_moved(equations, by) for by in (2.6, 2.47))
    limit = walls.step_limit(rest, through)
    assert limit < 1.0
    assert walls.step_limit(rest, through, (rest, apart)) == limit
    assert walls.step_limit(rest, apart, (rest, through)) == 1.0


def test_walls_are_held_apart_wherever_pairs_are_seen(walls, rest, x):
    through = x - 1.25 * rest * [0.0, 0.012, 0.0]
    held = walls.keep_walls_apart(x, through)
    np.testing.assert_array_equal(walls.keep_walls_apart(x, through, (x, through)), held)
    assert walls.keep_walls_apart(rest, x, (rest, through)) is None


def test_a_wall_pushed_through_another_is_seen(walls, equations):
    assert walls.intersects(with_inner_arc_moved(equations, 4.0))


def test_the_minimum_distance_is_that_of_the_walls(walls, rest, equations):
    # Outer arc's nodes of chamber 1 brought to 0.03 mm from the inner arc's middle node, along x.
    nodes = np.unique(equations.chambers[0].quads)
    section = rest[nodes]
    radius = np.hypot(section[:, 0], section[:, 1])
    middle = np.abs(section[:, 1]) < 1e-6
    inner, outer = nodes[middle & (radius < 3.0)], nodes[middle & (radius > 4.0)]
    assert len(inner) == len(outer) > 0
    dented = rest.copy()
    dented[outer, 0] = rest[inner[0], 0] + 0.03
    # Both vertices carry tie-breaking offsets of up to 1e-4 mm in every direction.
    assert walls.minimum_distance(dented) == pytest.approx(0.03, abs=2.0 * np.sqrt(3.0) * TIE_BREAK)


def test_walls_that_a_step_brings_through_each_other_are_held_apart(walls, rest, x):
    """On to 0.003 of the width and then past it: chambers are turned inside out."""
    assert walls.keep_walls_apart(x, x) is None
    assert walls.keep_walls_apart(rest, x) is None
    through = x - 1.25 * rest * [0.0, 0.012, 0.0]
    assert walls.step_limit(x, through) < 1.0
    held = walls.keep_walls_apart(x, through)
    assert walls.step_limit(x, through + held) == 1.0
    assert not walls.intersects(through + held)
    # Nodes that are of no wall stay where the step leads.
    others = np.setdiff1d(np.arange(len(rest)), walls.nodes)
    assert np.abs(held[others]).max() == 0.0
    # Along the walls' normals, y, alone.
    assert np.abs(held[:, 0]).max() < 0.1 * np.abs(held[:, 1]).max()


def test_neighbours_have_every_entry_of_walls_that_touch_and_after_a_small_move(walls, rest, x, direction):
    """Those of pairs that are new, and of pairs whose closest parts are others, too."""
    assert walls.neighbours(rest).nnz == 0
    neighbours = walls.neighbours(x)
    assert asymmetry(neighbours.toarray()) == 0.0
    # Pairs come nearer by 0.01 mm at most: walls touch within 0.05 mm and are neighbours within 0.15.
    moved = x + 0.05 * ACTIVATION * direction
    pairs = [set(zip(*response(walls, at)[1].nonzero(), strict=True)) for at in (x, moved)]
    assert pairs[1] - pairs[0]
    assert pairs[0] | pairs[1] <= set(zip(*neighbours.nonzero(), strict=True))
