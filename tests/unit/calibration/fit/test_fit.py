"""The loss means what it says, minimising it calibrates the law, and what is held out never trains."""

import itertools
from dataclasses import replace

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from jax.flatten_util import ravel_pytree
from manufactured_law import Manufactured

from calibration.fit import (
    Scales,
    begin_near,
    figures,
    fit,
    fit_and_judge,
    initial_law,
    initial_oriented,
    prepare,
)
from calibration.fit.distil_mean import mean_states
from calibration.fit.initial_law import with_guess
from calibration.fit.levenberg_marquardt import mean_square, trained_numbers
from calibration.fit.pipeline import (
    DIGITS,
    PRIOR,
    PRIOR_NEAR,
    PRIOR_NEAR_SEVERAL,
    metric_in,
    rounded,
    symmetry_of,
)
from calibration.fit.robust import robust_fit
from calibration.fit.samples import metric
from calibration.sweep import attributes, inside
from rodmodel import Domain, unfolded

LENGTH = 0.06
MOMENT_MAX = 2e-3
DOMAIN = Domain((70e3, 50e3, 50e3), 100e3, MOMENT_MAX)
SCALES = Scales.of(DOMAIN, LENGTH, 15.5e-6)


@pytest.fixture(autouse=True, scope="module")
def short_trials():
    """One start, tried for no longer than a test needs."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("calibration.fit.pipeline.STARTS", 1)
        patch.setattr("calibration.fit.pipeline.TRIAL_ITERATIONS", 2)
        yield


@pytest.fixture(scope="module")
def some(samples):
    return samples.where(np.arange(len(samples)) % 40 == 0)


def scales_of(samples):
    return metric(samples, LENGTH, 3e3, MOMENT_MAX / 3)


def loss_of(law, samples):
    return mean_square(law, samples, scales_of(samples))


def law_of(symmetry="mirror"):
    return initial_law(SCALES, ridges=6, features=5, seed=0, symmetry=symmetry)


def test_a_moment_error_counts_as_the_bending_angle_it_causes(some):
    # All states are stiffer than a quarter of the median, so that no compliance is capped.
    angle = np.rad2deg(LENGTH) * np.linalg.solve(some.hessian[:, :3, :3], [[0.0], [1e-5], [0.0]])[..., 0]
    law = Manufactured(jnp.array([0.0, 1e-5, 0.0]))
    assert loss_of(law, some) == pytest.approx(np.mean(np.sum(angle**2, axis=1)), rel=1e-9)


def test_a_law_that_is_right_has_no_loss_and_is_left_alone(some):
    """The states' Newton stops at 1e-14 N m, some 1e-8 degrees."""
    law = Manufactured(jnp.zeros(3))
    assert loss_of(law, some) <= 1e-14
    off = Manufactured(jnp.array([0.0, 1e-5, 0.0]))
    found = fit(off, some, scales_of(some), 40)
    # The residuals are linear in the offset: the damped steps go straight to the bottom.
    assert found.converged
    np.testing.assert_allclose(found.law.offset, 0.0, atol=1e-5 * 1e-3)


def test_mirror_images_of_the_states_would_change_nothing(some):
    law = law_of()
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
    law = law_of()
    found = fit(law, some, scales_of(some), 12, watch=lambda n, loss: told.append((n, loss)))
    assert [n for n, _ in told] == list(range(1, found.iterations + 1))
    losses = [loss_of(law, some), *(loss for _, loss in told)]
    assert all(b <= a for a, b in itertools.pairwise(losses))
    assert found.loss == pytest.approx(loss_of(found.law, some), rel=1e-10)
    assert found.loss < 0.05 * losses[0]


def test_a_prior_counts_the_squares_of_the_parameters_and_keeps_them_small(some):
    found = {prior: fit(law_of(), some, scales_of(some), 8, prior=prior) for prior in (1e-4, 100.0)}
    squares = {}
    for prior, fitted in found.items():
        parameters, _ = ravel_pytree(eqx.filter(fitted.law, eqx.is_inexact_array))
        squares[prior] = float(parameters @ parameters)
        expected = loss_of(fitted.law, some) + prior * squares[prior]
        assert fitted.loss == pytest.approx(expected, rel=1e-10)
    assert squares[100.0] < 0.1 * squares[1e-4]


