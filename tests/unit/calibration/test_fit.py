"""The loss means what it says, its slope is right, and minimising it calibrates the law."""

from dataclasses import replace

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from jax.flatten_util import ravel_pytree
from manufactured_cell import potential

from calibration.error import figures
from calibration.expansion import derivatives
from calibration.fit import choose_size, mean_square, minimise
from calibration.pipeline import fit_and_judge
from calibration.samples import metric
from calibration.start import Scales, initial_law
from rodmodel import Domain

LENGTH = 0.06
MOMENT_MAX = 2e-3


@pytest.fixture(autouse=True)
def short_trials(monkeypatch):
    """One start, tried for no longer than a test needs."""
    monkeypatch.setattr("calibration.fit.STARTS", 1)
    monkeypatch.setattr("calibration.fit.TRIAL_ITERATIONS", 5)


@pytest.fixture(scope="module")
def some(samples):
    return samples.where(np.arange(len(samples)) % 20 == 0)


def scales_of(samples):
    return metric(samples, LENGTH, 3e3, MOMENT_MAX / 3)


def loss_of(law, samples, derive=derivatives):
    return float(jax.jit(lambda: mean_square(law, samples, scales_of(samples), derive))())


def law_of(samples, mirror=True):
    return initial_law(samples, Scales.of(samples, MOMENT_MAX), hidden=6, seed=0, mirror=mirror)


def exact(law, curvature, pressure):
    """The manufactured potential in place of a law's, off by a moment of 1e-5 N m about e2."""
    del law

    def of_y(y):
        return potential(y[:3], y[3:]) + 1e-5 * y[1]

    y = jnp.concatenate([curvature, pressure], axis=1)
    return jax.vmap(of_y)(y), jax.vmap(jax.grad(of_y))(y), jax.vmap(jax.hessian(of_y))(y)


def test_a_moment_error_counts_as_the_bending_angle_it_causes(some):
    # All states are stiffer than a quarter of the median, so that no compliance is capped.
    angle = np.rad2deg(LENGTH) * np.linalg.solve(some.hessian[:, :3, :3], [[0.0], [1e-5], [0.0]])[..., 0]
    assert loss_of(law_of(some), some, exact) == pytest.approx(np.mean(np.sum(angle**2, axis=1)), rel=1e-9)


def test_the_slope_of_the_loss_is_that_of_its_differences(some):
    scales = scales_of(some)
    start, unravel = ravel_pytree(law_of(some))

    @jax.jit
    def loss(x):
        return mean_square(unravel(x), some, scales)

    direction = jnp.asarray(np.random.default_rng(3).standard_normal(start.size))
    direction = direction / jnp.linalg.norm(direction)
    slope = float(jax.grad(loss)(start) @ direction)
    # Central differences: error h² f‴/6 + ε f/h; Richardson from two steps leaves h⁴.
    h = 1e-3
    coarse, fine = (
        float(loss(start + s * direction) - loss(start - s * direction)) / (2 * s) for s in (h, h / 2)
    )
    extrapolated = (4 * fine - coarse) / 3
    assert slope == pytest.approx(
        extrapolated, abs=2 * abs(fine - coarse) ** 2 / abs(slope) + 1e-8 * abs(slope)
    )


def test_mirror_images_of_the_states_would_change_nothing(some):
    law = law_of(some)
    sign, swap = np.array([-1.0, 1.0, -1.0]), [0, 2, 1]
    signs = np.concatenate([sign, np.ones(3)])
    order = [0, 1, 2, 3, 5, 4]
    image = replace(
        some,
        pressure=some.pressure[:, swap],
        curvature=some.curvature * sign,
        gradient=(some.gradient * signs)[:, order],
        hessian=(some.hessian * np.outer(signs, signs))[:, order][:, :, order],
    )
    assert loss_of(law, image) == pytest.approx(loss_of(law, some), rel=1e-10)


def test_the_minimiser_lowers_the_loss_and_tells_of_each_iteration(some):
    told = []
    law = law_of(some)
    found = minimise(law, some, scales_of(some), 60, watch=lambda n, loss: told.append((n, loss)))
    assert found.regular
    assert [n for n, _ in told] == list(range(1, found.iterations + 1))
    assert told[-1][1] == pytest.approx(found.loss)
    assert found.loss < 0.2 * loss_of(law, some)


def test_the_size_is_the_smallest_that_does_about_as_well_as_the_best(samples, monkeypatch):
    monkeypatch.setattr("calibration.fit.TRIAL_ITERATIONS", 40)
    train = samples.where(~samples.held_out & (np.arange(len(samples)) % 4 == 0))
    scales = Scales.of(train, MOMENT_MAX)
    hidden, trials = choose_size(
        train,
        scales_of,
        lambda size, seed: initial_law(train, scales, size, seed, mirror=True),
        sizes=(2, 8, 9),
    )
    assert [trial.hidden for trial in trials] == [2, 8, 9]
    best = min(trial.validation for trial in trials)
    enough = [trial.hidden for trial in trials if trial.validation <= 1.1**2 * best]
    assert hidden == enough[0]


def test_a_fit_predicts_held_out_states_far_better_than_their_range(dataset):
    # 40 paths and a small network for a short while; the real calibration has more of each.
    domain = Domain((70e3, 50e3, 50e3), 100e3, MOMENT_MAX)
    outcome = fit_and_judge(dataset, domain, LENGTH, hidden=12, iterations=400, seed=0)
    assert outcome.good, outcome.complaint
    angle, volume = outcome.error["free_bending_angle_rad"], outcome.error["volume_m2"]
    assert angle["p95"] < 0.02 * angle["range"]
    assert volume["p95"] < 0.02 * volume["range"]
    assert outcome.training["hidden"] == 12
    # The law is flat at rest and its own mirror image, whatever it was fitted to.
    assert np.all(np.asarray(outcome.law.free_curvature(jnp.zeros(3))) == 0.0)


def test_held_out_states_do_not_train(dataset):
    domain = Domain((70e3, 50e3, 50e3), 100e3, MOMENT_MAX)
    held_out = np.flatnonzero(dataset["role"].values == "held-out")
    spoilt = dataset.copy(deep=True)
    spoilt["curvature"].values[held_out] += 1.0
    settings = {"domain": domain, "length": LENGTH, "hidden": 3, "iterations": 5, "seed": 0}
    first, second = (fit_and_judge(data, **settings) for data in (dataset, spoilt))
    assert all(np.array_equal(a, b) for a, b in zip(first.law.weights, second.law.weights, strict=True))
    assert first.error != second.error


def test_figures_of_a_fit_can_be_found_again(dataset, samples):
    domain = Domain((70e3, 50e3, 50e3), 100e3, MOMENT_MAX)
    outcome = fit_and_judge(dataset, domain, LENGTH, hidden=3, iterations=30, seed=0)
    assert figures(outcome.law, samples.where(samples.held_out), LENGTH) == outcome.error
