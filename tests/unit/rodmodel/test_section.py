"""The section law: one potential, its slopes, its symmetries."""

from collections.abc import Callable

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from jaxtyping import Array

from rodmodel import FreeStateExpansion, MirroredLaw, SectionLaw, TurnedLaw
from tests.unit.rodmodel import synthetic

MIRROR_CURVATURE = np.array([-1.0, 1.0, -1.0])
MIRROR_CHAMBERS = np.array([0, 2, 1])

LAWS = {
    "plain": synthetic.bending_law(0),
    "warped": synthetic.bending_law(1, pressure_warp=5e3),
    "without mirror": synthetic.bending_law(2, mirror=False, hidden=(12,)),
    "turned": TurnedLaw(synthetic.bending_law(3), 1),
    "turned twice": TurnedLaw(synthetic.bending_law(3), 2),
    "in the mirror": MirroredLaw(synthetic.bending_law(3, mirror=False)),
}


@pytest.fixture(params=LAWS.values(), ids=LAWS.keys())
def law(request: pytest.FixtureRequest) -> SectionLaw:
    return request.param


def states(count: int = 5) -> list[tuple[Array, Array]]:
    """Curvatures [1/m] and pressures [Pa] all over the range of the actuator."""
    rng = np.random.default_rng(7)
    return [(jnp.array(rng.uniform(-50, 50, 3)), jnp.array(rng.uniform(0, 70e3, 3))) for _ in range(count)]


def central(
    function: Callable[..., Array], arguments: tuple[Array, Array], which: int, step: float
) -> np.ndarray:
    """Fourth-order central differences by each component of one argument, as the last axis."""

    def moved(by: np.ndarray) -> Array:
        return function(*(x + by if n == which else x for n, x in enumerate(arguments)))

    columns = []
    for e in step * np.eye(3):
        columns.append((8 * (moved(e) - moved(-e)) - (moved(2 * e) - moved(-2 * e))) / (12 * step))
    return np.stack(columns, axis=-1)


def test_potential_free_curvature_and_moment_vanish_at_rest(law: SectionLaw) -> None:
    zero = jnp.zeros(3)
    for transform in (lambda f: f, eqx.filter_jit):
        assert transform(law.potential)(zero, zero) == 0.0
        np.testing.assert_array_equal(transform(law.free_curvature)(zero), 0.0)
        np.testing.assert_array_equal(transform(law.moment)(zero, zero), 0.0)


def test_rest_is_exact_in_a_batch_too() -> None:
    law = LAWS["plain"]
    pressures = jnp.array(np.random.default_rng(0).uniform(0, 70e3, (1000, 3))).at[::7].set(0.0)
    free = jax.jit(jax.vmap(lambda pressure: law.free_curvature(pressure)))(pressures)
    np.testing.assert_array_equal(free[::7], 0.0)


# A fourth-order difference with steps of 1e-3 of the range errs by 1e-12 of the derivative for the step and
# by 1e-16/1e-3 for rounding; 1e-9 leaves room for the growth of high derivatives.
def test_moment_is_the_slope_of_the_potential(law: SectionLaw) -> None:
    for u, p in states():
        slope = central(law.potential, (u, p), 0, 5e-2)
        np.testing.assert_allclose(law.moment(u, p), slope, atol=1e-9 * np.abs(slope).max())


def test_volume_is_minus_the_slope_by_pressure(law: SectionLaw) -> None:
    for u, p in states():
        slope = central(law.potential, (u, p), 1, 70.0)
        np.testing.assert_allclose(law.volume(u, p), -slope, atol=1e-9 * np.abs(slope).max())


def test_stiffness_is_symmetric_and_the_slope_of_the_moment(law: SectionLaw) -> None:
    for u, p in states():
        stiffness = np.asarray(law.stiffness(u, p))
        slope = central(law.moment, (u, p), 0, 5e-2)
        np.testing.assert_allclose(stiffness, slope, atol=1e-9 * np.abs(slope).max())
        np.testing.assert_allclose(stiffness, stiffness.T, atol=1e-15 * np.abs(stiffness).max())


