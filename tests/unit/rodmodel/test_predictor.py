"""The compiled predictor: what it takes and gives, warm starts, no retracing, several devices."""

import os
import subprocess
import sys

import numpy as np
import pytest

from rodmodel import FixedStep, Predictor, Rod
from tests.unit.rodmodel import synthetic

PRESSURE = np.array([40e3, 15e3, 5e3])
FORCE = np.array([0.01, -0.02, 0.005])
SOLVER = FixedStep(steps=6, tolerance=1e-9)


@pytest.fixture(scope="module")
def rod() -> Rod:
    return synthetic.rod(synthetic.bending_law())


@pytest.fixture(scope="module")
def predictor(rod: Rod) -> Predictor:
    return rod.predictor(("tip_force",), solver=SOLVER, batch=(3,))


def test_it_predicts_what_the_rod_solves(rod: Rod, predictor: Predictor) -> None:
    expected = rod.solve(PRESSURE, FORCE, solver=SOLVER)
    predictor.reset()
    for _ in range(2):  # cold, then warm
        found = predictor(PRESSURE, tip_force=FORCE)
        assert found.converged
        assert found.stable
        assert found.in_domain
        np.testing.assert_allclose(found.tip_position, expected.tip_position, atol=1e-10)
        np.testing.assert_allclose(found.tip_rotation, expected.tip_rotation, atol=1e-9)
        np.testing.assert_allclose(found.bending_angle, expected.bending_angle, atol=1e-9)
        np.testing.assert_allclose(found.bending_plane, expected.bending_plane, atol=1e-8)


def test_a_batch_is_its_rows_and_a_bad_row_is_flagged_alone(predictor: Predictor) -> None:
    rows = np.stack([PRESSURE, [np.nan, 0.0, 0.0], 0.5 * PRESSURE])
    found = predictor(rows, tip_force=FORCE)
    np.testing.assert_array_equal(found.converged, [True, False, True])
    assert np.all(np.isnan(found.tip_position[1]))
    for row in (0, 2):
        predictor.reset()
        alone = predictor(rows[row], tip_force=FORCE)
        np.testing.assert_allclose(found.tip_position[row], alone.tip_position, atol=1e-13)


def test_no_call_traces_again(predictor: Predictor) -> None:
    before = predictor.compilations
    for scale in np.linspace(0.5, 1.0, 5):
        predictor(scale * PRESSURE, tip_force=FORCE)
        predictor(np.tile(scale * PRESSURE, (3, 1)), tip_force=FORCE)
    assert predictor.compilations == before == 2


def test_a_warm_start_after_a_jump_of_the_load_is_as_good_as_a_cold_one(predictor: Predictor) -> None:
    predictor.reset()
    cold = predictor(PRESSURE, tip_force=FORCE)
    predictor(np.zeros(3), tip_force=-5.0 * FORCE)
    np.testing.assert_allclose(
        predictor(PRESSURE, tip_force=FORCE).tip_position, cold.tip_position, atol=1e-10
    )


def test_bad_arguments_are_named(rod: Rod, predictor: Predictor) -> None:
    with pytest.raises(ValueError, match="loads: got 'wind', expected any of tip_force"):
        Predictor(rod, ("wind",))
    with pytest.raises(ValueError, match=r"loads: got \[\], expected \['tip_force'\]"):
        predictor(PRESSURE)
    with pytest.raises(ValueError, match=r"pressure: got shape \(2,\), expected"):
        predictor(PRESSURE[:2], tip_force=FORCE)


@pytest.mark.slow
def test_a_batch_is_spread_over_devices() -> None:
    """In a process that takes the processor for two devices: the rows are those of one device."""
    script = """
import jax, numpy as np
jax.config.update("jax_enable_x64", True)
from rodmodel import FixedStep
from tests.unit.rodmodel import synthetic
rod = synthetic.rod(synthetic.linear_law())
rows = np.random.default_rng(0).uniform(0.0, 30e3, (5, 3))
force = np.array([0.01, -0.02, 0.005])
one = rod.predictor(("tip_force",), solver=FixedStep(4))(rows, tip_force=force)
two = rod.predictor(("tip_force",), solver=FixedStep(4), devices=jax.devices())(rows, tip_force=force)
assert len(jax.devices()) == 2 and two.converged.all()
np.testing.assert_allclose(two.tip_position, one.tip_position, atol=1e-14)
"""
    environment = {**os.environ, "XLA_FLAGS": "--xla_force_host_platform_device_count=2"}
    run = subprocess.run(
        [sys.executable, "-c", script], env=environment, capture_output=True, text=True, check=False
    )
    assert run.returncode == 0, run.stderr


@pytest.mark.slow
def test_the_jacobian_of_a_law_of_ridges_is_that_of_differences() -> None:
    """By pressure; a central difference of 20 Pa errs by 1e-7 of it or less, and by rounding."""
    predictor = synthetic.rod(synthetic.ridge_law()).predictor(solver=FixedStep(8, tolerance=1e-12))
    pressure = np.array([20e3, 5e3, 1e3])
    _, found = predictor.jacobian(pressure)
    step = 20.0 * np.eye(3)
    ends = [[predictor(pressure + sign * e).tip_position for e in step] for sign in (1.0, -1.0)]
    slope = (np.array(ends[0]) - np.array(ends[1])).T / 40.0
    np.testing.assert_allclose(found.position_by_pressure, slope, atol=1e-6 * np.abs(slope).max())
