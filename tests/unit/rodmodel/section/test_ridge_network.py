"""The law that ships: one potential, its slopes, its symmetries, and the root that is its free curvature."""

from dataclasses import replace

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from jaxtyping import Array
from scipy.integrate import quad
from scipy.optimize import brentq

from rodmodel import RidgeLaw, RidgeNetwork, TurnedLaw
from rodmodel.section import SYMMETRIES
from tests.unit.rodmodel import synthetic

MIRROR_CURVATURE = np.array([-1.0, 1.0, -1.0])
MIRROR_CHAMBERS = np.array([0, 2, 1])


@pytest.fixture(params=SYMMETRIES)
def law(request: pytest.FixtureRequest) -> RidgeNetwork:
    return synthetic.ridge_law(symmetry=request.param)


def states(count: int = 5) -> list[tuple[Array, Array]]:
    """Curvatures [1/m] and pressures [Pa] all over the range of the actuator."""
    rng = np.random.default_rng(7)
    return [(jnp.array(rng.uniform(-50, 50, 3)), jnp.array(rng.uniform(0, 70e3, 3))) for _ in range(count)]


def differences(function, x: Array, step: float) -> np.ndarray:
    """Fourth-order central differences, as the last axis."""
    columns = [
        (8 * (function(x + e) - function(x - e)) - (function(x + 2 * e) - function(x - 2 * e))) / (12 * step)
        for e in step * np.eye(3)
    ]
    return np.stack(columns, axis=-1)


def adjusted() -> RidgeNetwork:
    """As an actuator of one's own has it: straight at other pressures, with stiffness added."""
    return replace(
        synthetic.ridge_law(4, symmetry="none"),
        rest_pressures=jnp.array([0.05, -0.02, 0.1]),
        quadratic=jnp.array([0.2, 0.05, 0.3, -0.04, 0.06, 0.1]),
    )


def biased() -> RidgeNetwork:
    """With a bias of its own for each image."""
    biases = jnp.array(np.random.default_rng(5).normal(size=(2, 6)))
    return replace(synthetic.ridge_law(5), feature_biases=biases)


def images_of(symmetry: str) -> list[tuple[np.ndarray, np.ndarray]]:
    """Turns of the curvature by 120° with the chambers that they lead to, and their mirror images."""
    c, s = -0.5, np.sqrt(0.75)
    third, mirror = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]]), np.diag(MIRROR_CURVATURE)
    turns = range(3 if symmetry == "full" else 1)
    turned = [(np.linalg.matrix_power(third, n), np.roll(np.arange(3), n)) for n in turns]
    mirrored = [(mirror @ turn, order[MIRROR_CHAMBERS]) for turn, order in turned]
    return turned if symmetry == "none" else turned + mirrored


def potential_of(law: RidgeNetwork, u: np.ndarray, p: np.ndarray) -> float:
    """Π as the docstring has it, a sum at a time, with φ the integral of its slope."""
    matrix = np.zeros((3, 3))
    matrix[np.tril_indices(3)] = law.factor
    rest = np.zeros(3) if law.rest_pressures is None else np.asarray(law.rest_pressures)
    images = images_of(law.symmetry)
    biases = np.broadcast_to(law.feature_biases, (len(images), law.feature_biases.shape[-1]))

    def features(q: np.ndarray, bias: np.ndarray) -> np.ndarray:
        return np.concatenate([q, np.tanh(np.asarray(law.feature_weights) @ q + bias)])

    total = 0.0
    for (turn, order), bias in zip(images, biases, strict=True):
        x = turn @ u / law.curvature_scale
        h, h_rest = features(p[order] / law.pressure_scale, bias), features(rest[order], bias)
        total += 0.5 * np.sum((matrix.T @ x) ** 2) + np.asarray(law.slopes) @ (h - h_rest)
        ridges = map(np.asarray, (law.directions, law.mixing, law.offsets, law.weights))
        for d, e, b, c in zip(*ridges, strict=True):
            z, z_rest = float(d @ x + e @ h + b), float(e @ h_rest + b)
            total += float(c) * quad(lambda z: (1.0 + z * z) ** -2, z_rest, z, epsabs=1e-14)[0]
            total -= float(c) * (1.0 + z_rest**2) ** -2 * float(d @ x)
    added = np.zeros((3, 3))
    if law.quadratic is not None:
        added[np.tril_indices(3)] = law.quadratic
        added = added + np.tril(added, -1).T
    x = u / law.curvature_scale
    empty = law.rest_volume * np.sum(p - law.pressure_scale * rest)
    return float(law.energy_scale * (total / len(images) + 0.5 * x @ added @ x) - empty)


