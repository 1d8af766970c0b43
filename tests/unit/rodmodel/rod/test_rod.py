"""The rod's public face: what it takes, refuses, flags and returns."""

import json
import os
import subprocess
import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

import rodmodel
from rodmodel import RESULTS, CoreRod, CurvatureLaw, FixedStep, LinearLaw, Rod, SectionLaw, Solution
from tests.unit.rodmodel import synthetic

PRESSURE = np.array([40e3, 15e3, 5e3])
FORCE = np.array([0.01, -0.02, 0.005])


@pytest.fixture(scope="module")
def rod() -> Rod:
    return synthetic.rod(synthetic.bending_law())


@pytest.fixture(scope="module")
def within(rod: Rod) -> Callable[[jax.Array], Solution]:
    """The solve within another compiled function."""
    return jax.jit(rod.solve)


@pytest.fixture(scope="module")
def loaded(rod: Rod) -> Solution:
    return rod.solve(PRESSURE, tip_force=FORCE)


def assert_same(one: Solution, other: Solution, tolerance: float = 1e-13) -> None:
    for a, b in zip(jax.tree.leaves(one), jax.tree.leaves(other), strict=True):
        np.testing.assert_allclose(a, b, rtol=tolerance, atol=1e-2 * tolerance)


@pytest.mark.parametrize("pressure", [[40e3, 15e3], 40e3, np.zeros((3, 1)), [1.0, 2.0, 3.0, 4.0], []])
def test_a_pressure_that_is_not_three_numbers_is_refused(rod: Rod, pressure: object) -> None:
    with pytest.raises(ValueError, match=r"pressure: got shape .*, expected \(3,\): three gauge pressures"):
        rod.solve(pressure)


@pytest.mark.parametrize("load", ["tip_force", "tip_moment", "gravity"])
def test_a_load_that_is_not_three_numbers_is_refused(rod: Rod, load: str) -> None:
    with pytest.raises(ValueError, match=rf"{load}: got shape \(2,\), expected \(3,\): three components"):
        rod.solve(PRESSURE, **{load: [0.0, 1.0]})


def test_a_pressure_that_is_no_number_is_refused(rod: Rod) -> None:
    with pytest.raises(ValueError, match=r"pressure: got array\(.*, expected three gauge pressures"):
        rod.solve(np.array(["a", "b", "c"]))


@pytest.mark.parametrize(
    ("pressure", "said"),
    [
        ([-1.0, 0.0, 0.0], "negative value or one that is not finite"),
        ([np.nan, 0.0, 0.0], "negative value or one that is not finite"),
        ([0.0, np.inf, 0.0], "negative value or one that is not finite"),
        ([71e3, 0.0, 0.0], "at most 70000, 60000, 60000 Pa in chambers 1, 2, 3 and 100000 Pa in sum"),
        ([0.0, 61e3, 0.0], "more than the calibration covers"),
        ([60e3, 41e3, 0.0], "more than the calibration covers"),
    ],
)
def test_bad_values_raise(rod: Rod, within: Callable, pressure: list[float], said: str) -> None:
    with pytest.raises(RuntimeError, match=said):
        rod.solve(pressure)
    with pytest.raises(RuntimeError, match=said):
        jax.block_until_ready(within(jnp.array(pressure)))


def test_a_load_that_is_not_finite_raises_or_is_flagged(rod: Rod) -> None:
    with pytest.raises(RuntimeError, match="tip_force, tip_moment or gravity: got a value"):
        rod.solve(PRESSURE, tip_force=[0.0, np.nan, 0.0])
    flagged = rod.solve(PRESSURE, tip_force=[0.0, np.nan, 0.0], throw=False)
    assert not flagged.converged
    assert np.all(np.isnan(flagged.tip_position))


def test_a_bad_pressure_is_flagged_when_not_thrown(rod: Rod) -> None:
    for bad in ([-1.0, 0.0, 0.0], [np.nan, 0.0, 0.0]):
        solution = rod.solve(bad, throw=False)
        assert not solution.converged
        assert not solution.in_domain
        floats = [leaf for leaf in jax.tree.leaves(solution) if eqx.is_inexact_array(leaf)]
        assert all(np.all(np.isnan(leaf)) for leaf in floats)


