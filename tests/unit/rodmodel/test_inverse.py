"""The inverse: pressures for a bend or a tip position, within the domain, without needless co-contraction."""

import itertools
from dataclasses import replace

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.optimize import LinearConstraint, minimize

import rodmodel
from rodmodel import Inverse, Rod
from rodmodel._bounded import _minimum, boxes_of
from tests.unit.rodmodel import synthetic

TARGETS = 1000
GRAVITY = np.array([0.0, 0.0, -9.81])


@pytest.fixture(scope="module")
def rod() -> Rod:
    return synthetic.rod(synthetic.bending_law())


@pytest.fixture(scope="module")
def shipped() -> Rod:
    return rodmodel.load("double-helix")


def inside(domain: rodmodel.Domain, count: int) -> np.ndarray:
    """Pressures spread evenly over a domain."""
    rng = np.random.default_rng(0)
    pressures = rng.uniform(size=(20 * count, 3)) * np.array(domain.pressure_max)
    return pressures[pressures.sum(axis=1) <= domain.pressure_sum_max][:count]


@pytest.fixture(scope="module")
def to_position() -> object:
    return jax.jit(lambda rod, position: rod.inverse(tip_position=position, throw=False))


def without_ends(rod: Rod) -> Rod:
    """The same section in an actuator that bends evenly from base to cap."""
    actuator = replace(rod.actuator, stiff_tip=0.0, base_turn=0.0, base_lag=0.0, tip_offset=0.0)
    return Rod(rod.section, actuator, rod.domain, rod.angle_error)


@pytest.mark.parametrize(
    ("kind", "ends"),
    [
        ("bend", False),
        ("position", False),
        pytest.param("bend", True, marks=pytest.mark.slow),
        pytest.param("position", True, marks=pytest.mark.slow),
    ],
)
def test_1000_random_reachable_targets_are_reached_without_co_contraction(
    shipped: Rod, kind: str, ends: bool
) -> None:
    """At least 99.5 % to 0.1 mm. Where two chambers can meet a target exactly, Gauss and Newton get closer.

    A bend they can, and a position where the base does not turn: with one that turns by all three pressures,
    two may miss what three have made by more than that.
    """
    rod = shipped if ends else without_ends(shipped)
    pressures = inside(rod.domain, TARGETS)
    wanted = jax.jit(jax.vmap(rod.solve))(pressures)

    def one(target: tuple[jax.Array, jax.Array, jax.Array]) -> Inverse:
        angle, plane, position = target
        if kind == "bend":
            return rod.inverse(angle, plane, throw=False)
        return rod.inverse(tip_position=position, throw=False)

    targets = wanted.bending_angle, wanted.bending_plane, wanted.tip_position
    found = jax.jit(lambda targets: jax.lax.map(one, targets))(targets)
    assert np.mean(found.reached) >= 0.995
    if kind == "bend":
        # Other pressures may make the same bend with another twist, which moves the tip a little.
        length = rod.actuator.body_length
        tips = [length * s.bending_angle * jnp.exp(1j * s.bending_plane) for s in (found.solution, wanted)]
    else:
        tips = [s.tip_position.T for s in (found.solution, wanted)]
    misses = np.linalg.norm(np.atleast_2d(tips[0] - tips[1]), axis=0)
    assert np.mean(misses <= 1e-4) >= 0.995
    assert np.all(found.solution.in_domain)
    if kind == "bend" or not ends:
        assert np.median(found.distance) < 1e-8
        assert np.mean(np.min(found.pressure, axis=1) == 0.0) >= 0.995


def test_a_target_out_of_reach_says_so_and_gets_the_nearest(rod: Rod, to_position: object) -> None:
    """Against 40 000 samples of the domain, which lie less than 0.3 mm from each other in the tip's place."""
    pressures = inside(rod.domain, 2000)
    grids = []
    for chamber in range(3):
        face = np.array(list(itertools.product(np.linspace(0.0, 1.0, 120), repeat=2)))
        grids.append(np.insert(face, chamber, 0.0, axis=1) * np.array(rod.domain.pressure_max))
    dense = np.concatenate([pressures, *grids])
    dense = dense[dense.sum(axis=1) <= rod.domain.pressure_sum_max]
    tips = np.array(jax.jit(jax.vmap(lambda p: rod.solve(p, throw=False).tip_position))(dense))
    for target in ([0.0, 0.0, 0.08], [-0.05, 0.02, 0.06], [0.01, 0.05, 0.01], [0.03, -0.03, -0.02]):
        found = to_position(rod, jnp.array(target))
        nearest = np.min(np.linalg.norm(tips - np.array(target), axis=1))
        assert not found.reached
        assert found.converged
        assert found.solution.in_domain
        assert 1e-3 < found.distance < nearest + 1e-9
        assert found.distance > nearest - 3e-4
        np.testing.assert_allclose(
            np.linalg.norm(found.solution.tip_position - np.array(target)), found.distance, rtol=1e-9
        )


def test_an_angle_out_of_reach_ends_on_the_bound(rod: Rod) -> None:
    found = rod.inverse(bending_angle=6.0, bending_plane=0.0)
    assert not found.reached
    assert rod.domain.covers_pressure(found.pressure)
    alone = rod.solve([70e3, 0.0, 0.0])
    assert found.solution.bending_angle >= alone.bending_angle - 1e-6


