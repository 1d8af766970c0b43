"""Shapes between their nodes: exact for an arc, of order 4 for a curve."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.integrate import solve_ivp

from rodmodel.kinematics import Arc, Stepped, cross_matrix

LENGTH = 0.06
LEAN = np.array([0.02, -0.01, 0.0])
AHEAD = np.array([0.02, -0.01, 1.0])  # Rᵀ r'


def curvature(s: np.ndarray) -> np.ndarray:
    """A smooth curve of a rod that twists [1/m]."""
    x = np.asarray(s) / LENGTH
    return np.stack([20.0 * np.cos(2.0 * x), -30.0 + 15.0 * x**2, 8.0 * np.sin(3.0 * x)], axis=-1)


def slope(s: np.ndarray) -> np.ndarray:
    x = np.asarray(s) / LENGTH
    return np.stack([-40.0 * np.sin(2.0 * x), 30.0 * x, 24.0 * np.cos(3.0 * x)], axis=-1) / LENGTH


def exact(s: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Position and frame, by another integrator; r' = R (e₃ + lean)"""

    def rate(s: float, y: np.ndarray) -> np.ndarray:
        R = y[3:].reshape(3, 3)
        turned = R @ np.asarray(cross_matrix(jnp.asarray(curvature(s))))
        return np.concatenate([R @ AHEAD, turned.ravel()])

    start = np.concatenate([np.zeros(3), np.eye(3).ravel()])
    y = solve_ivp(rate, (0.0, LENGTH), start, "DOP853", s, rtol=1e-11, atol=1e-13).y.T
    return y[:, :3], y[:, 3:].reshape(-1, 3, 3)


def stepped(steps: int) -> Stepped:
    s = np.linspace(0.0, LENGTH, steps + 1)
    positions, rotations = exact(s)
    parts = (positions, rotations, curvature(s), slope(s), rotations @ LEAN)
    return Stepped(*map(jnp.asarray, parts), LENGTH)


def test_between_the_nodes_the_shape_is_of_order_4() -> None:
    """Pose and curvature; halved steps leave a sixteenth of the error, or less."""
    s = np.linspace(0.0, LENGTH, 41)
    positions, rotations = exact(s)
    errors = []
    for steps in (8, 16):
        shape = stepped(steps)
        r, R = jax.jit(jax.vmap(shape.pose))(jnp.asarray(s))
        u = jax.jit(jax.vmap(shape.curvature))(jnp.asarray(s))
        apart = (r - positions) / LENGTH, R - rotations, (u - curvature(s)) * LENGTH
        errors.append([np.abs(part).max() for part in apart])
    assert np.all(np.array(errors[0]) < 1e-4)
    assert np.all(np.array(errors[1]) < np.array(errors[0]) / 12.0)


def test_at_the_nodes_it_is_what_they_are() -> None:
    shape = stepped(5)
    nodes = jnp.linspace(0.0, LENGTH, 6)
    r, R = jax.vmap(shape.pose)(nodes)
    np.testing.assert_allclose(r, shape.positions, atol=1e-15)
    np.testing.assert_allclose(R, shape.rotations, atol=1e-14)
    np.testing.assert_allclose(jax.vmap(shape.curvature)(nodes), shape.node_curvatures, rtol=1e-12)


@pytest.mark.parametrize("steps", [1, 2, 7])
def test_nodes_of_an_arc_are_the_arc(steps: int) -> None:
    u = jnp.array([10.0, -40.0, 5.0])
    arc, s = Arc(u, LENGTH), jnp.linspace(0.0, LENGTH, steps + 1)
    positions, rotations = jax.vmap(arc.pose)(s)
    nothing, alike = jnp.zeros((steps + 1, 3)), jnp.broadcast_to(u, (steps + 1, 3))
    shape = Stepped(positions, rotations, alike, nothing, nothing, LENGTH)
    between = jnp.linspace(0.0, LENGTH, 10)
    for one, other in zip(jax.vmap(shape.pose)(between), jax.vmap(arc.pose)(between), strict=True):
        np.testing.assert_allclose(one, other, atol=1e-14)
    values, weights = shape.samples()
    np.testing.assert_allclose(weights @ values, LENGTH * u, rtol=1e-12)