def test_a_prior_about_the_start_counts_how_far_the_parameters_have_moved_from_there(some):
    law = law_of()
    start, _ = ravel_pytree(eqx.filter(law, eqx.is_inexact_array))
    moved = {}
    for prior in (0.1, 10.0, 1e9):
        found = fit(law, some, scales_of(some), 8, prior=prior, near=law)
        parameters, _ = ravel_pytree(eqx.filter(found.law, eqx.is_inexact_array))
        moved[prior] = float(jnp.sum((parameters - start) ** 2))
        assert found.loss == pytest.approx(loss_of(found.law, some) + prior * moved[prior], rel=1e-10)
        assert found.loss <= loss_of(law, some)
    assert moved[1e9] < 1e-3 * moved[10.0] < 1e-3 * moved[0.1]


@pytest.mark.parametrize(
    ("layout", "mirror", "symmetry"),
    [
        ("double-helix", True, "mirror"),
        ("double-helix", False, "none"),
        ("ring", True, "full"),
        ("six-helix", True, "full"),
        ("six-helix", False, "none"),
    ],
)
def test_the_symmetry_of_a_section_follows_from_its_layout(layout, mirror, symmetry):
    run = {"layout": layout, "mirror": mirror, "geometry": {}}
    assert symmetry_of(run) == symmetry
    # One wall that differs leaves the mirror image alone.
    uneven = symmetry_of({**run, "geometry": {"outer_wall_variation": [0.1, 0.0, 0.0]}})
    assert uneven == ("mirror" if mirror else "none")
    assert symmetry_of({**run, "geometry": {"outer_wall_variation": [0.1, 0.1, 0.1]}}) == symmetry


# 40 paths and laws of one small size, compiled once; the real calibration has more of each.
SHORT = {"domain": DOMAIN, "length": LENGTH, "ridges": 6, "features": 5, "iterations": 3, "seed": 0}


@pytest.fixture(scope="module")
def fitted(dataset, short_trials):
    return fit_and_judge(dataset, **{**SHORT, "iterations": 30})


def test_the_guess_of_the_free_curvature_is_near_its_root(samples, fitted):
    """To a tenth of the range: from there Newton's method finds the root that a loading leads to."""
    law = fitted.law
    pressure = jnp.asarray(samples.pressure[samples.held_out][::7])
    root = eqx.filter_vmap(law.free_curvature)(pressure)
    guess = eqx.filter_vmap(lambda p: law.contracted(p).free_curvature)(pressure)
    size = float(jnp.max(jnp.linalg.norm(root, axis=1)))
    assert float(jnp.max(jnp.linalg.norm(guess - root, axis=1))) < 0.1 * size


def test_a_fit_predicts_held_out_states_far_better_than_their_range(fitted):
    assert fitted.good, fitted.complaint
    angle, volume = fitted.error["free_bending_angle_rad"], fitted.error["volume_m2"]
    assert angle["p95"] < 0.02 * angle["range"]
    assert volume["p95"] < 0.02 * volume["range"]
    assert fitted.training["ridges"] == 6


@pytest.fixture(scope="module")
def short(dataset, short_trials):
    return fit_and_judge(dataset, **SHORT)


@pytest.mark.slow
def test_a_law_of_another_winding_gives_the_fit_its_size_and_start(dataset):
    """Of full symmetry, it has three times the ridges where only the mirror is left."""
    near = begin_near(law_of("full"), attributes(dataset))
    outcome = fit_and_judge(dataset, **{**SHORT, "iterations": 30}, near=[near])
    assert outcome.good, outcome.complaint
    assert outcome.law.symmetry == "mirror"
    assert (outcome.training["ridges"], outcome.training["features"]) == (18, 15)
    assert outcome.training["prior"] == PRIOR_NEAR
    alone = fit_and_judge(dataset, **SHORT)
    assert alone.training["prior"] == PRIOR
    angle = outcome.error["free_bending_angle_rad"]
    assert angle["p95"] < 0.02 * angle["range"]


