"""A base that turns with the pressures and a cap that lies aside: poses, loads, derivatives."""

from dataclasses import replace

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from rodmodel import Adaptive, FixedStep, Rod
from rodmodel.statics import base_turn
from tests.unit.rodmodel import synthetic

# JAX compiles each of these rods; `test_core_against_reference.py` holds the C core to be the same.
pytestmark = pytest.mark.slow

TURN, LAG = 1.5e-6, 3e-3  # [rad/Pa], [m]
STIFFNESS, GROWTH = 3e-4, 0.6  # [N m²], none
OFFSET, CURVATURE, DRAW = 2.5e-3, 8.0, 0.8e-6  # [m], [1/m], [m³]
STIFF = {"stiff_tip": 2e-3}
PRESSURE = jnp.array([30e3, 10e3, 2e3])
FORCE = jnp.array([0.01, 0.02, -0.01])
GRAVITY = jnp.array([3.0, 0.0, -9.0])
MOMENT = jnp.array([0.0, 2e-4, 1e-4])


def rod_with(**ends: float) -> Rod:
    return Rod(synthetic.bending_law(), replace(synthetic.ACTUATOR, **STIFF, **ends), synthetic.DOMAIN, 0.01)


def turned() -> Rod:
    return rod_with(base_turn=TURN, base_lag=LAG)


def softened() -> Rod:
    return rod_with(base_turn=TURN, base_lag=LAG, base_stiffness=STIFFNESS)


def aside() -> Rod:
    return rod_with(tip_offset=OFFSET, tip_offset_curvature=CURVATURE)


def both() -> Rod:
    return rod_with(
        base_turn=TURN,
        base_lag=LAG,
        base_stiffness=STIFFNESS,
        base_growth=GROWTH,
        tip_offset=OFFSET,
        tip_offset_curvature=CURVATURE,
        tip_draw=DRAW,
    )


# Each way by itself is compiled for half a minute a test; both at once hold what either does.
EACH = [pytest.param(make, marks=pytest.mark.slow) for make in (softened, aside)] + [pytest.param(both)]


LOADS = {"tip_force": FORCE, "gravity": GRAVITY, "tip_moment": MOMENT}


@pytest.mark.parametrize("loads", [{}, LOADS])
def test_a_turned_base_is_a_base_rotation(loads) -> None:
    """About the axes that the chambers bend the rod about; to rounding."""
    azimuths = 2.0 * np.pi / 3.0 * np.arange(3)
    axes = np.stack([np.sin(azimuths), -np.cos(azimuths), 0.0 * azimuths], axis=1)
    ours = turned().solve(PRESSURE, **loads)
    free = np.asarray(turned().solve(PRESSURE).curvature(0.03))
    vector = TURN * np.asarray(PRESSURE) @ axes - LAG * free * [1.0, 1.0, 0.0]
    turn = Rotation.from_rotvec(vector).as_matrix()
    plain = rod_with().solve(PRESSURE, base_rotation=turn, **loads)
    # Under loads, pressures that turn the base do work: it is in the volumes (`test_core_balances.py`).
    names = ("tip_position", "tip_rotation") if loads else ("tip_position", "tip_rotation", "chamber_volume")
    for name in names:
        np.testing.assert_allclose(getattr(ours, name), getattr(plain, name), rtol=1e-9, atol=1e-11)
    s = jnp.linspace(0.0, 0.066, 9)
    np.testing.assert_allclose(ours.centreline(s), plain.centreline(s), atol=1e-11)
    np.testing.assert_allclose(ours.frames(s), plain.frames(s), atol=1e-9)
    # θ is that of the tip from the clamp's axis, not from the first section's.
    cosine = float(ours.tip_rotation[2, 2])
    np.testing.assert_allclose(np.cos(ours.bending_angle), cosine, atol=1e-12)


def test_a_softer_section_turns_more() -> None:
    """By the section's own compliance at the free curvature, about the axes across the rod."""
    rod = softened()
    free = rod.section.free_curvature(PRESSURE)
    stiffness = np.asarray(rod.section.stiffness(free, PRESSURE))
    plain = np.asarray(base_turn(turned().actuator, PRESSURE, rod.section.at(PRESSURE)))
    found = base_turn(rod.actuator, PRESSURE, rod.section.at(PRESSURE))
    expected = STIFFNESS * np.linalg.solve(stiffness, plain) * [1.0, 1.0, 0.0]
    np.testing.assert_allclose(found, expected, rtol=1e-12, atol=1e-15)
    assert np.linalg.norm(expected - plain) > 0.05 * np.linalg.norm(plain)


