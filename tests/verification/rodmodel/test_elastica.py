"""Loaded rods of linear law against closed forms: beams, elastica, columns, moments."""

from dataclasses import replace

import jax.numpy as jnp
import numpy as np
import pytest
from scipy.optimize import brentq
from scipy.special import ellipe, ellipeinc, ellipk, ellipkinc

from rodmodel import RESULTS, Actuator, Adaptive, Domain, FixedStep, LinearLaw, Rod
from rodmodel.statics import Loads
from rodmodel.statics._equilibrium import Equilibrium
from rodmodel.statics._loads import resultants
from rodmodel.statics._solve import solve_equilibrium
from tests.unit.rodmodel import synthetic

# JAX compiles each of these rods; `test_core_against_reference.py` holds the C core to be the same.
pytestmark = pytest.mark.slow

LENGTH = synthetic.ACTUATOR.body_length
STIFFNESS = synthetic.BENDING_STIFFNESS
BARE = replace(synthetic.ACTUATOR, cap_length=0.0, cap_mass=0.0)

# What the integration promises, relative to the length: ten times its error between steps of tolerance 1e-10.
EXACT = 1e-8

# A load of nothing: one compilation serves moments and weights.
NONE = np.zeros(3)


@pytest.fixture(scope="module")
def rod() -> Rod:
    """Straight rod of linear law without a cap."""
    return Rod(synthetic.linear_law(), BARE, synthetic.DOMAIN, 0.0)


@pytest.fixture(scope="module")
def capped() -> Rod:
    return synthetic.rod(synthetic.linear_law())


def elastica(end_angle: float) -> tuple[float, float, float]:
    """Load α = F L²/EI, deflection and height over L of a cantilever whose end turns by an angle under a dead
    force F across it.

    With k² = (1 + sin θ)/2 and sin φ = 1/(k √2): √α = K(k) − F(φ, k), deflection 1 − 2 (E(k) − E(φ, k))/√α,
    height √(2 sin θ/α) (Bisshopp and Drucker 1945, Q. Appl. Math. 3, 272).
    """
    m = 0.5 * (1.0 + np.sin(end_angle))
    phi = np.arcsin(np.sqrt(0.5 / m))
    root = ellipk(m) - ellipkinc(phi, m)
    deflection = 1.0 - 2.0 * (ellipe(m) - ellipeinc(phi, m)) / root
    return root**2, deflection, np.sqrt(2.0 * np.sin(end_angle)) / root


@pytest.mark.parametrize("end_angle_deg", [0.1, 5, 20, 45, 70, 85])
@pytest.mark.parametrize("azimuth_deg", [0, 130])
def test_a_cantilever_under_an_end_force_is_the_elastica(
    rod: Rod, end_angle_deg: float, azimuth_deg: float
) -> None:
    alpha, deflection, height = elastica(np.radians(end_angle_deg))
    direction = np.array([np.cos(np.radians(azimuth_deg)), np.sin(np.radians(azimuth_deg)), 0.0])
    solution = rod.solve(np.zeros(3), tip_force=alpha * STIFFNESS / LENGTH**2 * direction)
    expected = LENGTH * (deflection * direction + np.array([0.0, 0.0, height]))
    np.testing.assert_allclose(solution.tip_position, expected, atol=EXACT * LENGTH)
    np.testing.assert_allclose(solution.bending_angle, np.radians(end_angle_deg), atol=EXACT)
    # The moment at the base balances the force at its arm, the height.
    np.testing.assert_allclose(
        np.linalg.norm(solution.curvature(0.0)) * LENGTH, alpha * height, atol=EXACT * alpha
    )


def test_a_small_end_force_on_the_cap_bends_a_beam(capped: Rod) -> None:
    """w = F L³/3EI + F c L²/2EI + φ c, φ = F L²/2EI + F c L/EI; the rest is of the square of the angle."""
    c, force = synthetic.ACTUATOR.cap_length, 1e-6
    angle = force * (LENGTH**2 / 2 + c * LENGTH) / STIFFNESS
    deflection = force * (LENGTH**3 / 3 + c * LENGTH**2 / 2) / STIFFNESS + angle * c
    solution = capped.solve(np.zeros(3), tip_force=[0.0, force, 0.0])
    assert angle < 1e-5
    np.testing.assert_allclose(solution.tip_position[1], deflection, rtol=1e-6)
    np.testing.assert_allclose(solution.bending_angle, angle, rtol=1e-6)
    np.testing.assert_allclose(np.degrees(solution.bending_plane), 270.0, atol=1e-6)