@pytest.mark.parametrize(
    "law",
    [*(synthetic.ridge_law(symmetry=name) for name in SYMMETRIES), adjusted(), biased()],
    ids=[*SYMMETRIES, "adjusted", "a bias for each image"],
)
def test_the_potential_is_its_formula(law: RidgeNetwork) -> None:
    for u, p in states(2):
        expected = potential_of(law, np.asarray(u), np.asarray(p))
        np.testing.assert_allclose(law.potential(u, p), expected, rtol=1e-12)


def test_potential_moment_and_free_curvature_vanish_at_rest(law: RidgeNetwork) -> None:
    """To the rounding of sums of some ten numbers near one."""
    zero = jnp.zeros(3)
    assert abs(law.potential(zero, zero)) < 1e-15 * law.energy_scale * 10
    unit = law.energy_scale / law.curvature_scale
    np.testing.assert_allclose(law.moment(zero, zero), 0.0, atol=1e-14 * unit)
    np.testing.assert_allclose(law.free_curvature(zero), 0.0, atol=1e-12)


# A fourth-order difference with steps of 1e-3 of the range errs by 1e-12 of the derivative for the step and
# by 1e-16/1e-3 for rounding; 1e-9 leaves room for the growth of high derivatives.
def test_moment_volume_and_stiffness_are_slopes(law: RidgeNetwork) -> None:
    contract = eqx.filter_jit(law.at)
    for u, p in states():
        at = contract(p)
        slope = differences(lambda u, p=p: law.potential(u, p), u, 5e-2)
        moment = law.moment(u, p)
        np.testing.assert_allclose(moment, slope, atol=1e-9 * np.abs(slope).max())
        np.testing.assert_allclose(at.moment(u), moment, atol=1e-14 * np.abs(moment).max())
        stiffness = np.asarray(law.stiffness(u, p))
        slope = differences(lambda u, p=p: law.moment(u, p), u, 5e-2)
        np.testing.assert_allclose(stiffness, slope, atol=1e-9 * np.abs(slope).max())
        np.testing.assert_allclose(stiffness, stiffness.T, atol=1e-15 * np.abs(stiffness).max())
        slope = differences(lambda p, u=u: law.potential(u, p), p, 70.0)
        np.testing.assert_allclose(law.volume(u, p), -slope, atol=1e-9 * np.abs(slope).max())


def test_the_moment_vanishes_at_the_free_curvature(law: RidgeNetwork) -> None:
    contract = eqx.filter_jit(law.at)
    for _, p in states():
        at = contract(p)
        # The rounding of a sum of terms of the size of the moment unit.
        unit = law.energy_scale / law.curvature_scale
        np.testing.assert_allclose(at.moment(at.free_curvature), 0.0, atol=1e-13 * unit)


# The root is that of a sum of ridges, whatever symmetry these are from.
@pytest.mark.parametrize(
    "symmetry",
    [pytest.param(name, marks=[pytest.mark.slow] if name != "mirror" else []) for name in SYMMETRIES],
)
def test_the_free_curvature_has_the_slopes_of_a_root(symmetry: str) -> None:
    """By forward and reverse mode, and of second order; a difference of fourth order errs by some 1e-9."""
    law = synthetic.ridge_law(symmetry=symmetry)

    def free(p: Array) -> Array:
        return law.free_curvature(p)

    derivatives = jax.jacfwd(free), jax.jacrev(free), jax.jacfwd(jax.jacfwd(free))
    forward, reverse, twice = map(jax.jit, derivatives)
    for _, p in states(2):
        slope = differences(free, p, 50.0)
        for jacobian in (forward, reverse):
            np.testing.assert_allclose(jacobian(p), slope, atol=1e-8 * np.abs(slope).max())
        second = differences(forward, p, 50.0)
        found = twice(p)
        np.testing.assert_allclose(found, second, atol=1e-7 * np.abs(second).max())


def test_a_batch_with_a_bad_pressure_spoils_no_other(law: RidgeNetwork) -> None:
    pressures = jnp.array(np.random.default_rng(0).uniform(0, 70e3, (20, 3))).at[3].set(jnp.nan)
    free = jax.jit(jax.vmap(law.free_curvature))(pressures)
    assert np.isnan(free[3]).all()
    for n in np.delete(np.arange(20), 3):
        np.testing.assert_allclose(free[n], law.free_curvature(pressures[n]), rtol=1e-10, atol=1e-10)


