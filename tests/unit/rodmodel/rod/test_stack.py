"""Rods of several layouts on one axis: each solves as it does alone, and dimensions are arguments."""

import math
from dataclasses import replace
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from jaxtyping import Array

import rodmodel
from rodmodel import FixedStep, MirroredLaw, OrientedNetwork, Rod, TurnedLaw
from tests.unit.rodmodel import synthetic

# JAX compiles each of these rods; `test_core_against_reference.py` holds the C core to be the same.
pytestmark = pytest.mark.slow

PRESSURE = jnp.array([31e3, 12e3, 22e3])
LOADS = {"tip_force": jnp.array([0.004, -0.01, 0.006]), "gravity": jnp.array([0.0, 0.0, -9.81])}


@pytest.fixture(scope="module")
def rods() -> list[Rod]:
    """Rods that differ in all that a calibration may differ in."""
    mirror, full = synthetic.ridge_law(), synthetic.ridge_law(3, symmetry="full", ridges=5)
    scaled = replace(
        synthetic.ridge_law(5, symmetry="none", ridges=12),
        pressure_scale=0.6 * synthetic.FULL_PRESSURE,
        curvature_scale=0.8 * synthetic.CURVATURE_SCALE,
        energy_scale=0.7 * synthetic.ENERGY_SCALE,
        rest_volume=1.1 * synthetic.REST_VOLUME,
    )
    weights = 0.4 * np.random.default_rng(4).standard_normal((len(full.feature_biases), 2))
    oriented = OrientedNetwork(full, jnp.asarray(weights)).at_psi(0.3)
    ends = replace(synthetic.ACTUATOR, stiff_tip=1.3e-3, base_turn=1.8e-6, base_lag=3e-3, tip_offset=2e-3)
    ends = replace(ends, base_stiffness=3e-4, base_growth=0.4, tip_draw=0.7e-6)
    short = replace(synthetic.ACTUATOR, body_length=0.05, cap_mass=2e-3)
    low = rodmodel.Domain((20e3, 60e3, 60e3), 90e3, 1e-3, 0.4e-3)
    beside = replace(synthetic.DOMAIN, beside_share=0.5, beside_max=47e3)
    laws = [mirror, TurnedLaw(mirror, 1), MirroredLaw(TurnedLaw(scaled, 2)), oriented]
    dimensions = [synthetic.ACTUATOR, ends, short, ends]
    domains = [synthetic.DOMAIN, low, beside, low]
    return [Rod(*parts, 0.01 * k) for k, parts in enumerate(zip(laws, dimensions, domains, strict=True))]


def of_each(rods: Rod, **loads: Any) -> rodmodel.Solution:
    found: rodmodel.Solution = jax.vmap(lambda rod: rod.solve(PRESSURE, throw=False, **loads))(rods)
    return found


LOADED = pytest.param({**LOADS, "solver": FixedStep()}, id="loaded", marks=pytest.mark.slow)


@pytest.mark.parametrize("loads", [pytest.param({}, id="free"), LOADED])
def test_each_rod_of_a_stack_solves_as_it_does_alone(rods: list[Rod], loads: dict[str, Any]) -> None:
    together = of_each(rodmodel.stack(rods), **loads)
    for k, rod in enumerate(rods):
        alone = rod.solve(PRESSURE, throw=False, **loads)
        here = jax.tree.map(lambda leaf, k=k: leaf[k], together)
        # The same sums in another order, Newton's method to 1e-10 of u L and the steps' sizes with it.
        for name in ("tip_position", "tip_rotation", "bending_angle", "bending_plane"):
            np.testing.assert_allclose(getattr(here, name), getattr(alone, name), rtol=0, atol=1e-10)
        np.testing.assert_allclose(here.chamber_volume, alone.chamber_volume, rtol=1e-9)
        for name in ("converged", "stable", "in_domain"):
            assert bool(getattr(here, name)) == bool(getattr(alone, name)), (name, k)
        np.testing.assert_array_equal(here.error_estimate, alone.error_estimate)
        arc = 0.02
        np.testing.assert_allclose(here.centreline(arc), alone.centreline(arc), rtol=0, atol=1e-10)
    assert bool(jnp.all(together.converged))
    assert 0 < int(jnp.sum(together.in_domain)) < len(rods)