def test_outside_the_calibration_is_an_extrapolation_without_error_estimate(rod: Rod) -> None:
    inside = rod.solve([70e3, 0.0, 0.0])
    assert inside.in_domain
    assert inside.error_estimate == 0.016
    outside = rod.solve([80e3, 0.0, 0.0], throw=False)
    assert outside.converged
    assert not outside.in_domain
    assert np.isnan(outside.error_estimate)
    assert outside.bending_angle > inside.bending_angle


def test_the_bound_itself_is_inside_whatever_the_unit_it_came_from(rod: Rod) -> None:
    assert rod.solve([0.07 * 1e6, 0.0, 0.0]).in_domain
    assert rod.solve(np.float32([70e3, 0.0, 0.0])).in_domain


def test_a_moment_beyond_the_calibration_is_flagged_and_not_thrown(rod: Rod) -> None:
    weak = rod.solve(PRESSURE, tip_force=[0.0, 0.002, 0.0])
    assert weak.in_domain
    strong = rod.solve(PRESSURE, tip_force=[0.0, 0.1, 0.0])
    assert strong.converged
    assert not strong.in_domain
    assert np.isnan(strong.error_estimate)


def test_a_load_too_large_to_carry_raises_or_returns_what_was_reached(rod: Rod) -> None:
    force = np.array([0.0, 0.0, -30.0])
    with pytest.raises(RuntimeError, match="no equilibrium was found under the full load"):
        rod.solve(np.zeros(3), tip_force=force)
    reached = rod.solve(np.zeros(3), tip_force=force, throw=False)
    assert not reached.converged
    assert reached.result == RESULTS.unstable
    fraction = float(reached.stats["load_fraction"])
    assert 0.0 < fraction < 1.0
    again = rod.solve(np.zeros(3), tip_force=fraction * force, throw=False)
    np.testing.assert_allclose(again.tip_position, reached.tip_position, atol=1e-9)


def test_numpy_lists_and_jax_arrays_are_the_same(rod: Rod) -> None:
    one = rod.solve(PRESSURE)
    assert_same(one, rod.solve(list(PRESSURE)))
    assert_same(one, rod.solve(jnp.array(PRESSURE)))
    assert_same(rod.solve([40e3, 0.0, 0.0]), rod.solve([40_000, 0, 0]))


def test_jit_and_eager_agree(rod: Rod, within: Callable) -> None:
    """The rod's numbers are constants to one, arguments to the other."""
    one = rod.solve(PRESSURE)
    assert_same(one, within(jnp.array(PRESSURE)))
    assert_same(one, eqx.filter_jit(rod.solve)(PRESSURE))


# A batch has each row's own solution in the test below, and the rod is an argument above.
@pytest.mark.slow
def test_vmap_and_a_rod_as_argument_agree_with_eager(rod: Rod) -> None:
    one = rod.solve(PRESSURE)
    batch = jax.vmap(rod.solve)(jnp.stack([PRESSURE, 0.5 * PRESSURE]))
    assert_same(one, jax.tree.map(lambda leaf: leaf[0], batch), tolerance=1e-12)
    rod_as_argument = jax.jit(lambda rod, pressure: rod.solve(pressure))(rod, PRESSURE)
    for name in ("tip_position", "tip_rotation", "bending_angle", "bending_plane", "chamber_volume"):
        assert_same(getattr(one, name), getattr(rod_as_argument, name), tolerance=1e-12)


def test_rods_are_equal_by_their_arrays_and_hash_without_them(rod: Rod) -> None:
    same, other = synthetic.rod(synthetic.bending_law()), synthetic.rod(synthetic.bending_law("none"))
    assert rod == same
    assert hash(rod) == hash(same) == hash(other)
    assert rod != other