def test_a_small_weight_across_bends_a_beam(capped: Rod) -> None:
    """Body: w L⁴/8EI, slope w L³/6EI. Cap's weight P at c/2 past the end: a force P and a moment P c/2."""
    a, c, g = synthetic.ACTUATOR, synthetic.ACTUATOR.cap_length, 1e-5
    w, P = a.mass_per_length * g, a.cap_mass * g
    M = P * c / 2
    angle = (w * LENGTH**3 / 6 + P * LENGTH**2 / 2 + M * LENGTH) / STIFFNESS
    end = (w * LENGTH**4 / 8 + P * LENGTH**3 / 3 + M * LENGTH**2 / 2) / STIFFNESS
    solution = capped.solve(np.zeros(3), NONE, NONE, [g, 0.0, 0.0])
    assert angle < 1e-5
    np.testing.assert_allclose(solution.tip_position[0], end + angle * c, rtol=1e-6)
    np.testing.assert_allclose(solution.bending_angle, angle, rtol=1e-6)


@pytest.mark.parametrize("angle_deg", [1, 60, 175, 300, 500])
def test_an_end_moment_bends_a_circle(capped: Rod, angle_deg: float) -> None:
    """M/EI all along, whatever the size: the axis of bending stays that of the moment."""
    angle = np.radians(angle_deg)
    moment = STIFFNESS * angle / LENGTH
    solution = capped.solve(np.zeros(3), NONE, [0.0, moment, 0.0], NONE)
    radius, c = LENGTH / angle, synthetic.ACTUATOR.cap_length
    expected = [
        radius * (1 - np.cos(angle)) + c * np.sin(angle),
        0.0,
        radius * np.sin(angle) + c * np.cos(angle),
    ]
    np.testing.assert_allclose(solution.tip_position, expected, atol=EXACT * LENGTH)
    np.testing.assert_allclose(solution.bending_angle, angle, atol=EXACT * max(1.0, angle))


def test_an_axial_moment_twists_the_rod(capped: Rod) -> None:
    moment = 2e-3
    twist = moment / (STIFFNESS * synthetic.TORSION_RATIO)
    solution = capped.solve(np.zeros(3), NONE, [0.0, 0.0, moment], NONE)
    np.testing.assert_allclose(solution.tip_position, [0.0, 0.0, 0.066], atol=1e-16)
    c, s = np.cos(twist * LENGTH), np.sin(twist * LENGTH)
    np.testing.assert_allclose(solution.tip_rotation, [[c, -s, 0], [s, c, 0], [0, 0, 1]], atol=EXACT)


def test_a_column_softens_to_its_buckling_load(rod: Rod) -> None:
    """Under a push P along it, a small force F across the end of a clamped column deflects it by
    F/P (tan(kL)/k − L), k² = P/EI: without bound as P nears π² EI/4L²."""
    force = 1e-5
    for part in (0.1, 0.5, 0.9):
        push = part * np.pi**2 * STIFFNESS / (4 * LENGTH**2)
        k = np.sqrt(push / STIFFNESS)
        deflection = force / push * (np.tan(k * LENGTH) / k - LENGTH)
        solution = rod.solve(np.zeros(3), tip_force=[force, 0.0, -push])
        # Steps err by 1e-10 of a u L that is here of 1e-4, and nine tenths of the load make ten times that.
        np.testing.assert_allclose(solution.tip_position[0], deflection, rtol=1e-6 / (1.0 - part))


def test_past_its_buckling_load_a_column_folds_as_the_elastica(rod: Rod) -> None:
    """A dead push P turns the free end to θ: √(P L²/EI) = K(sin θ/2), height 2E/K − 1, deflection 2k/K
    (Timoshenko and Gere 1961, Theory of Elastic Stability, art. 2.7). A force across of 1e-6 of the push
    leads the rod there, and moves the answer by little more; the straight column, which also balances the
    push, is not taken, at up to 12 times the first load that buckles it."""
    for angle_deg in (60.0, 120.0, 178.5):
        m = np.sin(np.radians(angle_deg) / 2) ** 2
        push = STIFFNESS * (ellipk(m) / LENGTH) ** 2
        solution = rod.solve(np.zeros(3), tip_force=[1e-6 * push, 0.0, -push])
        assert solution.converged
        np.testing.assert_allclose(solution.tip_position[0] / LENGTH, 2 * np.sqrt(m) / ellipk(m), atol=1e-4)
        np.testing.assert_allclose(
            solution.tip_position[2] / LENGTH, 2 * ellipe(m) / ellipk(m) - 1, atol=1e-4
        )


def test_a_column_without_a_side_to_go_to_stops_where_it_buckles(rod: Rod) -> None:
    buckling = np.pi**2 * STIFFNESS / (4 * LENGTH**2)
    solution = rod.solve(np.zeros(3), tip_force=[0.0, 0.0, -3.0 * buckling], throw=False)
    assert not solution.converged
    np.testing.assert_allclose(solution.stats["load_fraction"], 1.0 / 3.0, atol=2.0**-15)
    np.testing.assert_allclose(solution.tip_position, [0.0, 0.0, LENGTH], atol=EXACT * LENGTH)


