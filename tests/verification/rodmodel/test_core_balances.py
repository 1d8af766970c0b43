"""What every equilibrium of the compiled rod must keep: balances, invariants, work, symmetries."""

import numpy as np
import pytest

import rodmodel
from rodmodel import Calibration, CoreRod, CoreSolution
from rodmodel.io import find
from tests.unit.rodmodel.sections import rod_with, section_at
from tests.verification.rodmodel.test_core_against_reference import LAWS

PRESSURE = np.array([25e3, 12e3, 4e3])
FORCE = np.array([0.01, -0.015, -0.005])
MOMENT = np.array([2e-4, -1e-4, 3e-4])
GRAVITY = np.array([3.0, -5.0, -7.0])
WIND = np.array([0.1, 0.2, -0.1])
MIRROR = np.diag([1.0, -1.0, 1.0])
STEPS = 256
NO_ENDS = {
    "stiff_tip": 0.0,
    "base_turn": 0.0,
    "base_lag": 0.0,
    "tip_offset": 0.0,
    "tip_draw": 0.0,
    "held_length": 0.0,
}


@pytest.fixture(scope="module")
def calibration() -> Calibration:
    return find("double-helix", 0.0, 3e-3).calibration


@pytest.fixture(scope="module")
def shipped(calibration: Calibration) -> CoreRod:
    return rod_with(calibration)


def moments(rod: CoreRod, solution: CoreSolution, s: np.ndarray) -> np.ndarray:
    """Moment R ∂Π/∂u along the rod, world frame."""
    bodies = [section_at(rod.handle, u, PRESSURE).moment for u in solution.curvature(s)]
    return np.einsum("nij,nj->ni", solution.frames(s), bodies)


def test_the_moment_balances_all_that_hangs_on_the_section(calibration: Calibration) -> None:
    """m(s) = M + (r_tip − r) × F + (r_cap − r) × m_c g + ∫ₛᴸ (r(σ) − r(s)) × w dσ, by Gauss' rule.

    Sections shear. The cap lies on the axis here: where it lies beside it, the body's weight keeps acting on
    the arc.
    """
    rod = rod_with(calibration, tip_offset=0.0, tip_draw=0.0)
    a = rod.actuator
    assert a.shear_compliance > 0.0
    assert a.stiff_tip > 0.0
    solution = rod.solve(
        PRESSURE, FORCE, MOMENT, GRAVITY, distributed_force=WIND, follower_moment=MOMENT, steps=STEPS
    )
    s = np.array([0.0, 0.013, 0.04, 0.0575])
    x, w = np.polynomial.legendre.leggauss(16)
    tip, middle = solution.tip_position, solution.centreline(a.body_length + 0.5 * a.cap_length)
    per_length = a.mass_per_length * GRAVITY + WIND
    found = moments(rod, solution, s)
    for k, position in enumerate(solution.centreline(s)):
        expected = MOMENT + solution.tip_rotation @ MOMENT + np.cross(tip - position, FORCE)
        expected = expected + np.cross(middle - position, a.cap_mass * GRAVITY)
        # The curvature ends where the tip is stiff.
        for start, end in ((s[k], a.bending_length), (a.bending_length, a.body_length)):
            half = 0.5 * (end - start)
            above = solution.centreline(start + half * (1.0 + x)) - position
            expected = expected + np.cross(half * w @ above, per_length)
        np.testing.assert_allclose(found[k], expected, atol=1e-10 * np.abs(found).max())


def test_forces_on_a_cap_that_lies_aside_balance_too(shipped: CoreRod) -> None:
    """m(s) = (r_tip − r) × (F + R_tip F_f), r on the arc: the axis less its share of the offset."""
    follower = np.array([0.004, 0.002, -0.008])
    solution = shipped.solve(PRESSURE, FORCE, follower_force=follower, steps=STEPS)
    s = np.array([0.0, 0.02, 0.042])
    a, frame = shipped.actuator, solution.tip_rotation
    end = solution.centreline(a.bending_length)
    beside = solution.tip_position - a.tip_length * frame[:, 2] - end
    assert np.abs(beside).max() < 1e-15  # the cap is where the axis comes out
    u = shipped.solve(PRESSURE).curvature(0.0)
    size = a.tip_offset / np.hypot(a.tip_offset_curvature, np.hypot(u[0], u[1]))
    offset = np.array([-size * u[1], size * u[0], -a.tip_draw * (u[0] ** 2 + u[1] ** 2)])
    x = s / a.bending_length
    aside = (x**2 * (3.0 - 2.0 * x))[:, None] * (solution.frames(s) @ offset)
    arms = solution.tip_position - (solution.centreline(s) - aside)
    expected = np.cross(arms, FORCE + solution.tip_rotation @ follower)
    found = moments(shipped, solution, s)
    np.testing.assert_allclose(found, expected, atol=1e-10 * np.abs(found).max())


