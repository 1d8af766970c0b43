"""The section law: one potential, its slopes, its symmetries."""

from collections.abc import Callable

import equinox as eqx
import jax.numpy as jnp
import numpy as np
import pytest
from jaxtyping import Array

from rodmodel import CurvatureLaw, LinearLaw, MirroredLaw, SectionLaw, TurnedLaw
from tests.unit.rodmodel import synthetic

MIRROR_CURVATURE = np.array([-1.0, 1.0, -1.0])
MIRROR_CHAMBERS = np.array([0, 2, 1])

LAWS = {
    "plain": synthetic.bending_law(),
    "without mirror": synthetic.ridge_law(2, symmetry="none"),
    "turned": TurnedLaw(synthetic.bending_law("none"), 1),
    "turned twice": TurnedLaw(synthetic.bending_law("none"), 2),
    "in the mirror": MirroredLaw(synthetic.ridge_law(3, symmetry="none")),
    "linear": LinearLaw(
        synthetic.BENDING_STIFFNESS * jnp.array([[1.0, 0.1, 0.0], [0.1, 1.2, -0.2], [0.0, -0.2, 0.8]]),
        1e-3 * jnp.array([[0.0, 0.5, -0.5], [-0.6, 0.3, 0.3], [0.0, 0.1, 0.1]]),
        synthetic.REST_VOLUME,
    ),
}
UNIT = synthetic.BENDING_STIFFNESS * synthetic.CURVATURE_SCALE  # [N m]


# What a second turn changes is in `test_a_turned_law_is_the_law_seen_from_another_chamber`.
EACH = [
    pytest.param(law, id=name, marks=[pytest.mark.slow] if name == "turned twice" else [])
    for name, law in LAWS.items()
]


@pytest.fixture(params=EACH)
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
    # The rounding of sums of some ten numbers near the units.
    assert abs(law.potential(zero, zero)) < 1e-14 * synthetic.ENERGY_SCALE
    np.testing.assert_allclose(law.free_curvature(zero), 0.0, atol=1e-12)
    np.testing.assert_allclose(law.moment(zero, zero), 0.0, atol=1e-14 * UNIT)


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
        np.testing.assert_allclose(moment, 0.0, atol=1e-13 * UNIT)


def values(at: CurvatureLaw, u: Array) -> tuple[Array, Array, Array]:
    return at.energy(u), at.moment(u), at.stiffness(u)


def test_contracting_the_pressure_first_changes_nothing(law: SectionLaw) -> None:
    contract, of_curvature = eqx.filter_jit(law.at), eqx.filter_jit(values)
    for u, p in states():
        at = contract(p)
        energy, moment, stiffness = of_curvature(at, u)
        np.testing.assert_allclose(energy, law.potential(u, p), rtol=1e-13)
        for found, method in ((moment, law.moment), (stiffness, law.stiffness)):
            expected = np.asarray(method(u, p))
            np.testing.assert_allclose(found, expected, atol=1e-13 * np.abs(expected).max())
        np.testing.assert_allclose(at.free_curvature, law.free_curvature(p), atol=1e-10)


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
        np.testing.assert_allclose(turned.potential(v, q), law.potential(u, p), atol=1e-13 * scale)
        for quantity in ("moment", "free_curvature"):
            given = (v, q) if quantity == "moment" else (q,)
            plain = (u, p) if quantity == "moment" else (p,)
            expected = turn @ getattr(law, quantity)(*plain)
            np.testing.assert_allclose(
                getattr(turned, quantity)(*given), expected, atol=1e-11 * np.abs(expected).max()
            )
        expected = turn @ law.stiffness(u, p) @ turn.T
        np.testing.assert_allclose(turned.stiffness(v, q), expected, atol=1e-13 * np.abs(expected).max())
        np.testing.assert_allclose(turned.volume(v, q), np.roll(law.volume(u, p), turns), rtol=1e-12)


def test_a_mirrored_law_is_the_law_of_the_mirror_image() -> None:
    """Signs change and chambers swap, no more."""
    law = LAWS["without mirror"]
    mirrored = MirroredLaw(law)
    for u, p in states():
        v, q = MIRROR_CURVATURE * u, p[MIRROR_CHAMBERS]
        np.testing.assert_allclose(mirrored.potential(v, q), law.potential(u, p), rtol=1e-14)
        moment, free = MIRROR_CURVATURE * law.moment(u, p), MIRROR_CURVATURE * law.free_curvature(p)
        np.testing.assert_allclose(mirrored.moment(v, q), moment, atol=1e-14 * UNIT)
        np.testing.assert_allclose(mirrored.free_curvature(q), free, atol=1e-10)
        np.testing.assert_allclose(mirrored.volume(v, q)[MIRROR_CHAMBERS], law.volume(u, p), rtol=1e-12)
    (u, p), *_ = states()
    np.testing.assert_allclose(MirroredLaw(mirrored).potential(u, p), law.potential(u, p), rtol=1e-14)


def test_three_turns_are_none() -> None:
    law = LAWS["plain"]
    (u, p), *_ = states()
    there_and_on = TurnedLaw(TurnedLaw(law, 1), 2)
    np.testing.assert_allclose(there_and_on.potential(u, p), law.potential(u, p), rtol=1e-13)
    np.testing.assert_allclose(there_and_on.volume(u, p), law.volume(u, p), rtol=1e-12)


class CountedLaw(SectionLaw):
    """A linear law that counts how often it is traced."""

    law: LinearLaw
    times: list[int] = eqx.field(static=True)

    def at(self, pressure: Array) -> CurvatureLaw:
        self.times[0] += 1
        return self.law.at(pressure)


def test_laws_of_one_shape_share_a_compilation() -> None:
    """Their scales are numbers to it, not constants."""
    (u, p), *_ = states()
    times, volumes = [0], []
    for scale in (1.0, 1.2):
        law = CountedLaw(LinearLaw(scale * jnp.eye(3), jnp.zeros((3, 3)), scale * 15e-6), times)
        volumes.append(float(law.volume(u, p)[0]))
        traced = times[0] if scale == 1.0 else traced
    assert times[0] == traced > 0
    np.testing.assert_allclose(volumes, [15e-6, 18e-6], rtol=1e-14)


def test_the_linear_law_has_its_constants() -> None:
    law = synthetic.linear_law()
    (u, p), *_ = states()
    stiffness = synthetic.BENDING_STIFFNESS * np.diag([1.0, 1.0, synthetic.TORSION_RATIO])
    np.testing.assert_allclose(law.stiffness(u, p), stiffness, rtol=1e-15)
    np.testing.assert_allclose(law.moment(u, p), stiffness @ u, rtol=1e-14)
    np.testing.assert_allclose(law.volume(u, p), synthetic.REST_VOLUME, rtol=1e-14)
    np.testing.assert_array_equal(law.free_curvature(p), 0.0)


def test_what_is_no_linear_law_is_refused(unchecked: None) -> None:
    good = jnp.eye(3)
    with pytest.raises(ValueError, match=r"^section_stiffness: got shape \(2, 2\), expected \(3, 3\)"):
        LinearLaw(jnp.eye(2), good)
    with pytest.raises(ValueError, match=r"^rest_volume: got nan, expected a finite number"):
        LinearLaw(good, good, float("nan"))


@pytest.mark.parametrize("turns", [0, 3])
def test_a_turn_that_is_none_is_refused(turns: int) -> None:
    with pytest.raises(ValueError, match=f"turns: got {turns}, expected 1 or 2"):
        TurnedLaw(LAWS["plain"], turns)
