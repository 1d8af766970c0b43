"""Forces of wall pairs as unknowns: the barrier's own in the end, and a way there that does not crawl."""

import ipctk
import numpy as np
import pytest

from fem_reference.walls.pair_forces import WallPairs, barrier_force, pair_vertices, wall_pairs
from fem_reference.walls.self_contact import ACTIVATION, STIFFNESS
from tests.fem_fixtures import difference

# A vertex above the middle of a triangle, the nearest of a second triangle's.
EDGES = np.array([[0, 1], [1, 2], [0, 2], [3, 4], [4, 5], [3, 5]], np.int32)
FACES = np.array([[0, 1, 2], [3, 4, 5]], np.int32)


def vertices(gap: float) -> np.ndarray:
    points = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0.2, 0.2, gap], [1.2, 0.2, 0.5], [0.2, 1.2, 0.5]]
    return np.asfortranarray(points, dtype=float)


MESH = ipctk.CollisionMesh(vertices(0.01), EDGES, FACES)


def pairs_at(gap: float, before: WallPairs | None = None) -> WallPairs:
    collisions = ipctk.NormalCollisions()
    collisions.build(MESH, vertices(gap), ACTIVATION)
    return wall_pairs(collisions, MESH, vertices(gap), ACTIVATION, STIFFNESS, before)


@pytest.mark.parametrize("gap", [1e-3, 0.01, 0.03])
def test_the_force_is_that_of_the_potential(gap):
    potential = ipctk.BarrierPotential(ACTIVATION, STIFFNESS, use_physical_barrier=True)

    def energy(t: float) -> float:
        collisions = ipctk.NormalCollisions()
        collisions.build(MESH, vertices(gap + t), ACTIVATION)
        return potential(collisions, MESH, vertices(gap + t))

    pairs = pairs_at(gap)
    # Differences over a thousandth of the gap lose (1e-3)⁴ and rounding.
    assert pairs.area[0] * pairs.force[0] == pytest.approx(-float(difference(energy, 1e-3 * gap)), rel=1e-6)


@pytest.mark.parametrize("gap", [1e-3, 0.01, 0.03])
def test_the_law_is_the_slope_of_the_force(gap):
    slope = difference(lambda t: barrier_force(np.array([gap + t]), ACTIVATION, STIFFNESS)[0], 1e-3 * gap)
    assert pairs_at(gap).law == pytest.approx(-np.asarray(slope), rel=1e-6)


def test_beyond_the_activation_distance_there_is_no_force():
    force, law = barrier_force(np.array([ACTIVATION, 2.0 * ACTIVATION]), ACTIVATION, STIFFNESS)
    np.testing.assert_array_equal(force, 0.0)
    np.testing.assert_array_equal(law, 0.0)


def test_without_an_iterate_before_the_stiffness_is_the_laws():
    members, local = pairs_at(0.01).change()
    assert len(members) == len(local) == 0


def test_a_step_that_the_law_foretells_leaves_the_laws_stiffness():
    # The force is off its line by half of (δ/d)², a share of 5e-5.
    assert pairs_at(0.0101, before=pairs_at(0.01)).stiffness == pairs_at(0.0101).law


def test_a_step_that_went_too_far_is_taken_back_by_a_softer_pair():
    pressed = pairs_at(0.001, before=pairs_at(0.02))
    assert 0.0 <= pressed.stiffness[0] < 0.5 * pressed.law[0]


def test_the_change_pulls_along_the_gap():
    pairs = pairs_at(0.001, before=pairs_at(0.02))
    members, local = pairs.change()
    row = list(members[0]).index(3)
    # The vertex against the triangle: all of the distance's slope along z is its own.
    assert local[0, 3 * row + 2, 3 * row + 2] == pytest.approx(
        pairs.area[0] * (pairs.stiffness[0] - pairs.law[0]), rel=1e-12
    )
    np.testing.assert_allclose(local[0], local[0].T)


def steps_to_equilibrium(start: float, load: float, remembers: bool) -> int:
    """Newton steps of the vertex under a force on the triangle, until the gap moves by less than 1e-9 mm."""
    gap, before = start, None
    for count in range(1, 100):
        pairs = pairs_at(gap, before)
        step = float((pairs.area @ pairs.force - load) / (pairs.area @ pairs.stiffness))
        if abs(step) < 1e-9:
            return count
        before = pairs if remembers else None
        gap += step
    raise AssertionError("no equilibrium")


def test_a_gap_that_is_too_narrow_opens_without_doubling_step_by_step():
    load = float(pairs_at(0.015).area @ pairs_at(0.015).force)
    plain, with_forces = (steps_to_equilibrium(1e-5, load, remembers) for remembers in (False, True))
    # From 1e-5 to 0.015 mm are eleven doublings.
    assert plain >= 11
    assert with_forces <= 0.7 * plain


def test_pairs_of_every_kind_are_measured_as_ipctk_does():
    """Two crumpled sheets on each other: vertices and distances are those that ipctk tells of each pair."""
    count = 5
    grid = np.arange(count**2).reshape(count, count)
    corners = [grid[:-1, :-1], grid[:-1, 1:], grid[1:, :-1], grid[1:, 1:]]
    a, b, c, d = (corner.ravel() for corner in corners)
    sheet = np.concatenate([np.column_stack([a, b, c]), np.column_stack([b, d, c])])
    faces = np.concatenate([sheet, sheet + count**2]).astype(np.int32)
    sides = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
    edges = np.unique(np.sort(sides, axis=1), axis=0)
    x, y = np.meshgrid(np.arange(count, dtype=float), np.arange(count, dtype=float))
    flat = np.column_stack([0.1 * x.ravel(), 0.1 * y.ravel(), np.zeros(count**2)])
    noise = 0.01 * np.random.default_rng(0).normal(size=(2 * count**2, 3))
    points = np.asfortranarray(np.concatenate([flat, flat + np.array([0.03, 0.02, 0.06])]) + noise)
    mesh = ipctk.CollisionMesh(points, edges, faces)
    collisions = ipctk.NormalCollisions()
    collisions.build(mesh, points, ACTIVATION)
    pairs = wall_pairs(collisions, mesh, points, ACTIVATION, STIFFNESS, None)
    assert set(pairs.kinds) == {0, 1, 2, 3}
    kinds = (
        collisions.vv_collisions,
        collisions.ev_collisions,
        collisions.ee_collisions,
        collisions.fv_collisions,
    )
    for number, of_kind in enumerate(kinds):
        own = pair_vertices(of_kind, mesh)
        told = [pair.vertex_ids(edges, faces)[: own.shape[1]] for pair in of_kind]
        np.testing.assert_array_equal(own, told)
        places = [pair.dof(points, edges, faces) for pair in of_kind]
        squares = [pair.compute_distance(place) for pair, place in zip(of_kind, places, strict=True)]
        gradients = [
            pair.compute_distance_gradient(place) for pair, place in zip(of_kind, places, strict=True)
        ]
        chosen = pairs.kinds == number
        np.testing.assert_allclose(pairs.distance[chosen] ** 2, squares, rtol=1e-10)
        # Of the squared distance, 2 d ∂d.
        slope = 2.0 * pairs.distance[chosen, None, None] * pairs.gradient[chosen, : own.shape[1]]
        np.testing.assert_allclose(slope.reshape(len(told), -1), gradients, atol=1e-12)
