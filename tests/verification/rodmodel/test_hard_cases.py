"""The two solvers against each other and against what must hold where rods are difficult.

Each load and each number of steps is compiled by itself. What the compiled core is held to as well, in
`test_core_closed_forms.py`, `test_core_statics.py` and `test_core_robustness.py`, is slow here.
"""

from dataclasses import replace

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import rodmodel
from rodmodel import RESULTS, Adaptive, FixedStep, LinearLaw, Rod, Solution
from tests.unit.rodmodel import synthetic

# JAX compiles each of these rods; `test_core_against_reference.py` holds the C core to be the same.
pytestmark = pytest.mark.slow

LENGTH = synthetic.ACTUATOR.body_length
BARE = replace(synthetic.ACTUATOR, cap_length=0.0, cap_mass=0.0)
PRESSURE = np.array([40e3, 15e3, 5e3])
FORCE = np.array([0.02, -0.03, 0.01])
GRAVITY = np.array([3.0, -5.0, -7.0])


@pytest.fixture(scope="module")
def rod() -> Rod:
    return synthetic.rod(synthetic.bending_law())


@pytest.fixture(scope="module")
def column() -> Rod:
    """Straight bare rod of linear law."""
    law = LinearLaw(jnp.diag(jnp.array([2.0, 2.0, 1.6]) * 1e-4), jnp.zeros((3, 3)))
    return Rod(law, BARE, synthetic.DOMAIN, 0.0)


EULER = np.pi**2 * 2e-4 / (4.0 * LENGTH**2)


@pytest.mark.parametrize("steps", [pytest.param(1, marks=pytest.mark.slow), 3])
def test_constant_curvature_is_exact_at_any_number_of_steps(rod: Rod, steps: int) -> None:
    """Rounding, grown by a few steps, at 300 degrees in one step too."""
    for scale in (1.0, 2.5):
        pressure = scale * np.array([60e3, 10e3, 0.0])
        arc = rod.solve(pressure, throw=False)
        stepped = rod.solve(pressure, tip_force=np.zeros(3), solver=FixedStep(steps), throw=False)
        np.testing.assert_allclose(stepped.tip_position, arc.tip_position, atol=1e-12 * LENGTH)
        np.testing.assert_allclose(stepped.tip_rotation, arc.tip_rotation, atol=1e-12)


def test_the_fixed_steps_are_of_order_4(rod: Rod) -> None:
    """Error at the tip against many steps: halved steps make it sixteen times smaller, ± 15 %."""
    exact = rod.solve(PRESSURE, FORCE, solver=Adaptive(1e-12)).tip_position
    errors = [
        np.linalg.norm(rod.solve(PRESSURE, FORCE, solver=FixedStep(steps)).tip_position - exact)
        for steps in (8, 16, 32)
    ]
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    np.testing.assert_allclose(orders, 4.0, atol=0.2)


MANY = 10_000

# Curvature per pressure [1/(m kPa)]: chamber k bends the rod away from its azimuth, about an axis across it.
CHAMBERS = np.array([[0.0, 0.5, -0.5], [-0.6, 0.3, 0.3], [0.0, 0.0, 0.0]])


def solve_all(
    rod: Rod, cases: tuple[np.ndarray, np.ndarray, np.ndarray], solver: FixedStep | Adaptive
) -> dict[str, np.ndarray]:
    """One case after the other: all in one batch take gigabytes, and as many iterations as the hardest."""

    def one(case: tuple[jax.Array, jax.Array, jax.Array]) -> dict[str, jax.Array]:
        pressure, force, gravity = case
        solution = rod.solve(pressure, force, gravity=gravity, solver=solver, throw=False)
        return {
            "tip_position": solution.tip_position,
            "bending_angle": solution.bending_angle,
            "converged": solution.converged,
            "successful": solution.result == RESULTS.successful,
            "in_domain": solution.in_domain,
        }

    found = jax.jit(lambda cases: jax.lax.map(one, cases))(cases)
    return {name: np.asarray(values) for name, values in found.items()}