def test_a_large_force_does_not_send_the_rod_to_another_equilibrium(rod: Rod) -> None:
    """A long load step would end in a coil; the rod that grows with the load leans towards the force."""
    for alpha, end_angle in ((elastica(np.radians(a))[0], a) for a in (60, 80, 88, 89.5)):
        solution = rod.solve(np.zeros(3), tip_force=[alpha * STIFFNESS / LENGTH**2, 0.0, 0.0])
        np.testing.assert_allclose(np.degrees(solution.bending_angle), end_angle, atol=1e-6)


def elastica_of(alpha: float) -> np.ndarray:
    """Tip over L under a load α; the end's angle is sought as its distance from 90 degrees, e to a power."""

    def at(power: float) -> tuple[float, float, float]:
        return elastica(0.5 * np.pi - np.exp(power))

    _, deflection, height = at(brentq(lambda power: at(power)[0] - alpha, -16.0, np.log(0.5 * np.pi - 1e-9)))
    return np.array([deflection, 0.0, height])


@pytest.fixture(scope="module")
def unit_rod() -> Rod:
    """EI = GJ = L = 1, without a cap."""
    law = LinearLaw(jnp.eye(3), jnp.zeros((3, 3)))
    return Rod(law, Actuator(1.0, 0.0, 0.1, 0.0, 0.0), Domain((1.0, 1.0, 1.0), 3.0, 1e9), 0.0)


FORCES = [1.0, 5.0, 10.0, 20.0, 40.0, 60.0, 80.0, 100.0, 125.0, 150.0]


def test_large_forces_are_solved_and_to_the_tolerance(unit_rod: Rod) -> None:
    """Shooting grows what a step errs by, by up to exp √α: it is 1e-10, and the answer a hundred times that
    at the most."""
    for alpha in FORCES:
        solution = unit_rod.solve(np.zeros(3), tip_force=[alpha, 0.0, 0.0])
        assert solution.converged
        assert solution.stable
        np.testing.assert_allclose(solution.tip_position, elastica_of(alpha), atol=EXACT)


# Too few, and just enough; `test_core_statics.py` has more of them.
@pytest.mark.parametrize("steps", [*(pytest.param(n, marks=pytest.mark.slow) for n in (2, 4, 8)), 16, 32])
def test_steps_that_are_too_few_are_flagged(unit_rod: Rod, steps: int) -> None:
    """What comes back as converged is right to what steps of order 4 can do for a curve over 1/√α of L."""
    answers = []
    for alpha in FORCES:
        found = unit_rod.solve(np.zeros(3), [alpha, 0.0, 0.0], solver=FixedStep(steps), throw=False)
        assert np.linalg.norm(found.tip_position) < 1.02
        if found.converged:
            error = np.linalg.norm(found.tip_position - elastica_of(alpha))
            assert error < 0.02 * min(1.0, (np.sqrt(alpha) / steps) ** 4)
        else:
            assert found.result == RESULTS.unresolved
        answers.append(bool(found.converged))
    # Where a load is too large, so are all above it; enough steps do them all.
    assert answers == sorted(answers, reverse=True)
    assert all(answers) is (steps >= 32)
    assert answers[0]


@pytest.mark.parametrize("part", [0.3, 0.9])
def test_a_push_below_buckling_leaves_the_leaning_rod_stable(unit_rod: Rod, part: float) -> None:
    """Sideways force 1e-4: deflection F/P (tan k/k − 1), k² = P; the next term is of its square."""
    push, force = part * np.pi**2 / 4.0, 1e-4
    for solver in (Adaptive(), FixedStep(16)):
        solution = unit_rod.solve(np.zeros(3), tip_force=[force, 0.0, -push], solver=solver)
        assert solution.stable
        k = np.sqrt(push)
        expected = force / push * (np.tan(k) / k - 1.0)
        np.testing.assert_allclose(solution.tip_position[0], expected, rtol=2e-4)


def test_the_error_falls_with_the_tolerance() -> None:
    """The error of a step is held below the tolerance, on states of order one. Shooting and the
    interpolation between steps make more of it, here up to some hundred times. A step of Dopri8 errs by h⁹,
    its interpolation by h⁸, so a hundredth of the tolerance makes about 100^(-8/9) = 1/60 of the error; 1/5
    where few steps are taken and their number jumps."""
    law = synthetic.bending_law()
    pressure, force = jnp.array([30e3, 10e3, 0.0]), jnp.array([0.1, 0.05, 0.05])
    loads = resultants(Loads(tip_force=force), synthetic.ACTUATOR, force.dtype)
    problem = Equilibrium(law.at(pressure), loads, synthetic.ACTUATOR, jnp.zeros(3))

    def states(tolerance: float) -> np.ndarray:
        position, rotation, turn = solve_equilibrium(problem, None, Adaptive(tolerance)).nodes
        return np.concatenate([position, rotation.reshape(-1, 9), turn], axis=1)

    reference = states(1e-13)
    errors = []
    for tolerance in (1e-8, 1e-10, 1e-12):
        errors.append(np.abs(states(tolerance) - reference).max())
        assert errors[-1] < 300.0 * tolerance
    assert errors[1] < 0.2 * errors[0]
    assert errors[2] < 0.2 * errors[1]
