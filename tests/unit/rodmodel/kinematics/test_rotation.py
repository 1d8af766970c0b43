"""Screws against the matrix exponential."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.linalg import expm

from rodmodel.kinematics import cross_matrix, rotation_of, screw, turn_change


def exponential(curvature: np.ndarray, length: float) -> np.ndarray:
    """The screw as a 4 × 4 matrix exponential."""
    x, y, z = curvature
    generator = np.array([[0.0, -z, y, 0.0], [z, 0.0, -x, 0.0], [-y, x, 0.0, 1.0], [0.0, 0.0, 0.0, 0.0]])
    return expm(length * generator)


@pytest.mark.parametrize("size", [0.0, 1e-9, 1e-3, 0.999, 1.0, 1.001, 3.0, np.pi, 9.0])
def test_a_screw_is_the_matrix_exponential(size: float) -> None:
    direction = np.array([0.6, -0.64, 0.48])
    length = 0.06
    expected = exponential(size / length * direction, length)
    position, rotation = screw(jnp.array(size * direction), jnp.array([0.0, 0.0, length]))
    np.testing.assert_allclose(rotation, expected[:3, :3], atol=4e-15)
    np.testing.assert_allclose(position, expected[:3, 3], atol=4e-15 * length)


def test_a_screw_is_smooth_at_zero() -> None:
    """At u = 0, position changes by −s²/2 along y with u₁ and by s²/2 along x with u₂, rotation by s ê."""

    def along(u: jax.Array) -> tuple[jax.Array, jax.Array]:
        return screw(0.06 * u, jnp.array([0.0, 0.0, 0.06]))

    by_position, by_rotation = jax.jit(jax.jacfwd(along))(jnp.zeros(3))
    expected = 0.5 * 0.06**2 * np.array([[0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, 0.0]])
    np.testing.assert_allclose(by_position, expected, atol=1e-18)
    for k, e in enumerate(np.eye(3)):
        np.testing.assert_allclose(by_rotation[:, :, k], 0.06 * cross_matrix(jnp.array(e)), atol=1e-16)
    second = jax.jit(jax.hessian(lambda u: along(u)[0]))(jnp.zeros(3))
    assert np.all(np.isfinite(second))


def test_series_and_closed_form_meet() -> None:
    """Across the switch at one radian the derivative is as continuous as the function."""
    direction = jnp.array([0.6, -0.64, 0.48])
    below, above = (
        jax.jit(jax.jacfwd(lambda x: screw(x * direction, direction[::-1])))(jnp.array(1.0 + sign * 1e-12))
        for sign in (-1.0, 1.0)
    )
    for one, other in zip(below, above, strict=True):
        np.testing.assert_allclose(one, other, atol=1e-11)


def test_a_small_turn_of_a_rotation_is_found_again() -> None:
    """δR = ω̂ R, and what is symmetric in δR Rᵀ is left out."""
    R = rotation_of(jnp.array([0.7, -1.1, 0.4]))
    turn = jnp.array([0.3, 0.2, -0.5])
    np.testing.assert_allclose(turn_change(R, (cross_matrix(turn) + jnp.eye(3)) @ R), turn, atol=1e-15)


def test_the_cross_matrix_is_the_cross_product() -> None:
    v, w = jnp.array([1.0, -2.0, 3.0]), jnp.array([0.5, 4.0, -1.0])
    np.testing.assert_allclose(cross_matrix(v) @ w, np.cross(v, w), rtol=1e-15)