@pytest.mark.parametrize(
    "force", [pytest.param(None, id="free"), pytest.param(FORCE, id="loaded", marks=pytest.mark.slow)]
)
def test_a_bad_row_of_a_batch_leaves_its_neighbours_alone(rod: Rod, force: np.ndarray | None) -> None:
    bad = [np.nan, 0.0, 0.0], [-1.0, 0.0, 0.0]
    pressures = jnp.array([PRESSURE, bad[0], 0.5 * PRESSURE, bad[1], [80e3, 0.0, 0.0], np.zeros(3)])

    def solve(pressure: jax.Array) -> Solution:
        return rod.solve(pressure, tip_force=force, throw=False)

    batch = jax.jit(jax.vmap(solve))(pressures)
    np.testing.assert_array_equal(batch.converged, [True, False, True, False, True, True])
    for row in (0, 2, 4, 5):
        alone = jax.tree.map(lambda leaf, row=row: leaf[row], batch)
        # The steps of the integration are chosen by row, so only roundings differ, grown by shooting.
        assert_same(solve(pressures[row]), alone, tolerance=1e-10)
    assert np.all(np.isnan(batch.tip_position[jnp.array([1, 3])]))

    def total(pressures: jax.Array) -> jax.Array:
        tips = jax.vmap(solve)(pressures).tip_position
        return jnp.sum(jnp.where(jnp.isnan(tips), 0.0, tips))

    slope = jax.jit(jax.grad(total))(pressures)
    assert np.all(np.isfinite(slope))
    np.testing.assert_array_equal(slope[jnp.array([1, 3])], 0.0)
    assert np.all(np.abs(slope[0]) > 0.0)


# In reverse mode the tip is held to it by a row of the batch above.
@pytest.mark.parametrize("derivative", [jax.jacfwd, pytest.param(jax.jacrev, marks=pytest.mark.slow)])
def test_without_pressure_the_rod_is_straight_and_its_derivatives_finite(
    rod: Rod, derivative: Callable
) -> None:
    solution = rod.solve(np.zeros(3))
    np.testing.assert_allclose(solution.tip_position, [0.0, 0.0, 0.066], atol=1e-15)
    np.testing.assert_allclose(solution.tip_rotation, np.eye(3), atol=1e-14)
    np.testing.assert_allclose(solution.bend, 0.0, atol=1e-14)
    names = ("tip_position", "tip_rotation", "bend", "chamber_volume")
    slopes = jax.jit(derivative(lambda p: [getattr(rod.solve(p), name) for name in names]))(jnp.zeros(3))
    assert all(np.all(np.isfinite(slope)) for slope in slopes)


@pytest.mark.parametrize("kind", ["free", "loaded"])
def test_the_shape_ends_in_the_tip(rod: Rod, loaded: Solution, kind: str) -> None:
    solution = loaded if kind == "loaded" else rod.solve(PRESSURE)
    s = np.array([0.0, 0.01, 0.033, 0.06, 0.063, 0.066])
    r, R, u = solution.centreline(s), solution.frames(s), solution.curvature(s)
    assert (r.shape, R.shape, u.shape) == ((6, 3), (6, 3, 3), (6, 3))
    np.testing.assert_allclose(r[0], 0.0, atol=1e-16)
    np.testing.assert_allclose(R[0], np.eye(3), atol=1e-15)
    np.testing.assert_allclose(r[-1], solution.tip_position, atol=1e-15)
    np.testing.assert_allclose(R[-1], solution.tip_rotation, atol=1e-15)
    np.testing.assert_allclose(R @ np.swapaxes(R, 1, 2), np.broadcast_to(np.eye(3), R.shape), atol=1e-14)
    # The cap goes straight on from the end of the body, and is not bent.
    np.testing.assert_allclose(r[4] - r[3], 0.003 * R[3, :, 2], atol=1e-15)
    np.testing.assert_array_equal(u[4:], 0.0)
    assert np.all(np.linalg.norm(u[:4], axis=1) > 1.0)
    assert solution.centreline(0.02).shape == (3,)
    assert solution.frames(np.zeros((2, 5))).shape == (2, 5, 3, 3)


def test_the_shape_is_not_a_number_outside_the_rod(loaded: Solution) -> None:
    assert np.all(np.isnan(loaded.centreline([-1e-6, 0.0661])))
    assert np.all(np.isnan(loaded.curvature(np.nan)))


def test_the_chamber_volume_is_that_of_the_section_along_the_body(rod: Rod, loaded: Solution) -> None:
    free = rod.solve(PRESSURE)
    pressure = jnp.array(PRESSURE)
    section = rod.section.volume(rod.section.free_curvature(pressure), pressure)
    np.testing.assert_allclose(free.chamber_volume, 0.06 * section, rtol=1e-13)
    # Gauss and Legendre's rule of 20 points is exact for what a degree of 24 resolves to rounding.
    x, w = np.polynomial.legendre.leggauss(20)
    along = jax.vmap(rod.section.volume, (0, None))(loaded.curvature(0.03 * (1.0 + x)), pressure)
    np.testing.assert_allclose(loaded.chamber_volume, 0.03 * w @ along, rtol=1e-9)