def test_a_softer_section_feels_the_base_farther() -> None:
    """S (1 + g (S − 1)) with S of the axes across: that of one that does not grow, and a share of S²."""
    rod = rod_with(base_turn=TURN, base_lag=LAG, base_stiffness=STIFFNESS, base_growth=GROWTH)
    free = rod.section.free_curvature(PRESSURE)
    softness = STIFFNESS * np.linalg.inv(np.asarray(rod.section.stiffness(free, PRESSURE)))[:2, :2]
    plain = np.asarray(base_turn(turned().actuator, PRESSURE, rod.section.at(PRESSURE)))[:2]
    found = base_turn(rod.actuator, PRESSURE, rod.section.at(PRESSURE))
    once = softness @ plain
    expected = (1.0 - GROWTH) * once + GROWTH * softness @ once
    np.testing.assert_allclose(found, [*expected, 0.0], rtol=1e-12, atol=1e-15)
    assert np.linalg.norm(expected - once) > 0.05 * np.linalg.norm(once)


def test_it_turns_the_way_that_the_chamber_bends_it() -> None:
    for k in range(3):
        pressure = 20e3 * jnp.eye(3)[k]
        more, plain = turned().solve(pressure), rod_with().solve(pressure)
        lag = LAG * np.linalg.norm(plain.curvature(0.03)[:2])
        np.testing.assert_allclose(more.bending_angle - plain.bending_angle, 20e3 * TURN - lag, atol=1e-3)


def test_the_cap_lies_away_from_the_bend() -> None:
    """Without loads the body is as it was; the cap goes aside by a κ/(κ₀² + κ²)^½ in its own plane."""
    ours, plain = aside().solve(PRESSURE), rod_with().solve(PRESSURE)
    np.testing.assert_allclose(ours.tip_rotation, plain.tip_rotation, atol=1e-15)
    away = np.asarray(ours.tip_rotation).T @ np.asarray(ours.tip_position - plain.tip_position)
    free = np.asarray(plain.curvature(0.03))
    size = np.hypot(*free[:2])
    np.testing.assert_allclose(np.linalg.norm(away), OFFSET * size / np.hypot(CURVATURE, size), rtol=1e-9)
    assert away[2] == pytest.approx(0.0, abs=1e-12)
    # The bend goes along u × e₃.
    assert away @ np.cross(free, [0.0, 0.0, 1.0]) < 0.0
    # The axis goes there over the whole body, as the beam does that bends least.
    s = jnp.array([0.0, 0.03, 0.0420])
    x = np.asarray(s) / ours.shape.length
    aside_by = (x**2 * (3.0 - 2.0 * x))[:, None] * (np.asarray(plain.frames(s)) @ away)
    np.testing.assert_allclose(ours.centreline(s), plain.centreline(s) + aside_by, atol=1e-15)
    np.testing.assert_allclose(ours.centreline(0.066), ours.tip_position, atol=1e-12)


def test_the_cap_is_drawn_in_as_the_square_of_the_bend() -> None:
    ours, plain = rod_with(tip_draw=DRAW).solve(PRESSURE), rod_with().solve(PRESSURE)
    moved = np.asarray(ours.tip_rotation).T @ np.asarray(ours.tip_position - plain.tip_position)
    bend = float(np.sum(np.asarray(plain.curvature(0.03))[:2] ** 2))
    np.testing.assert_allclose(moved, [0.0, 0.0, -DRAW * bend], atol=1e-14)
    assert DRAW * bend > 1e-4
    np.testing.assert_allclose(ours.centreline(0.066), ours.tip_position, atol=1e-12)


def test_an_axis_that_goes_aside_has_no_kink() -> None:
    """Distances between close points are those along the rod, but for the tangent of the way aside."""
    s = np.linspace(0.0, 0.066, 1321)
    loads = {"tip_force": FORCE, "gravity": 0.0 * GRAVITY, "solver": FixedStep(16)}
    line = np.asarray(aside().solve(PRESSURE, **loads).centreline(s))
    steps = np.linalg.norm(np.diff(line, axis=0), axis=1) / np.diff(s)
    # The way aside is 2.4 mm on the 58 mm that bend, by a smooth step with a slope of up to 1.5 times that;
    # and the frames that carry it turn, by less than 40 rad/m.
    assert np.all(np.abs(steps - 1.0) < 1.5 * 2.4 / 57.0 + 40.0 * 2.4e-3)