def random_cases(rod: Rod, count: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Pressures over the domain, tip forces to 0.05 N and gravity in any direction."""
    random = np.random.default_rng(7)
    pressure = random.uniform(0.0, 1.0, (count, 3)) * rod.domain.pressure_max
    domain, total = rod.domain, pressure.sum(axis=1)
    beside = domain.beside_share * total + (1.0 - domain.beside_share) * pressure.max(axis=1)
    excess = np.maximum(np.maximum(total / domain.pressure_sum_max, beside / domain.beside_max), 1.0)
    directions = random.standard_normal((2, count, 3))
    directions /= np.linalg.norm(directions, axis=2, keepdims=True)
    force = 0.05 * random.uniform(0.0, 1.0, (count, 1)) * directions[0]
    return pressure / excess[:, None], force, 9.81 * directions[1]


def test_random_cases_of_a_convex_law_converge(column: Rod) -> None:
    """From a cold start, to about 130 degrees: 99.9 % converge, the others are flagged, no NaN."""
    section = LinearLaw(column.section.section_stiffness, 1e-3 * jnp.array(CHAMBERS))
    rod = Rod(section, synthetic.ACTUATOR, rodmodel.load("double-helix").domain, 0.0)
    found = solve_all(rod, random_cases(rod, MANY), FixedStep(8))
    assert np.mean(found["converged"]) >= 0.999
    assert np.all(np.isfinite(found["tip_position"]))
    assert np.all(np.isfinite(found["bending_angle"]))
    np.testing.assert_array_equal(found["successful"], found["converged"])


def test_random_cases_of_the_shipped_law_agree_or_are_flagged() -> None:
    """From a cold start 99.9 % converge; the others are flagged; there is no NaN.
    Where both solvers are inside the calibration, tips agree to 1e-5 of the length, with 64 steps, for soft
    rods: of 10 000 cases one has 4e-5 with 32, and order 4 leaves a sixteenth of that with twice as many.

    Half of those 10 000 take both solvers two to three minutes, one after the other. That is enough to tell
    0.1 %, which is five of them."""
    rod = rodmodel.load("double-helix")
    cases = tuple(values[: MANY // 2] for values in random_cases(rod, MANY))
    fixed, adaptive = (solve_all(rod, cases, solver) for solver in (FixedStep(64), Adaptive()))
    for found in (fixed, adaptive):
        assert np.all(np.isfinite(found["tip_position"]))
        assert np.mean(~found["converged"]) <= 0.001
        np.testing.assert_array_equal(found["successful"], found["converged"])
    inside = np.logical_and.reduce(
        [found[name] for found in (fixed, adaptive) for name in ("in_domain", "converged")]
    )
    assert inside.mean() > 0.99
    apart = np.linalg.norm(fixed["tip_position"] - adaptive["tip_position"], axis=1)[inside]
    assert apart.max() < 1e-5 * LENGTH


def test_an_equilibrium_past_buckling_is_told_to_be_unstable(column: Rod) -> None:
    """The straight column is an equilibrium under any push; it is a minimum below Euler's load alone."""
    straight = column.solve(np.zeros(3), tip_force=[0.0, 0.0, 0.0], solver=FixedStep(8))
    for part, stable in ((0.97, True), (1.03, False)):
        push = [0.0, 0.0, -part * EULER]
        kept = column.solve(np.zeros(3), tip_force=push, solver=FixedStep(8), start=straight)
        assert kept.converged
        assert bool(kept.stable) is stable
        np.testing.assert_allclose(kept.tip_position, [0.0, 0.0, LENGTH], atol=1e-12)
    refused = column.solve(np.zeros(3), tip_force=push, solver=FixedStep(8), throw=False)
    assert not refused.converged
    assert refused.result == RESULTS.unstable
    np.testing.assert_allclose(refused.stats["load_fraction"], 1.0 / 1.03, atol=1e-4)


def test_a_follower_load_past_90_degrees_is_the_dead_load_that_it_has_become(column: Rod) -> None:
    angles = []
    for size in (0.05, 0.3):
        follower = np.array([size, 0.0, 0.0])
        solution = column.solve(np.zeros(3), follower_force=follower, solver=FixedStep(16))
        dead = solution.tip_rotation @ follower
        same = column.solve(np.zeros(3), tip_force=dead, solver=FixedStep(16), start=column_start(solution))
        np.testing.assert_allclose(same.tip_position, solution.tip_position, atol=1e-9 * LENGTH)
        np.testing.assert_allclose(same.tip_rotation, solution.tip_rotation, atol=1e-9)
        angles.append(np.degrees(solution.bending_angle))
    assert angles[1] > 90.0


def column_start(solution: rodmodel.Solution) -> rodmodel.Solution:
    """Start without the follower force among its unknowns."""
    return replace(solution, unknown=solution.unknown[:3])


def test_a_follower_moment_is_a_circle(column: Rod) -> None:
    """400 degrees, about the rod's own axis of bending: M/EI all along."""
    moment = 2e-4 * np.radians(400.0) / LENGTH
    solution = column.solve(np.zeros(3), follower_moment=[0.0, moment, 0.0], solver=FixedStep(8))
    np.testing.assert_allclose(np.degrees(solution.bending_angle), 400.0, atol=1e-7)


def test_the_base_may_stand_anywhere(rod: Rod) -> None:
    """Loads turned with the base: the same rod, moved; θ and γ are seen from the base."""
    x, y = np.radians([50.0, -130.0])
    turn = np.array([[1, 0, 0], [0, np.cos(x), -np.sin(x)], [0, np.sin(x), np.cos(x)]]) @ np.array(
        [[np.cos(y), 0, np.sin(y)], [0, 1, 0], [-np.sin(y), 0, np.cos(y)]]
    )
    place, wind = np.array([0.3, -0.2, 0.1]), np.array([0.0, 0.4, 0.0])

    def solve(base: np.ndarray, *loads: np.ndarray, turned: np.ndarray, throw: bool = True) -> Solution:
        force, gravity, wind = loads
        return rod.solve(
            PRESSURE,
            force,
            None,
            gravity,
            throw,
            distributed_force=wind,
            base_position=base,
            base_rotation=turned,
            solver=FixedStep(8),
        )

    one = solve(np.zeros(3), FORCE, GRAVITY, wind, turned=np.eye(3))
    other = solve(place, turn @ FORCE, turn @ GRAVITY, turn @ wind, turned=turn)
    np.testing.assert_allclose(other.tip_position, place + turn @ one.tip_position, atol=1e-12)
    np.testing.assert_allclose(other.tip_rotation, turn @ one.tip_rotation, atol=1e-11)
    np.testing.assert_allclose(other.bending_angle, one.bending_angle, atol=1e-11)
    np.testing.assert_allclose(other.centreline(0.03), place + turn @ one.centreline(0.03), atol=1e-12)
    bad = solve(place, FORCE, GRAVITY, wind, turned=2.0 * turn, throw=False)
    assert bad.result == RESULTS.bad_input


def test_a_distributed_force_is_a_weight(column: Rod) -> None:
    weight = BARE.mass_per_length * GRAVITY
    one = column.solve(np.zeros(3), gravity=GRAVITY, solver=FixedStep(8))
    other = column.solve(np.zeros(3), distributed_force=weight, solver=FixedStep(8))
    np.testing.assert_allclose(other.tip_position, one.tip_position, atol=1e-14)


@pytest.mark.parametrize("factor", [1e3, 1e-3])
def test_stiff_and_soft_sections_under_loads_in_proportion_bend_alike(factor: float) -> None:
    def bent(scale: float) -> rodmodel.Solution:
        law = LinearLaw(scale * jnp.diag(jnp.array([2.0, 2.0, 1.6]) * 1e-4), 3e-4 * jnp.eye(3))
        rod = Rod(law, BARE, synthetic.DOMAIN, 0.0)
        return rod.solve([40e3, 5e3, 0.0], tip_force=scale * FORCE, solver=FixedStep(8))

    np.testing.assert_allclose(bent(factor).tip_position, bent(1.0).tip_position, rtol=1e-9, atol=1e-12)


def test_the_jacobian_is_that_of_central_differences(rod: Rod) -> None:
    """Also along the rod; and the compliance is symmetric, the Hessian of an energy."""
    solve = jax.jit(lambda p, f: rod.solve(p, f, gravity=GRAVITY, solver=FixedStep(64), throw=False))
    solution, jacobian = rod.jacobian(PRESSURE, FORCE, gravity=GRAVITY, arc_lengths=[0.03])
    assert solution.converged
    for step, at, derivative in (
        (70.0, lambda e: solve(PRESSURE + e, FORCE), jacobian.pressure),
        (1e-4, lambda e: solve(PRESSURE, FORCE + e), jacobian.tip_force),
    ):
        columns, middles = [], []
        for e in step * np.eye(3):
            near, far = (at(e), at(-e)), (at(2 * e), at(-2 * e))
            parts = [a.tip_position - b.tip_position for a, b in (near, far)]
            columns.append((8 * parts[0] - parts[1]) / (12 * step))
            parts = [a.centreline(0.03) - b.centreline(0.03) for a, b in (near, far)]
            middles.append((8 * parts[0] - parts[1]) / (12 * step))
        scale = np.abs(columns).max()
        np.testing.assert_allclose(derivative.tip_position, np.transpose(columns), atol=1e-6 * scale)
        np.testing.assert_allclose(derivative.positions[0], np.transpose(middles), atol=1e-6 * scale)
    compliance = np.asarray(jacobian.tip_force.tip_position)
    np.testing.assert_allclose(compliance, compliance.T, atol=1e-6 * np.abs(compliance).max())


def test_an_integration_that_runs_out_of_steps_is_flagged_and_finite(rod: Rod) -> None:
    """No step is short enough for this tolerance; what comes back is the rod without the loads."""
    loads = {"tip_force": jnp.array([0.0, 0.02, 0.0]), "gravity": jnp.array([0.0, 0.0, 9.81])}
    starved = rod.solve([20e3, 0.0, 10e3], **loads, throw=False, solver=Adaptive(1e-30))
    assert not starved.converged
    assert starved.result == RESULTS.unresolved
    assert starved.stats["load_fraction"] == 0.0
    free = rod.solve([20e3, 0.0, 10e3])
    np.testing.assert_allclose(starved.tip_position, free.tip_position, atol=1e-14)
    np.testing.assert_allclose(starved.centreline(0.03), free.centreline(0.03), atol=1e-14)


def test_too_many_integrations_are_told(column: Rod) -> None:
    """A force that the rod takes in steps too small for the bound on them."""
    found = column.solve(np.zeros(3), tip_force=[3e3 * EULER, 0.0, 0.0], solver=FixedStep(64), throw=False)
    assert not found.converged
    assert found.result in (RESULTS.too_many_shots, RESULTS.unresolved)