def test_the_rod_keeps_its_hamiltonian(calibration: Calibration) -> None:
    """u·m − Π + n·d₃ + c |f⊥|²/2 + w·r is the same all along a rod under a uniform load w.

    As energy is of a spinning top; the last but one is of the shear, f⊥ the force across the section.
    """
    rod = rod_with(calibration, tip_offset=0.0, tip_draw=0.0)
    a = rod.actuator
    solution = rod.solve(PRESSURE, FORCE, MOMENT, GRAVITY, distributed_force=WIND, steps=STEPS)
    s = np.linspace(0.0, a.bending_length, 9)
    per_length = a.mass_per_length * GRAVITY + WIND
    kept, varied = [], []
    for at, u, R, r in zip(s, solution.curvature(s), solution.frames(s), solution.centreline(s), strict=True):
        section = section_at(rod.handle, u, PRESSURE)
        n = FORCE + a.cap_mass * GRAVITY + (a.body_length - at) * per_length
        f = R.T @ n
        varied.append(u @ section.moment - section.energy)
        across = 0.5 * a.shear_compliance * (f[0] ** 2 + f[1] ** 2)
        kept.append(varied[-1] + f[2] + across + per_length @ r)
    np.testing.assert_allclose(kept, kept[0], atol=1e-10 * np.ptp(varied))


def test_the_work_of_loads_and_pressures_is_in_the_energy(calibration: Calibration) -> None:
    """∫ (Π + c |f⊥|²/2) ds at the end of a path is ∫ (F·dr + M·ω − V·dp) along it, without ends.

    What the ends store is of the pressures alone, and no part of the API tells it.

    Along the path by Gauss' rule; forces and chamber volumes, and the derivatives of the pose.
    """
    rod = rod_with(calibration, **NO_ENDS)
    length, shear = rod.actuator.body_length, rod.actuator.shear_compliance
    x, w = np.polynomial.legendre.leggauss(16)
    work = 0.0
    for t, weight in zip(0.5 * (1.0 + x), 0.5 * w, strict=True):
        # The pressures and the loads grow in different proportions.
        pressure, force, moment = t * PRESSURE, t**2 * FORCE, t * (2.0 - t) * MOMENT
        rates = {"pressure": PRESSURE, "tip_force": 2.0 * t * FORCE, "tip_moment": 2.0 * (1.0 - t) * MOMENT}
        solution, jacobian = rod.jacobian(pressure, force, moment, steps=64)
        way = sum(jacobian.tip_position[name] @ rate for name, rate in rates.items())
        turn = sum(jacobian.tip_turn[name] @ rate for name, rate in rates.items())
        work += weight * (force @ way + moment @ turn - solution.chamber_volume @ PRESSURE)
    end = rod.solve(PRESSURE, FORCE, MOMENT, steps=64)
    energy = 0.0
    for s, weight in zip(0.5 * length * (1.0 + x), 0.5 * length * w, strict=True):
        across = (end.frames(s).T @ FORCE)[:2]
        energy += weight * section_at(rod.handle, end.curvature(s), PRESSURE).energy
        energy += weight * 0.5 * shear * (across @ across)
    assert energy == pytest.approx(work, rel=1e-10)