# `test_core_against_reference.py` holds both, of another law, to be those of the compiled core.
@pytest.mark.slow
def test_where_the_rod_is_straight_only_the_bend_has_a_derivative(rod: Rod) -> None:
    """Angle and plane have none there; elsewhere they are those of the bend, θ = |bend|."""
    solver = FixedStep(16)
    _, straight = rod.jacobian(np.zeros(3), solver=solver)
    for slope in (straight.pressure, straight.tip_force):
        assert np.all(np.isnan(slope.bending_angle))
        assert np.all(np.isnan(slope.bending_plane))
        assert np.all(np.isfinite(slope.bend))
        assert np.abs(slope.bend).max() > 0.0
    solution, bent = rod.jacobian(PRESSURE, FORCE, solver=solver)
    along = np.asarray(solution.bend) / np.linalg.norm(solution.bend)
    across = np.array([-along[1], along[0]]) / np.linalg.norm(solution.bend)
    for slope in (bent.pressure, bent.tip_force):
        scale = np.abs(slope.bend).max()
        np.testing.assert_allclose(slope.bending_angle, along @ slope.bend, atol=1e-10 * scale)
        np.testing.assert_allclose(slope.bending_plane, across @ slope.bend, atol=1e-10 * scale)


class CountedLaw(SectionLaw):
    """A linear law that counts how often it is traced."""

    law: LinearLaw
    times: list[int] = eqx.field(static=True)

    def at(self, pressure: jax.Array) -> CurvatureLaw:
        self.times[0] += 1
        return self.law.at(pressure)


def test_rods_of_one_shape_share_a_compilation() -> None:
    """Scales, lengths and limits are numbers to it, not constants."""
    times, stiffness = [0], synthetic.BENDING_STIFFNESS * jnp.eye(3)
    angles = []
    for factor in (1.0, 1.2):
        law = CountedLaw(LinearLaw(factor * stiffness, jnp.zeros((3, 3)), factor * 15e-6), times)
        actuator = replace(synthetic.ACTUATOR, body_length=factor * 0.06, cap_mass=factor * 1e-3)
        rod = Rod(law, actuator, replace(synthetic.DOMAIN, moment_max=factor), 0.01 * factor)
        angles.append(float(rod.solve(PRESSURE).bend[0] + rod.solve(PRESSURE).tip_position[2]))
        traced = times[0] if factor == 1.0 else traced
    assert times[0] == traced > 0
    assert angles[0] != angles[1]


@pytest.mark.slow
def test_single_precision_is_close_to_double(rod: Rod, loaded: Solution, tmp_path: Path) -> None:
    """In a process that leaves JAX as it comes."""
    rodmodel.save_calibration(synthetic.calibration(), tmp_path / "calibration.json")
    script = f"""
import json, rodmodel
rod = rodmodel.load("double-helix", path={str(tmp_path / "calibration.json")!r})
solutions = [rod.solve({PRESSURE.tolist()}, tip_force=force) for force in (None, {FORCE.tolist()})]
assert all(s.converged and s.tip_position.dtype == "float32" for s in solutions)
print(json.dumps([s.tip_position.tolist() for s in solutions]))
"""
    environment = {name: value for name, value in os.environ.items() if name != "JAX_ENABLE_X64"}
    command = [sys.executable, "-W", "error", "-c", script]
    run = subprocess.run(command, env=environment, capture_output=True, text=True, check=True)
    free, bent = json.loads(run.stdout)
    np.testing.assert_allclose(free, rod.solve(PRESSURE).tip_position, atol=1e-5 * 0.066)
    np.testing.assert_allclose(bent, loaded.tip_position, atol=1e-4 * 0.066)


# The differentiable rod is compiled for each shape of law.
@pytest.mark.parametrize("load", [rodmodel.load_core, pytest.param(rodmodel.load, marks=pytest.mark.slow)])
def test_what_ships_solves(load: Callable[..., Rod | CoreRod]) -> None:
    for calibration in rodmodel.shipped_calibrations():
        layout = calibration.layout
        rod = load(layout.name, 0.77 if layout.psi is None else layout.psi, layout.pitch)
        solution = rod.solve(0.3 * np.array(rod.domain.pressure_max))
        assert solution.converged