def test_the_moment_vanishes_at_the_free_curvature(law: SectionLaw) -> None:
    for _, p in states():
        moment = law.moment(law.free_curvature(p), p)
        # Bending stiffness times the rounding of a curvature of 50 1/m.
        np.testing.assert_allclose(moment, 0.0, atol=2.45e-4 * 50 * 4e-16)


def test_contracting_the_pressure_first_changes_nothing(law: SectionLaw) -> None:
    for u, p in states():
        at = law.at(p)
        assert at.energy(u) == law.potential(u, p)
        np.testing.assert_array_equal(at.moment(u), law.moment(u, p))
        np.testing.assert_array_equal(at.stiffness(u), law.stiffness(u, p))
        np.testing.assert_array_equal(at.free_curvature, law.free_curvature(p))


@pytest.mark.parametrize("name", ["plain", "warped"])
def test_mirror_is_exact(name: str) -> None:
    law = LAWS[name]
    for u, p in states():
        v, q = MIRROR_CURVATURE * u, p[MIRROR_CHAMBERS]
        np.testing.assert_array_equal(law.free_curvature(q), MIRROR_CURVATURE * law.free_curvature(p))
        np.testing.assert_array_equal(law.moment(v, q), MIRROR_CURVATURE * law.moment(u, p))
        # Sums over the chambers run in another order: a few roundings.
        np.testing.assert_allclose(law.potential(v, q), law.potential(u, p), rtol=1e-15)
        np.testing.assert_allclose(law.volume(v, q), law.volume(u, p)[MIRROR_CHAMBERS], rtol=1e-14)


def test_a_law_without_the_mirror_has_none() -> None:
    law = LAWS["without mirror"]
    (u, p), *_ = states()
    mirrored = law.potential(MIRROR_CURVATURE * u, p[MIRROR_CHAMBERS])
    assert abs(mirrored - law.potential(u, p)) > 1e-3 * abs(law.potential(u, p))


@pytest.mark.parametrize("turns", [1, 2])
def test_a_turned_law_is_the_law_seen_from_another_chamber(turns: int) -> None:
    law = LAWS["plain"]
    turned = TurnedLaw(law, turns)
    angle = 2.0 * np.pi / 3.0 * turns
    c, s = np.cos(angle), np.sin(angle)
    turn = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    for u, p in states():
        # Chamber 1 + turns of the turned law is chamber 1 of the law; its curvatures are turned with it.
        q, v = jnp.roll(p, turns), jnp.array(turn) @ u
        scale = abs(law.potential(u, p))
        np.testing.assert_allclose(turned.potential(v, q), law.potential(u, p), atol=1e-14 * scale)
        for quantity in ("moment", "free_curvature"):
            given = (v, q) if quantity == "moment" else (q,)
            plain = (u, p) if quantity == "moment" else (p,)
            expected = turn @ getattr(law, quantity)(*plain)
            np.testing.assert_allclose(
                getattr(turned, quantity)(*given), expected, atol=1e-13 * np.abs(expected).max()
            )
        expected = turn @ law.stiffness(u, p) @ turn.T
        np.testing.assert_allclose(turned.stiffness(v, q), expected, atol=1e-13 * np.abs(expected).max())
        np.testing.assert_allclose(turned.volume(v, q), np.roll(law.volume(u, p), turns), rtol=1e-12)


def test_a_mirrored_law_is_the_law_of_the_mirror_image() -> None:
    """Values to the last bit: signs change and chambers swap, no more."""
    law = LAWS["without mirror"]
    mirrored = MirroredLaw(law)
    for u, p in states():
        v, q = MIRROR_CURVATURE * u, p[MIRROR_CHAMBERS]
        assert mirrored.potential(v, q) == law.potential(u, p)
        np.testing.assert_array_equal(mirrored.moment(v, q), MIRROR_CURVATURE * law.moment(u, p))
        np.testing.assert_array_equal(mirrored.free_curvature(q), MIRROR_CURVATURE * law.free_curvature(p))
        np.testing.assert_allclose(mirrored.volume(v, q)[MIRROR_CHAMBERS], law.volume(u, p), rtol=1e-12)
    (u, p), *_ = states()
    assert MirroredLaw(mirrored).potential(u, p) == law.potential(u, p)