def test_rods_are_picked_in_any_order_and_as_often_as_wanted(rods: list[Rod]) -> None:
    stacked = rodmodel.stack(rods)
    which = np.array([3, 0, 0, 1])
    picked = jax.tree.map(lambda leaf: leaf[which], stacked)
    found, each = of_each(picked), of_each(stacked)
    np.testing.assert_allclose(found.tip_position, each.tip_position[which], rtol=0, atol=1e-12)


@pytest.mark.parametrize("loads", [pytest.param({}, id="free"), LOADED])
def test_one_bad_row_spoils_no_neighbour(rods: list[Rod], loads: dict[str, Any]) -> None:
    stacked = rodmodel.stack(rods[:3])
    pressures = jnp.stack([PRESSURE, PRESSURE.at[0].set(jnp.nan), PRESSURE])
    found = jax.vmap(lambda rod, p: rod.solve(p, throw=False, **loads))(stacked, pressures)
    np.testing.assert_array_equal(found.converged, [True, False, True])
    assert bool(jnp.isnan(found.tip_position[1]).all())
    alone = rods[2].solve(PRESSURE, throw=False, **loads)
    np.testing.assert_allclose(found.tip_position[2], alone.tip_position, rtol=0, atol=1e-10)


def test_jacobians_of_a_stack_are_those_of_its_rods(rods: list[Rod]) -> None:
    some, solver = [rods[1], rods[3]], FixedStep()
    stacked = rodmodel.stack(some)
    _, together = jax.vmap(lambda rod: rod.jacobian(PRESSURE, solver=solver, **LOADS))(stacked)
    for k, rod in enumerate(some):
        _, alone = rod.jacobian(PRESSURE, solver=solver, **LOADS)
        for there, here in zip(jax.tree.leaves(together), jax.tree.leaves(alone), strict=True):
            size = float(jnp.max(jnp.abs(here))) if here.size else 0.0
            np.testing.assert_allclose(there[k], here, rtol=0, atol=1e-8 * size)


def test_the_pose_is_differentiated_by_the_dimensions(rods: list[Rod]) -> None:
    rod = rods[1]
    names = ["body_length", "cap_length", "cap_mass", "base_turn", "tip_offset", "tip_draw"]
    here = jnp.array([getattr(rod.actuator, name) for name in names])

    @jax.jit
    def tip(parts: Array) -> Array:
        moved = eqx.tree_at(lambda r: [getattr(r.actuator, name) for name in names], rod, list(parts * here))
        return moved.solve(PRESSURE, throw=False, solver=FixedStep(16, 1e-13), **LOADS).tip_position

    def change(step: float) -> Array:
        ones = jnp.ones(len(names))
        far = [tip(ones.at[k].add(step)) - tip(ones.at[k].add(-step)) for k in range(len(names))]
        return jnp.stack(far, axis=1)

    # Differences of order 4 over a step of 1e-3, of a solve to 1e-13: 7e-12 m, of changes by 2e-5 m and more.
    by_differences = (8.0 * change(1e-3) - change(2e-3)) / 12e-3
    derivative = jax.jacfwd(tip)(jnp.ones(len(names)))
    scale = np.abs(derivative).max(axis=0)
    assert (scale > 1e-6).all()
    np.testing.assert_allclose(derivative / scale, by_differences / scale, rtol=0, atol=1e-6)


def test_what_cannot_be_stacked_is_refused() -> None:
    with pytest.raises(ValueError, match=r"^rods: got none, expected at least one$"):
        rodmodel.stack([])
    linear = Rod(synthetic.linear_law(), synthetic.ACTUATOR, synthetic.DOMAIN, 0.01)
    with pytest.raises(ValueError, match=r"^section: got a LinearLaw, expected a ridge network"):
        rodmodel.stack([linear])


def test_a_stack_of_shipped_layouts_bends_as_each_does() -> None:
    named = [("double-helix", math.radians(45.0)), ("six-helix", 0.0)]
    rods = [rodmodel.load(layout, psi=psi) for layout, psi in named]
    together = of_each(rodmodel.stack(rods))
    for k, rod in enumerate(rods):
        np.testing.assert_allclose(
            together.bending_angle[k], rod.solve(PRESSURE).bending_angle, rtol=0, atol=1e-10
        )