def test_around_a_loop_no_work_is_done(shipped: CoreRod) -> None:
    """∮ (F·dr − V·dp) = 0 for dead forces, under gravity.

    The trapezoidal rule on a closed path errs by less than any power of its points.
    """
    total, size = 0.0, 0.0
    for t in 2.0 * np.pi * np.arange(40) / 40:
        c, s = np.cos(t), np.sin(t)
        pressure = np.array([20e3 + 10e3 * c, 10e3 + 8e3 * s, 5e3])
        force = np.array([0.01 * s, 0.01 * c, 0.005 * s])
        solution, jacobian = shipped.jacobian(pressure, force, None, GRAVITY, steps=64)
        dp, df = np.array([-10e3 * s, 8e3 * c, 0.0]), np.array([0.01 * c, -0.01 * s, 0.005 * c])
        way = jacobian.tip_position["pressure"] @ dp + jacobian.tip_position["tip_force"] @ df
        rates = force @ way, -solution.chamber_volume @ dp
        total += sum(rates)
        size += np.abs(rates).max()
    assert abs(total) < 1e-10 * size


@pytest.mark.parametrize("law", LAWS, ids=str)
def test_volumes_change_with_a_force_as_the_tip_does_with_pressures(law: tuple[str, float, float]) -> None:
    """∂V/∂F = (∂x/∂p)ᵀ, under gravity: second derivatives of one energy, ends included.

    Differences of order 6 over 1 mN, an eighth of the force: what they leave out is 1e-8 and less.
    """
    rod = rodmodel.load_core(*law)
    rng = np.random.default_rng(3)
    for _ in range(4):
        share = rng.dirichlet(np.ones(3))
        p, force, gravity = 4.5e4 * rng.uniform() * share, 4e-3 * rng.normal(size=3), 5.0 * rng.normal(size=3)
        _, jacobian = rod.jacobian(p, force, None, gravity, steps=128)
        expected = jacobian.tip_position["pressure"].T
        by_force = np.zeros((3, 3))
        for axis, unit in enumerate(np.eye(3)):
            moved = [
                rod.solve(p, force + 1e-3 * n * unit, None, gravity, steps=128).chamber_volume
                for n in (1, -1, 2, -2, 3, -3)
            ]
            differences = moved[0] - moved[1], moved[2] - moved[3], moved[4] - moved[5]
            by_force[:, axis] = (45.0 * differences[0] - 9.0 * differences[1] + differences[2]) / 60e-3
        np.testing.assert_allclose(by_force, expected, atol=1e-8 * np.abs(expected).max())


def test_compliance_is_symmetric(shipped: CoreRod) -> None:
    """The Hessian of an energy, by a dead force, under gravity."""
    _, jacobian = shipped.jacobian(PRESSURE, FORCE, None, GRAVITY, steps=128)
    compliance = jacobian.tip_position["tip_force"]
    np.testing.assert_allclose(compliance, compliance.T, atol=1e-9 * np.abs(compliance).max())


def test_the_mirror_swaps_chambers_2_and_3(shipped: CoreRod) -> None:
    """Pressures and loads mirrored at y = 0: the rod is its mirror image. A moment is mirrored as an area."""
    swap = [0, 2, 1]
    one = shipped.solve(PRESSURE, FORCE, MOMENT, GRAVITY)
    other = shipped.solve(PRESSURE[swap], MIRROR @ FORCE, -MIRROR @ MOMENT, MIRROR @ GRAVITY)
    np.testing.assert_allclose(other.tip_position, MIRROR @ one.tip_position, atol=1e-13)
    np.testing.assert_allclose(other.tip_rotation, MIRROR @ one.tip_rotation @ MIRROR, atol=1e-12)
    np.testing.assert_allclose(other.bend, [one.bend[0], -one.bend[1]], atol=1e-12)
    np.testing.assert_allclose(other.chamber_volume[swap], one.chamber_volume, rtol=1e-12)


def test_rings_are_the_same_from_each_chamber() -> None:
    rod = rod_with(find("ring", 0.0, 3e-3).calibration)
    half, root = -0.5, np.sqrt(0.75)
    turn = np.array([[half, -root, 0.0], [root, half, 0.0], [0.0, 0.0, 1.0]])
    one = rod.solve(PRESSURE, FORCE, MOMENT, GRAVITY)
    other = rod.solve(np.roll(PRESSURE, 1), turn @ FORCE, turn @ MOMENT, turn @ GRAVITY)
    np.testing.assert_allclose(other.tip_position, turn @ one.tip_position, atol=1e-13)
    np.testing.assert_allclose(other.tip_rotation, turn @ one.tip_rotation @ turn.T, atol=1e-12)
    np.testing.assert_allclose(other.chamber_volume, np.roll(one.chamber_volume, 1), rtol=1e-12)