def test_three_turns_are_none() -> None:
    law = LAWS["plain"]
    (u, p), *_ = states()
    there_and_on = TurnedLaw(TurnedLaw(law, 1), 2)
    np.testing.assert_allclose(there_and_on.potential(u, p), law.potential(u, p), rtol=1e-13)
    np.testing.assert_allclose(there_and_on.volume(u, p), law.volume(u, p), rtol=1e-12)


def test_the_linear_law_has_its_constants() -> None:
    law = synthetic.linear_law()
    (u, p), *_ = states()
    stiffness = synthetic.BENDING_STIFFNESS * np.diag([1.0, 1.0, synthetic.TORSION_RATIO])
    np.testing.assert_allclose(law.stiffness(u, p), stiffness, rtol=1e-15)
    np.testing.assert_allclose(law.moment(u, p), stiffness @ u, rtol=1e-14)
    np.testing.assert_allclose(law.volume(u, p), synthetic.REST_VOLUME, rtol=1e-14)
    np.testing.assert_array_equal(law.free_curvature(p), 0.0)


def test_the_warp_spreads_small_pressures_and_keeps_the_largest() -> None:
    """The network sees 1 at the pressure scale, warped or not, and more than p/scale below it."""
    identity = [np.concatenate([np.eye(3), np.zeros((32, 3))])]
    laws = [
        FreeStateExpansion(
            weights=tuple(map(jnp.asarray, identity)),
            biases=(jnp.zeros(35),),
            pressure_scale=70e3,
            curvature_scale=1.0,
            energy_scale=1.0,
            rest_volume=1e-9,
            pressure_warp=warp,
            mirror=False,
        )
        for warp in (None, 5e3)
    ]
    # Outputs 1 and 2 of the network, its second and third inputs here, are the free curvature's x and y.
    full, part = jnp.array([0.0, 70e3, 70e3]), jnp.array([0.0, 5e3, 5e3])
    np.testing.assert_allclose([law.free_curvature(full)[:2] for law in laws], 1.0, rtol=1e-14)
    np.testing.assert_allclose(laws[0].free_curvature(part)[:2], 5 / 70, rtol=1e-14)
    np.testing.assert_allclose(
        laws[1].free_curvature(part)[:2], np.arcsinh(1.0) / np.arcsinh(14.0), rtol=1e-14
    )


@pytest.mark.parametrize(
    ("name", "value"),
    [("pressure_scale", 0.0), ("curvature_scale", -1.0), ("energy_scale", np.nan), ("pressure_warp", 0.0)],
)
def test_an_impossible_scale_is_refused(name: str, value: float) -> None:
    law = synthetic.linear_law()
    scales = {
        "pressure_scale": 70e3,
        "curvature_scale": 50.0,
        "energy_scale": 0.6,
        "rest_volume": 15.5e-6,
        name: value,
    }
    with pytest.raises(ValueError, match=f"{name}: got {value}, expected a positive number"):
        FreeStateExpansion(law.weights, law.biases, **scales)


def test_layers_that_do_not_chain_are_refused() -> None:
    law = synthetic.bending_law()
    with pytest.raises(ValueError, match="weights, biases: got shapes"):
        FreeStateExpansion(law.weights[1:], law.biases[1:], 70e3, 50.0, 0.6, 15.5e-6)
    with pytest.raises(ValueError, match="35 coefficients"):
        FreeStateExpansion(law.weights[:2], law.biases[:2], 70e3, 50.0, 0.6, 15.5e-6)


@pytest.mark.parametrize("turns", [0, 3])
def test_a_turn_that_is_none_is_refused(turns: int) -> None:
    with pytest.raises(ValueError, match=f"turns: got {turns}, expected 1 or 2"):
        TurnedLaw(LAWS["plain"], turns)
