"""The candidates of the comparison are potentials of the kind they claim to be."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from calibration.fit import Samples, Scales, fit
from calibration.fit.levenberg_marquardt import mean_square
from calibration.fit.samples import metric
from calibration.studies.other_laws import fit_polynomial, network_law

SCALES = Scales(pressure=3e4, curvature=15.0, energy=0.05, rest_volume=15e-6)


def quartic(y):
    """A mirror-symmetric polynomial of degree 4, without a linear term in u."""
    u, q = y[:3] / SCALES.curvature, y[3:] / SCALES.pressure
    bend = 0.5 * (u[0] ** 2 + u[1] ** 2 + 0.8 * u[2] ** 2) + 0.1 * u[1] ** 3 + 0.05 * u[0] ** 4
    pressed = (
        u[1] * (q[0] - 0.5 * (q[1] + q[2])) + 0.866 * u[0] * (q[2] - q[1]) + 0.1 * u[2] * q[0] * (q[1] - q[2])
    )
    inflated = -0.3 * jnp.sum(q) - 0.05 * jnp.sum(q**2) - 0.01 * q[1] * q[2] * u[1] ** 2
    return SCALES.energy * (bend + pressed + inflated)


@pytest.fixture(scope="module")
def states():
    rng = np.random.default_rng(0)
    n = 150
    y = np.concatenate([20 * rng.standard_normal((n, 3)), 5e4 * rng.random((n, 3))], axis=1)
    value, gradient, hessian = (
        np.asarray(jax.jit(jax.vmap(f))(y)) for f in (quartic, jax.grad(quartic), jax.hessian(quartic))
    )
    return Samples(
        y[:, 3:], y[:, :3], value, gradient, hessian, np.zeros(n), np.full(n, "a"), np.zeros(n, dtype=bool)
    )


def derivatives_at(law, states):
    def potential(y):
        return law.potential(y[:3], y[3:])

    y = np.concatenate([states.curvature, states.pressure], axis=1)
    return [jax.jit(jax.vmap(f))(y) for f in (potential, jax.grad(potential), jax.hessian(potential))]


@pytest.fixture(scope="module")
def polynomial(states):
    return fit_polynomial(states, metric(states, 0.06, 3e3, 7e-4), SCALES, 4)


def test_least_squares_finds_a_polynomial_of_its_own_degree_exactly(states, polynomial):
    assert_exact(polynomial, states)


# One degree more is compiled for as long again.
@pytest.mark.slow
def test_least_squares_finds_a_polynomial_of_a_lower_degree_exactly(states):
    assert_exact(fit_polynomial(states, metric(states, 0.06, 3e3, 7e-4), SCALES, 5), states)


def assert_exact(law, states):
    for found, exact in zip(
        derivatives_at(law, states), (states.energy, states.gradient, states.hessian), strict=True
    ):
        # Least squares by QR: errors of ε times the condition of the scaled problem, at most some 1e5.
        assert np.abs(found - exact).max(axis=0) == pytest.approx(0.0, abs=1e-10 * np.abs(exact).max())


def test_a_polynomial_of_lower_degree_is_not_exact(states):
    law = fit_polynomial(states, metric(states, 0.06, 3e3, 7e-4), SCALES, 3)
    _, gradient, _ = derivatives_at(law, states)
    assert np.abs(gradient[:, :3] - states.moment).max() > 1e-2 * np.abs(states.moment).max()


@pytest.fixture(scope="module", params=["polynomial", "network"])
def law(request, polynomial):
    return polynomial if request.param == "polynomial" else network_law(SCALES, seed=0)


def test_candidates_are_flat_at_rest(law):
    rest = jnp.zeros(3)
    size = SCALES.energy / SCALES.curvature
    assert float(law.potential(rest, rest)) == pytest.approx(0.0, abs=1e-15)
    assert np.asarray(law.moment(rest, rest)) == pytest.approx(0.0, abs=1e-14 * size)


def test_candidates_are_their_own_mirror_image(law, states):
    u, p = jnp.asarray(states.curvature), jnp.asarray(states.pressure)
    potential = jax.jit(jax.vmap(law.potential))
    here = potential(u, p)
    there = potential(u * jnp.array([-1.0, 1.0, -1.0]), p[:, jnp.array([0, 2, 1])])
    assert np.asarray(there) == pytest.approx(np.asarray(here), rel=1e-11, abs=1e-13)


def test_the_free_curvature_is_a_root_of_the_moment(law):
    pressure = jnp.array([5e3, 2e3, 0.0])
    free = law.free_curvature(pressure)
    scale = float(jnp.linalg.norm(law.stiffness(free, pressure)))  # an untrained network may soften
    # Newton stops when its step is below 1e-8 of the curvature, of a few 1/m.
    assert np.abs(law.moment(free, pressure)).max() < 1e-7 * scale


@pytest.mark.slow
def test_the_network_trains_on_the_same_residuals(states):
    scales = metric(states, 0.06, 3e3, 7e-4)
    before = network_law(SCALES, seed=0, hidden=8)
    after = fit(before, states, scales, 20)
    assert after.loss == pytest.approx(mean_square(after.law, states, scales), rel=1e-10)
    assert after.loss < 0.1 * mean_square(before, states, scales)
