"""The bound in a solution: compiled and differentiable rods agree; derivatives, batches and stacks."""

from dataclasses import replace

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import rodmodel
from rodmodel import ErrorBound, FixedStep, Rod
from tests.unit.rodmodel import synthetic

BOUND = ErrorBound((0.0, 20e3, 45e3), (0.004, 0.008, 0.03), (1e-4, 3e-4, 2e-3), 5.0, 0.2)
# Nodes between the angles of the states below.
BY_BEND = replace(
    BOUND, bending_angle=(0.15, 0.3, 0.6), angle_by_bend=(0.0, 0.01, 0.04), tip_by_bend=(0.0, 1e-4, 1e-3)
)
STEPS = 16
FORCE = (0.003, 0.006, -0.002)


@pytest.fixture(scope="module")
def rod() -> Rod:
    return Rod(synthetic.bending_law(), synthetic.ACTUATOR, synthetic.DOMAIN, BOUND)


def test_compiled_and_differentiable_rods_state_the_same(tmp_path):
    """Of a law that ships, with pressures and angles on both sides of the nodes, without and with loads."""
    shipped = next(c for c in rodmodel.shipped_calibrations() if c.layout.name == "ring")
    rodmodel.save_calibration(replace(shipped, bound=BY_BEND), tmp_path / "ring.json")
    rods = [load("ring", path=tmp_path / "ring.json") for load in (rodmodel.load, rodmodel.load_core)]
    differentiable, compiled = rods
    random = np.random.default_rng(3)
    pressures = random.uniform(0.0, 30e3, (8, 3)) * [1.0, 0.5, 0.3]
    forces = random.uniform(-0.01, 0.01, (8, 3))
    solve = jax.jit(
        lambda p, f: differentiable.solve(
            p, tip_force=f, throw=False, solver=FixedStep(steps=STEPS, tolerance=1e-13)
        )
    )
    found = compiled.solve_many(pressure=pressures, tip_force=forces, steps=STEPS, tolerance=1e-13)
    for row, (p, f) in enumerate(zip(pressures, forces, strict=True)):
        one = solve(p, f)
        assert bool(one.in_domain)
        np.testing.assert_allclose(one.error_estimate, found[row]["angle_error"], rtol=0.0, atol=1e-12)
        np.testing.assert_allclose(one.tip_error_estimate, found[row]["tip_error"], rtol=0.0, atol=1e-12)
        # A load adds what its moment on the base says, and a bend what it says.
        bent, moment = (float(found[row][name]) for name in ("bending_angle", "base_moment"))
        angle, tip = BY_BEND.at(float(p.sum()), moment, bending_angle=bent)
        assert found[row]["base_moment"] > 1e-4
        assert (found[row]["angle_error"], found[row]["tip_error"]) == pytest.approx((angle, tip), rel=1e-12)
        bare = compiled.solve(p)
        expected, _ = BY_BEND.at(float(p.sum()), bending_angle=bare.bending_angle)
        assert bare.error_estimate == pytest.approx(expected, rel=1e-12)
    angles = found["bending_angle"]
    assert all((angles < node).any() and (angles > node).any() for node in BY_BEND.bending_angle)


@pytest.mark.slow
def test_the_bound_has_the_derivatives_of_its_formula(rod: Rod) -> None:
    """Central differences of fourth order; and finite ones without a load, where the moment is zero."""

    @jax.jit
    def both(pressure, force):
        solution = bent.solve(pressure, tip_force=force, throw=False, solver=FixedStep(STEPS))
        return jnp.stack([solution.error_estimate, 1e3 * solution.tip_error_estimate])

    bent = Rod(rod.section, rod.actuator, rod.domain, BY_BEND)
    slopes_of = jax.jit(jax.jacfwd(both, (0, 1)))
    given = [jnp.array([12e3, 3e3, 1e3]), jnp.array(FORCE)]
    for argument, (slopes, step) in enumerate(zip(slopes_of(*given), (20.0, 1e-5), strict=True)):
        for k in range(3):

            def at(times, k=k, argument=argument, step=step):
                moved = list(given)
                moved[argument] = moved[argument].at[k].add(times * step)
                return both(*moved)

            expected = (8.0 * (at(1.0) - at(-1.0)) - (at(2.0) - at(-2.0))) / (12.0 * step)
            np.testing.assert_allclose(slopes[:, k], expected, rtol=1e-5, atol=1e-9)
    assert all(np.isfinite(slopes).all() for slopes in slopes_of(given[0], jnp.zeros(3)))
    # Less bent than the first node of the bend there is the slope between the first two of the pressures:
    # 0.004 rad and 0.2 mm over 20 kPa.
    given[0] = jnp.array([2e3, 1e3, 1e3])
    by_pressure, _ = slopes_of(given[0], jnp.zeros(3))
    np.testing.assert_allclose(by_pressure, np.outer([0.2e-6, 1e-5], np.ones(3)), rtol=1e-6)


def test_batches_and_stacks_state_the_bound_of_each(rod: Rod) -> None:
    """A bound of several nodes, one that grows with the bend, and a constant one."""
    pressures = jnp.array([[5e3, 0.0, 0.0], [10e3, 20e3, 0.0], [60e3, 0.0, 0.0], [90e3, 0.0, 0.0]])
    found = jax.vmap(lambda p: rod.solve(p, throw=False))(pressures)
    angle, tip = BOUND.at(np.asarray(pressures).sum(axis=1))
    np.testing.assert_allclose(found.error_estimate[:3], angle[:3], rtol=1e-12)
    np.testing.assert_allclose(found.tip_error_estimate[:3], tip[:3], rtol=1e-12)
    assert np.isnan(found.error_estimate[3])
    assert np.isnan(found.tip_error_estimate[3])
    others = (Rod(rod.section, rod.actuator, rod.domain, bound) for bound in (BY_BEND, 0.03))
    stacked = rodmodel.stack([rod, *others])
    together = jax.vmap(lambda one: one.solve((10e3, 20e3, 0.0), throw=False))(stacked)
    bent = BY_BEND.at(30e3, bending_angle=float(together.bending_angle[1]))
    assert bent[0] > BOUND.at(30e3)[0]
    np.testing.assert_allclose(together.error_estimate, [BOUND.at(30e3)[0], bent[0], 0.03], rtol=1e-12)
    np.testing.assert_allclose(together.tip_error_estimate, [BOUND.at(30e3)[1], bent[1], np.nan], rtol=1e-12)


def test_the_old_names_still_make_and_answer_a_rod(rod: Rod) -> None:
    parts = (rod.section, rod.actuator, rod.domain)
    old = Rod(*parts, angle_error=0.016)
    assert old.error_bound == Rod(*parts, 0.016).error_bound == ErrorBound.constant(0.016)
    with pytest.warns(DeprecationWarning, match="Rod.error_bound"):
        assert rod.angle_error == 0.03
    for arguments, came in (({}, "neither"), ({"error_bound": 0.1, "angle_error": 0.1}, "both")):
        with pytest.raises(TypeError, match=f"error_bound, angle_error: got {came}"):
            Rod(*parts, **arguments)