@pytest.mark.parametrize("plane", np.linspace(0.0, 2.0 * np.pi, 13))
def test_planes_all_round_are_met(rod: Rod, plane: float) -> None:
    found = rod.inverse(bending_angle=0.7, bending_plane=plane)
    assert found.reached
    assert found.converged
    np.testing.assert_allclose(found.solution.bending_angle, 0.7, atol=1e-3)
    np.testing.assert_allclose(np.cos(found.solution.bending_plane - plane), 1.0, atol=1e-5)
    assert np.min(found.pressure) == 0.0


def test_a_straight_rod_takes_no_pressure(rod: Rod) -> None:
    for found in (rod.inverse(0.0, 1.0), rod.inverse(tip_position=[0.0, 0.0, 0.066])):
        assert found.reached
        assert np.all(np.asarray(found.pressure) < 500.0)


@pytest.mark.slow
def test_loads_are_made_up_for(rod: Rod) -> None:
    """The pressures that hold a rod's tip in its place when gravity and a force come upon it."""
    force = np.array([0.002, -0.003, 0.001])
    wanted = rod.solve([30e3, 12e3, 0.0], tip_force=force, gravity=GRAVITY)
    found = rod.inverse(tip_position=wanted.tip_position, tip_force=force, gravity=GRAVITY)
    assert found.reached
    solution = rod.solve(found.pressure, tip_force=force, gravity=GRAVITY)
    assert np.linalg.norm(solution.tip_position - wanted.tip_position) <= 1e-4
    without = rod.solve(found.pressure)
    assert np.linalg.norm(without.tip_position - wanted.tip_position) > 1e-3


def test_a_bad_row_of_a_batch_leaves_its_neighbours_alone(rod: Rod, to_position: object) -> None:
    tip = np.asarray(rod.solve([30e3, 5e3, 0.0]).tip_position)
    targets = jnp.array([tip, [np.nan, 0.0, 0.0], [0.0, 0.0, 0.3], tip * np.array([1.0, -1.0, 1.0])])
    batch = jax.jit(jax.vmap(lambda target: rod.inverse(tip_position=target, throw=False)))(targets)
    np.testing.assert_array_equal(batch.reached, [True, False, False, True])
    np.testing.assert_array_equal(batch.converged, [True, False, True, True])
    assert np.all(np.isnan(batch.pressure[1]))
    for row in (0, 2, 3):
        alone = to_position(rod, targets[row])
        np.testing.assert_allclose(batch.pressure[row], alone.pressure, rtol=1e-6, atol=1e-3)


@pytest.mark.parametrize(
    "target",
    [
        {},
        {"bending_angle": 1.0},
        {"bending_plane": 1.0},
        {"bending_angle": 1.0, "tip_position": [0.0, 0.0, 0.06]},
        {"bending_angle": 1.0, "bending_plane": 1.0, "tip_position": [0.0, 0.0, 0.06]},
    ],
)
def test_one_whole_target_is_asked_for(rod: Rod, target: dict[str, object]) -> None:
    with pytest.raises(ValueError, match="expected bending_angle and bending_plane, or tip_position alone"):
        rod.inverse(**target)


def test_a_target_of_another_shape_is_refused(rod: Rod) -> None:
    with pytest.raises(ValueError, match=r"tip_position: got shape \(2,\), expected \(3,\): three coord"):
        rod.inverse(tip_position=[0.0, 0.0])
    with pytest.raises(ValueError, match=r"bending_angle: got shape \(3,\), expected \(\): one angle"):
        rod.inverse([0.0, 0.0, 1.0], 0.0)


@pytest.mark.parametrize(("angle", "plane"), [(-0.1, 0.0), (np.nan, 0.0), (0.1, np.inf)])
def test_bad_values_raise_or_are_flagged(rod: Rod, angle: float, plane: float) -> None:
    with pytest.raises(RuntimeError, match="not finite, or a negative angle"):
        rod.inverse(angle, plane)
    flagged = rod.inverse(angle, plane, throw=False)
    assert not flagged.reached
    assert not flagged.converged
    assert np.all(np.isnan(flagged.pressure))


def test_each_step_is_the_minimum_of_the_model_over_the_domain(rod: Rod) -> None:
    """Against SciPy's trust-region solver on random quadratics, in all four boxes."""
    rng = np.random.default_rng(1)
    boxes = boxes_of(rod.domain)
    for kind in range(4):
        box = jax.tree.map(lambda leaf, kind=kind: leaf[kind], boxes)
        for _ in range(8):
            root = rng.normal(size=(3, 3))
            curvature, gradient = root @ root.T + 0.1 * np.eye(3), 3.0 * rng.normal(size=3)
            point = 0.2 * np.asarray(box.upper)
            found = np.asarray(_minimum(jnp.array(curvature), jnp.array(gradient), jnp.array(point), box))

            def model(x: np.ndarray, H=curvature, g=gradient, at=point) -> float:
                return float(g @ (x - at) + 0.5 * (x - at) @ H @ (x - at))

            best = minimize(
                model,
                point,
                method="SLSQP",
                bounds=[(0.0, u) for u in np.asarray(box.upper)],
                constraints=LinearConstraint(np.ones(3), -np.inf, float(box.total)),
                options={"ftol": 1e-14},
            )
            assert np.all(found >= 0.0)
            assert np.all(found <= np.asarray(box.upper))
            assert found.sum() <= float(box.total) * (1.0 + 1e-12)
            assert model(found) <= best.fun + 1e-10
            np.testing.assert_allclose(found, best.x, atol=1e-5)
