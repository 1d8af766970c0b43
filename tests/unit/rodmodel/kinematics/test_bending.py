"""Bending angle and plane: the paper's definition, two-argument and continued."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from jaxtyping import Array

from rodmodel.kinematics import Arc, bend, bending

LENGTH = 0.06


@jax.jit
def arc_bending(curvature: Array) -> tuple[Array, Array]:
    positions, rotations = Arc(base_curvature=curvature, length=LENGTH).poses()
    return bending(rotations[:, :, 2], positions[-1])


def curvature(angle_deg: float, plane_deg: float) -> Array:
    """Curvature of an arc that bends by an angle away from an azimuth, as the chamber there would."""
    angle, plane = np.radians([angle_deg, plane_deg])
    return jnp.array([np.sin(plane), -np.cos(plane), 0.0]) * angle / LENGTH


@pytest.mark.parametrize("plane_deg", [0, 60, 120, 180, 240, 300, 359, 17.3])
@pytest.mark.parametrize("angle_deg", [1e-3, 5, 89, 90, 91, 179, 181, 200, 300, 359, 361, 500])
def test_an_arc_has_its_angle_and_plane(angle_deg: float, plane_deg: float) -> None:
    angle, plane = arc_bending(curvature(angle_deg, plane_deg))
    # The azimuth of a tangent that is a sine of the angle off the vertical: rounding over that sine.
    tolerance = 1e-13 / abs(np.sin(np.radians(angle_deg)))
    np.testing.assert_allclose(np.degrees(angle), angle_deg, atol=1e-11)
    np.testing.assert_allclose(np.degrees(plane), plane_deg, atol=np.degrees(tolerance))


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_rounding_off_the_plane_of_chamber_1_is_none_and_keeps_the_slope(sign: float) -> None:
    """Below zero it would be a whole turn; the slope of the azimuth −u₁/u₂ by u₁ is 1/20 on both sides."""
    plane = lambda off: arc_bending(jnp.array([0.0, -20.0, 0.0]).at[0].set(off))[1]  # noqa: E731
    off = sign * 1e-13
    assert 0.0 <= float(plane(off)) <= 1e-13
    assert float(jax.grad(plane)(off)) == pytest.approx(0.05, rel=1e-9)


def test_chambers_bend_towards_their_azimuths() -> None:
    """Chamber 1 alone has u₂ < 0 and plane 0; chamber 2 alone, 120° further round, plane 120°."""
    assert arc_bending(jnp.array([0.0, -20.0, 0.0]))[1] == 0.0
    np.testing.assert_allclose(
        np.degrees(arc_bending(20.0 * jnp.array([np.sqrt(0.75), 0.5, 0.0]))[1]), 120.0, atol=1e-11
    )


def test_a_straight_rod_has_no_angle_and_finite_derivatives() -> None:
    for k in (0, 1):
        value, slope = jax.value_and_grad(lambda u, k=k: arc_bending(u)[k])(jnp.zeros(3))
        assert value == 0.0
        np.testing.assert_array_equal(slope, 0.0)


def test_derivatives_are_those_of_an_arc() -> None:
    """For an arc θ = L |u| and γ = atan2(u₁, −u₂)."""
    for angle_deg in (30.0, 250.0):
        u = curvature(angle_deg, 75.0)
        by_angle, by_plane = (np.asarray(d) for d in jax.jacfwd(arc_bending)(u))
        size = float(jnp.linalg.norm(u))
        np.testing.assert_allclose(by_angle[:2], LENGTH * u[:2] / size, rtol=1e-12)
        np.testing.assert_allclose(by_plane[:2], [-u[1] / size**2, u[0] / size**2], rtol=1e-12)


def test_an_s_shape_has_a_positive_angle_to_the_side_of_its_tip() -> None:
    """A rod that leans to +x and turns back to −x at the tip: the tangent crosses +z, not −z."""
    slope = np.linspace(0.0, 2.0, 21)
    inclination = 0.8 * np.sin(np.pi * slope)
    tangents = np.stack([np.sin(inclination), np.zeros(21), np.cos(inclination)], axis=1)
    tangents = np.concatenate([tangents, [[np.sin(-0.3), 0.0, np.cos(-0.3)]]])
    angle, plane = bending(jnp.array(tangents), jnp.array([0.02, 0.0, 0.05]))
    np.testing.assert_allclose([angle, plane], [0.3, 0.0], atol=1e-14)


def test_the_plane_stays_below_a_whole_turn() -> None:
    """An azimuth a rounding below zero is zero, not 360°."""
    _, plane = bending(jnp.array([[0.0, 0.0, 1.0], [-0.6, 1e-18, 0.8]]), jnp.array([-1.0, 0.0, 1.0]))
    assert 0.0 <= plane < 1e-12


@jax.jit
def arc_bend(curvature: Array) -> Array:
    positions, rotations = Arc(base_curvature=curvature, length=LENGTH).poses()
    angle, _ = bending(rotations[:, :, 2], positions[-1])
    return bend(rotations[-1, :, 2], angle)


@pytest.mark.parametrize("angle_deg", [0.0, 1e-6, 1e-3, 5, 90, 179, 181, 300, 500])
def test_the_bend_is_angle_and_plane_in_one_vector(angle_deg: float) -> None:
    expected = np.radians(angle_deg) * np.array([np.cos(0.7), np.sin(0.7)])
    found = arc_bend(curvature(angle_deg, np.degrees(0.7)))
    # The azimuth errs by a rounding over the sine of the angle, and the bend by the angle times that.
    sine = max(abs(np.sin(np.radians(angle_deg))), 1e-3)
    np.testing.assert_allclose(found, expected, atol=1e-14 * (1.0 + np.radians(angle_deg) / sine))


def test_the_bend_is_smooth_where_the_rod_is_straight() -> None:
    """An untwisted arc's bend is L (−u₂, u₁), whatever its size; the series meets the closed form at 1e-4."""
    by_curvature = LENGTH * np.array([[0.0, -1.0], [1.0, 0.0]])
    slope = jax.jit(jax.jacfwd(arc_bend))
    for angle in (0.0, 0.99e-4, 1.01e-4):
        found = slope(curvature(np.degrees(angle), 40.0))
        np.testing.assert_allclose(found[:, :2], by_curvature, atol=2e-8 * LENGTH)


def test_a_tip_that_points_down_has_a_bend_of_its_angle() -> None:
    down = bend(jnp.array([0.0, 0.0, -1.0]), jnp.array(np.pi))
    np.testing.assert_array_equal(down, [np.pi, 0.0])