def test_chambers_held_at_the_ends_change_their_volume_by_so_much_less() -> None:
    held, free = rod_with(held_length=4.5e-3), rod_with()
    rest = free.solve(jnp.zeros(3)).chamber_volume
    np.testing.assert_allclose(held.solve(jnp.zeros(3)).chamber_volume, rest, rtol=1e-12)
    change = free.solve(PRESSURE).chamber_volume - rest
    found = held.solve(PRESSURE)
    length = held.actuator.body_length
    np.testing.assert_allclose(found.chamber_volume, rest + (1.0 - 4.5e-3 / length) * change, rtol=1e-12)
    np.testing.assert_allclose(found.tip_position, free.solve(PRESSURE).tip_position, atol=1e-16)


@pytest.mark.parametrize("make", EACH)
def test_the_compliance_is_symmetric_and_that_of_differences(make) -> None:
    """An energy stands behind it: a force on a cap aside turns the body by its moment about its end."""
    rod = make()
    _, jacobian = rod.jacobian(PRESSURE, FORCE, gravity=GRAVITY, arc_lengths=[0.055])
    compliance = np.asarray(jacobian.tip_force.tip_position)
    np.testing.assert_allclose(compliance, compliance.T, atol=1e-6 * np.abs(compliance).max())
    solve = jax.jit(lambda p, f: rod.solve(p, f, gravity=GRAVITY, solver=FixedStep(64), throw=False))
    for step, at, derivative in (
        (70.0, lambda e: solve(PRESSURE + e, FORCE), jacobian.pressure),
        (1e-4, lambda e: solve(PRESSURE, FORCE + e), jacobian.tip_force),
    ):
        for name, of in (
            ("tip_position", lambda s: s.tip_position),
            ("positions", lambda s: s.centreline(0.055)),
        ):
            columns = []
            for e in step * np.eye(3):
                near, far = of(at(e)) - of(at(-e)), of(at(2 * e)) - of(at(-2 * e))
                columns.append((8 * near - far) / (12 * step))
            found = np.asarray(getattr(derivative, name)).reshape(3, 3)
            # Differences of order four; the adaptive solver's own derivatives are exact to 1e-6.
            np.testing.assert_allclose(found, np.transpose(columns), atol=2e-6 * np.abs(columns).max())


def test_a_follower_force_on_a_cap_aside_is_a_dead_one_along_it() -> None:
    rod = both()
    followed = rod.solve(PRESSURE, follower_force=FORCE)
    dead = rod.solve(PRESSURE, tip_force=np.asarray(followed.tip_rotation) @ FORCE)
    np.testing.assert_allclose(followed.tip_position, dead.tip_position, atol=1e-10)


def test_derivatives_under_a_follower_force_on_a_cap_aside_are_those_of_differences() -> None:
    rod = both()
    _, jacobian = rod.jacobian(PRESSURE, follower_force=FORCE)
    solve = jax.jit(
        lambda p: rod.solve(p, follower_force=FORCE, solver=FixedStep(64), throw=False).tip_position
    )
    columns = [(solve(PRESSURE + e) - solve(PRESSURE - e)) / 100.0 for e in 50.0 * np.eye(3)]
    scale = np.abs(columns).max()
    np.testing.assert_allclose(jacobian.pressure.tip_position, np.transpose(columns), atol=1e-5 * scale)


@pytest.mark.parametrize("make", EACH)
def test_the_predictor_agrees_with_its_jacobian(make) -> None:
    rod = make()
    loads = {"tip_force": FORCE, "gravity": GRAVITY}
    predict = rod.predictor(loads=tuple(loads), solver=FixedStep(16))
    expected = rod.solve(PRESSURE, solver=FixedStep(16), **loads)
    found, derivatives = predict.jacobian(PRESSURE, **loads)
    np.testing.assert_allclose(found.tip_position, expected.tip_position, atol=1e-9)
    np.testing.assert_allclose(found.tip_rotation, expected.tip_rotation, atol=1e-7)
    np.testing.assert_allclose(found.bending_angle, expected.bending_angle, atol=1e-7)
    np.testing.assert_allclose(found.bending_plane, expected.bending_plane, atol=1e-7)
    _, jacobian = rod.jacobian(PRESSURE, solver=FixedStep(16), **loads)
    for ours, theirs in (
        (derivatives.position_by_pressure, jacobian.pressure.tip_position),
        (derivatives.position_by_force, jacobian.tip_force.tip_position),
        (derivatives.turn_by_pressure, jacobian.pressure.tip_turn),
    ):
        np.testing.assert_allclose(ours, theirs, atol=1e-4 * np.abs(theirs).max())


@pytest.mark.parametrize("solver", [FixedStep(16), pytest.param(Adaptive(), marks=pytest.mark.slow)])
def test_a_straight_rod_has_finite_derivatives(solver) -> None:
    _, jacobian = both().jacobian(jnp.zeros(3), solver=solver)
    assert np.all(np.isfinite(jacobian.pressure.tip_position))