@pytest.mark.parametrize("symmetry", ["none", "mirror"])
def test_images_that_were_written_out_keep_their_mixing_where_states_are_few(some, symmetry):
    law = unfolded(law_of("full"), symmetry)
    every = numbers_of(law)
    assert trained_numbers(law, len(some)).size == every - law.mixing.size
    assert trained_numbers(law, every // 4).size == every
    found = fit(law, some, scales_of(some), 3)
    np.testing.assert_array_equal(found.law.mixing, law.mixing)
    assert np.all(found.law.directions != law.directions)
    assert found.loss < 0.5 * loss_of(law, some)


def numbers_of(law):
    return sum(leaf.size for leaf in jax.tree.leaves(eqx.filter(law, eqx.is_inexact_array)))


@pytest.mark.parametrize("symmetry", ["none", "mirror", "full"])
def test_a_law_of_its_own_symmetry_is_fitted_whole(symmetry):
    assert trained_numbers(law_of(symmetry), 1).size == numbers_of(law_of(symmetry))


def test_laws_that_cannot_become_those_of_a_section_are_refused():
    run = {"layout": "double-helix", "mirror": True}
    anywhere = initial_oriented(SCALES, 4, 4, seed=0)
    with pytest.raises(ValueError, match="all orientations"):
        begin_near(anywhere, run)
    # At a single ψ each of its images has biases of its own, and a mirror would make two of them equal.
    with pytest.raises(ValueError, match="biases for each image"):
        begin_near(anywhere, {**run, "winding": {"psi": 0.0, "pitch": 3e-3}})
    with pytest.raises(ValueError, match="symmetry"):
        begin_near(law_of("none"), run)
    with pytest.raises(ValueError, match="Manufactured, expected a network of ridges"):
        begin_near(Manufactured(jnp.zeros(3)), run)
    oriented = begin_near(law_of("full"), {**run, "mirror": False, "orientations": [0.0, 0.5]})
    assert begin_near(oriented, {**run, "orientations": [0.0, 0.5]}) is oriented


def test_a_law_of_all_orientations_is_near_that_of_one():
    """It begins as the same potential."""
    run = {"layout": "double-helix", "mirror": False, "winding": {"psi": 0.4, "pitch": 3e-3}}
    anywhere = initial_oriented(SCALES, 4, 4, seed=0)
    law, here = begin_near(anywhere, run), anywhere.at_psi(0.4)
    assert (law.symmetry, law.offsets.size) == ("none", 24)
    for curvature, pressure in (
        ([3.0, -7.0, 2.0], [30e3, 10e3, 0.0]),
        ([-20.0, 5.0, -1.0], [0.0, 5e3, 40e3]),
    ):
        u, p = jnp.array(curvature), jnp.array(pressure)
        np.testing.assert_allclose(law.contracted(p).energy(u), here.contracted(p).energy(u), rtol=1e-12)


def test_held_out_states_do_not_train(dataset, short):
    held_out = np.flatnonzero(dataset["role"].values == "held-out")
    spoilt = dataset.copy(deep=True)
    spoilt["curvature"].values[held_out] += 1.0
    other = fit_and_judge(spoilt, **SHORT)
    assert np.array_equal(short.law.directions, other.law.directions)
    assert short.error != other.error


def test_a_law_is_rounded_to_what_its_file_holds():
    law = law_of()
    fewer = rounded(law)
    before, after = (ravel_pytree(eqx.filter(some, eqx.is_inexact_array))[0] for some in (law, fewer))
    np.testing.assert_allclose(after, before, rtol=0.5 * 10.0 ** (1 - DIGITS), atol=0.0)
    assert all(float(f"{number:.{DIGITS}g}") == number for number in after)
    assert eqx.tree_equal(rounded(fewer), fewer)


def test_figures_of_a_fit_can_be_found_again(samples, short):
    judged = samples.held_out & inside(short.domain, samples.pressure, samples.moment)
    assert figures(short.law, samples.where(judged), LENGTH) == short.error


def test_a_law_of_all_orientations_is_fitted_to_states_of_several(some):
    """States at ψ and, turned by 120°, at ψ + 120° are one section: residuals are the same, and fall."""
    law = initial_oriented(SCALES, ridges=4, features=4, seed=0)
    states = replace(some, psi=np.full(len(some), 0.2))
    loss = loss_of(law, states)
    assert loss_of(law, replace(states, psi=states.psi + np.pi)) == pytest.approx(loss, rel=1e-9)
    assert abs(loss_of(law, replace(states, psi=states.psi + 0.5)) / loss - 1.0) > 1e-3
    outcome = fit(law, states, scales_of(states), iterations=5)
    assert outcome.loss < 0.3 * loss
    guessed = with_guess(outcome.law, DOMAIN)
    assert np.abs(guessed.network.guess).max() > 0.0


def test_a_law_with_more_parameters_than_data_is_fitted_to_the_end(some):
    """The normal matrix is singular then, and in single precision not even semidefinite."""
    few = some.where(np.arange(len(some)) < 2)
    law = law_of()
    assert ravel_pytree(eqx.filter(law, eqx.is_inexact_array))[0].size > 27 * len(few)
    found = fit(law, few, scales_of(few), iterations=60, tolerance=0.0)
    assert found.loss < 1e-6 * loss_of(law, few)


def test_states_far_beyond_the_domain_do_not_train(dataset):
    """A fifth of its pressures beyond, and beside a chamber alone three times as much as it allows."""
    everything = prepare(dataset, DOMAIN, LENGTH).train
    narrow = replace(DOMAIN, pressure_max=(30e3,) * 3, single_max=(50e3, 0.0, 0.0), single_beside=3e3)
    kept = prepare(dataset, narrow, LENGTH).train.pressure
    first, beside = everything.pressure[:, 0], everything.pressure[:, 1:].max(axis=1)
    largest = everything.pressure.max(axis=1)
    near = (largest <= 36e3) | ((first <= 60e3) & (beside <= 9e3))
    assert 0 < (~near).sum() < len(near)
    assert near.sum() > (largest <= 36e3).sum()
    np.testing.assert_array_equal(kept, everything.pressure[near])


@pytest.mark.slow
def test_one_law_learns_the_mean_of_laws_near_several(dataset):
    """It comes nearer to their mean than they are to it, at states that it did not learn from."""
    run = attributes(dataset)
    laws = [begin_near(initial_law(SCALES, 6, 5, seed=seed, symmetry="mirror"), run) for seed in (0, 1, 2)]
    outcome = fit_and_judge(dataset, **{**SHORT, "iterations": 25}, near=laws)
    assert outcome.good, outcome.complaint
    assert outcome.training["prior"] == PRIOR_NEAR_SEVERAL
    own = prepare(dataset, DOMAIN, LENGTH)
    alone = [
        robust_fit(law, own.train, own.metric, 25, prior=PRIOR_NEAR_SEVERAL, near=law).law for law in laws
    ]
    unseen = mean_states([with_guess(alone[0], DOMAIN), *alone[1:]], DOMAIN, own.train.psi, seed=9)
    scatter = [mean_square(law, unseen, metric_in(DOMAIN, unseen, LENGTH)) for law in alone]
    assert mean_square(outcome.law, unseen, metric_in(DOMAIN, unseen, LENGTH)) < 0.5 * min(scatter)


def test_a_law_that_is_stable_at_no_held_out_state_says_so(dataset, monkeypatch):
    """With the domain that is left; there is no error to tell."""
    left = Domain((1.0, 1.0, 1.0), 3.0, 1e-9)
    monkeypatch.setattr("calibration.fit.pipeline.narrowed", lambda law, domain: left)
    outcome = fit_and_judge(dataset, DOMAIN, LENGTH, 6, 5, 1, 0)
    assert not outcome.good
    assert outcome.error == {}
    assert outcome.complaint == (
        f"no held-out state lies where the fitted law is stable, {left.largest_pressures('kPa')}"
    )