def test_a_law_without_a_root_says_so() -> None:
    """A ridge pulls harder than the quadratic ever holds: its slope has no zero within reach."""
    none = jnp.zeros(3)
    runaway = RidgeLaw(
        directions=jnp.eye(3)[:1],
        free_curvature=none,
        constant=jnp.zeros(()),
        slope=jnp.array([1.0, 0.0, 0.0]),
        quadratic=1e-12 * jnp.eye(3),
        offsets=jnp.zeros(1),
        weights=jnp.zeros(1),
        energy_scale=1.0,
        curvature_scale=1.0,
    )
    assert np.isnan(runaway.settled().free_curvature).all()


@pytest.mark.parametrize("start", [-2.5, 2.5])
def test_a_root_that_is_many_steps_away_is_found(start: float) -> None:
    """The moment rises everywhere, but so little in places that whole steps of Newton's method never end."""

    def moment(x: float) -> float:
        return 1.7 * x + 0.9 - 1.55 * (1.0 + x * x) ** -2

    law = RidgeLaw(
        directions=jnp.eye(3)[:1],
        free_curvature=jnp.array([start, 0.3, -0.2]),
        constant=jnp.zeros(()),
        slope=jnp.array([0.9, 0.0, 0.0]),
        quadratic=jnp.diag(jnp.array([1.7, 1.0, 1.0])),
        offsets=jnp.zeros(1),
        weights=jnp.array([-1.55]),
        energy_scale=1.0,
        curvature_scale=1.0,
    )
    root = brentq(moment, -3.0, 3.0, xtol=1e-14)
    np.testing.assert_allclose(law.settled().free_curvature, [root, 0.0, 0.0], atol=1e-13)


def test_mirror_images_have_the_same_potential() -> None:
    for symmetry in ("mirror", "full"):
        law = synthetic.ridge_law(symmetry=symmetry)
        for u, p in states():
            v, q = MIRROR_CURVATURE * u, p[MIRROR_CHAMBERS]
            np.testing.assert_allclose(law.potential(v, q), law.potential(u, p), rtol=1e-13)
            free = law.free_curvature(p)
            np.testing.assert_allclose(law.free_curvature(q), MIRROR_CURVATURE * free, rtol=1e-9, atol=1e-9)


@pytest.mark.parametrize("turns", [1, 2])
def test_a_section_alike_from_all_chambers_is_its_own_turned_law(turns: int) -> None:
    law = synthetic.ridge_law(symmetry="full")
    turned = TurnedLaw(law, turns)
    for u, p in states():
        np.testing.assert_allclose(turned.potential(u, p), law.potential(u, p), rtol=1e-12)
        scale = np.abs(law.moment(u, p)).max()
        np.testing.assert_allclose(turned.moment(u, p), law.moment(u, p), atol=1e-12 * scale)


def test_laws_of_one_size_can_be_stacked() -> None:
    laws = [synthetic.ridge_law(seed) for seed in range(3)]
    stacked = jax.tree.map(lambda *leaves: jnp.stack(leaves), *laws)
    (u, p), *_ = states()
    moments = eqx.filter_vmap(lambda law: law.moment(u, p))(stacked)
    for law, moment in zip(laws, moments, strict=True):
        np.testing.assert_allclose(moment, law.moment(u, p), rtol=1e-12)


def test_arrays_that_do_not_fit_and_impossible_scales_are_refused() -> None:
    law = synthetic.ridge_law()
    with pytest.raises(ValueError, match=r"^mixing: got shape \(8, 5\), expected \(8, 9\)"):
        replace(law, mixing=law.mixing[:, :5])
    with pytest.raises(ValueError, match=r"^quadratic: got shape \(3,\), expected \(6,\)"):
        replace(adjusted(), quadratic=jnp.zeros(3))
    with pytest.raises(ValueError, match=r"^symmetry: got 'some', expected one of none, mirror, full"):
        replace(law, symmetry="some")
    for added in ({"rest_pressures": jnp.zeros(3)}, {"quadratic": jnp.zeros(6)}):
        with pytest.raises(ValueError, match=r"^symmetry: got 'mirror', expected none in an adjusted law"):
            replace(law, **added)
    with pytest.raises(ValueError, match=r"^feature_biases: got 3 rows, expected one, or 2"):
        replace(law, feature_biases=jnp.zeros((3, 6)))
    for name in ("pressure_scale", "curvature_scale", "energy_scale", "rest_volume"):
        for value in (0.0, -1.0, float("inf")):
            with pytest.raises(ValueError, match=f"^{name}: got {value}, expected a positive number"):
                replace(law, **{name: value})
