"""The compiled rod of linear law against closed forms: beams, circles, twist, columns, follower loads."""

import numpy as np
import pytest
from scipy.special import ellipe, ellipk

from rodmodel import Actuator, CoreRod, Domain
from rodmodel.core import Result

EI, GJ = 2.4e-4, 2.1e-4  # [N m²]
LENGTH, CAP = 0.06, 0.006  # [m]
MASS, CAP_MASS = 0.068, 0.73e-3  # [kg/m], [kg]
WIDE = Domain((1e5, 1e5, 1e5), 3e5, 1e3)
NONE = np.zeros(3)


def linear(
    cap_length: float = 0.0,
    mass: float = 0.0,
    cap_mass: float = 0.0,
    shear: float = 0.0,
    scale: float = 1.0,
) -> CoreRod:
    """Rod of constant stiffness, its actuator without ends."""
    actuator = Actuator(LENGTH, cap_length, 0.012, mass, cap_mass, shear_compliance=shear)
    return CoreRod.linear(scale * np.diag([EI, EI, GJ]), 3e-4 * np.eye(3), actuator, WIDE)


@pytest.fixture(scope="module")
def column() -> CoreRod:
    """No cap and no weight."""
    return linear()


@pytest.fixture(scope="module")
def capped() -> CoreRod:
    return linear(CAP, MASS, CAP_MASS)


def test_a_small_end_force_on_the_cap_bends_a_beam(capped: CoreRod) -> None:
    """w = F L³/3EI + F c L²/2EI + φ c, φ = F L²/2EI + F c L/EI; the rest is of the square of the angle."""
    force = 1e-6
    angle = force * (LENGTH**2 / 2 + CAP * LENGTH) / EI
    deflection = force * (LENGTH**3 / 3 + CAP * LENGTH**2 / 2) / EI + angle * CAP
    solution = capped.solve(NONE, [0.0, force, 0.0])
    assert angle < 1e-5
    assert solution.tip_position[1] == pytest.approx(deflection, rel=1e-9)
    assert solution.bending_angle == pytest.approx(angle, rel=1e-9)
    assert np.degrees(solution.bending_plane) == pytest.approx(270.0, abs=1e-9)


def test_a_small_weight_across_bends_a_beam(capped: CoreRod) -> None:
    """Body: w L⁴/8EI, slope w L³/6EI. Cap's weight P at c/2 past the end: a force P and a moment P c/2."""
    g = 1e-5
    w, P = MASS * g, CAP_MASS * g
    M = P * CAP / 2
    angle = (w * LENGTH**3 / 6 + P * LENGTH**2 / 2 + M * LENGTH) / EI
    end = (w * LENGTH**4 / 8 + P * LENGTH**3 / 3 + M * LENGTH**2 / 2) / EI
    solution = capped.solve(NONE, gravity=[g, 0.0, 0.0])
    assert angle < 1e-5
    assert solution.tip_position[0] == pytest.approx(end + angle * CAP, rel=1e-7)
    assert solution.bending_angle == pytest.approx(angle, rel=1e-7)


def test_a_small_end_force_bends_and_shears_a_cantilever() -> None:
    """δ = F L³/3EI + c F L (Timoshenko); the next term is of the square of the slope."""
    force, compliance = 1e-6, 0.3
    tip = linear(shear=compliance).solve(NONE, [force, 0.0, 0.0]).tip_position
    assert tip[0] == pytest.approx(force * (LENGTH**3 / (3.0 * EI) + compliance * LENGTH), rel=1e-9)


@pytest.mark.parametrize("kind", ["tip_moment", "follower_moment"])
@pytest.mark.parametrize("angle_deg", [1, 60, 175, 300, 500])
def test_an_end_moment_bends_a_circle(capped: CoreRod, angle_deg: float, kind: str) -> None:
    """M/EI all along, whatever the size: the axis of bending stays that of the moment."""
    angle = np.radians(angle_deg)
    solution = capped.solve(NONE, **{kind: [0.0, EI * angle / LENGTH, 0.0]}, steps=16)
    radius, c, s = LENGTH / angle, np.cos(angle), np.sin(angle)
    expected = [radius * (1.0 - c) + CAP * s, 0.0, radius * s + CAP * c]
    np.testing.assert_allclose(solution.tip_position, expected, atol=1e-12)
    assert solution.bending_angle == pytest.approx(angle, abs=1e-10)


def test_an_axial_moment_twists_the_rod(capped: CoreRod) -> None:
    moment = 2e-3
    solution = capped.solve(NONE, tip_moment=[0.0, 0.0, moment])
    c, s = np.cos(moment / GJ * LENGTH), np.sin(moment / GJ * LENGTH)
    np.testing.assert_allclose(solution.tip_position, [0.0, 0.0, LENGTH + CAP], atol=1e-15)
    np.testing.assert_allclose(solution.tip_rotation, [[c, -s, 0], [s, c, 0], [0, 0, 1]], atol=1e-10)


def test_a_column_softens_to_its_buckling_load(column: CoreRod) -> None:
    """Under a push P a small force F across deflects it by F/P (tan(kL)/k − L), k² = P/EI.

    That is without bound as P nears Euler's π² EI/4L².
    """
    force = 1e-7
    for part in (0.1, 0.5, 0.9, 0.99):
        push = part * np.pi**2 * EI / (4 * LENGTH**2)
        k = np.sqrt(push / EI)
        deflection = force / push * (np.tan(k * LENGTH) / k - LENGTH)
        solution = column.solve(NONE, [force, 0.0, -push], steps=64)
        assert solution.stable
        assert solution.tip_position[0] == pytest.approx(deflection, rel=1e-6 / (1.0 - part))


def test_past_its_buckling_load_a_column_folds_as_the_elastica(column: CoreRod) -> None:
    """A dead push P turns the free end to θ: √(P L²/EI) = K(sin θ/2), height 2E/K − 1, deflection 2k/K.

    Timoshenko and Gere (1961), Theory of Elastic Stability, art. 2.7. A force across of 1e-6 of the push
    leads the rod there.
    """
    for angle_deg in (60.0, 120.0, 170.0):
        m = np.sin(np.radians(angle_deg) / 2) ** 2
        push = EI * (ellipk(m) / LENGTH) ** 2
        solution = column.solve(NONE, [1e-6 * push, 0.0, -push])
        expected = [2 * np.sqrt(m) / ellipk(m), 0.0, 2 * ellipe(m) / ellipk(m) - 1]
        assert solution.stable
        np.testing.assert_allclose(solution.tip_position / LENGTH, expected, atol=1e-4)


@pytest.mark.parametrize("factor", [1.0 - 1e-3, 1.0 + 1e-3])
def test_a_column_that_shears_buckles_at_haringx_load(factor: float) -> None:
    """P (1 + c P) = π² EI/4L²; Timoshenko and Gere (1961), Theory of Elastic Stability, eq. 2-63."""
    compliance = 3.0  # it takes a third of the load off
    euler = np.pi**2 * EI / (4.0 * LENGTH**2)
    critical = (np.sqrt(1.0 + 4.0 * compliance * euler) - 1.0) / (2.0 * compliance)
    assert critical < 0.8 * euler
    solution = linear(shear=compliance).solve(NONE, [0.0, 0.0, -factor * critical], throw=False)
    assert solution.result is (Result.successful if factor < 1.0 else Result.unstable)
    assert solution.load_fraction == pytest.approx(min(1.0, 1.0 / factor), abs=1e-4)


def test_a_start_beyond_buckling_is_told_to_be_unstable_and_not_taken(column: CoreRod) -> None:
    """The straight column balances any push, and a start from it is near; the solve begins anew still."""
    euler = np.pi**2 * EI / (4.0 * LENGTH**2)
    straight = column.solve(NONE, [0.0, 0.0, -0.5 * euler])
    below = column.solve(NONE, [0.0, 0.0, -0.97 * euler], start=straight)
    assert below.stable
    above = column.solve(NONE, [0.0, 0.0, -1.03 * euler], start=straight, throw=False)
    assert above.result is Result.unstable
    assert above.load_fraction == pytest.approx(1.0 / 1.03, abs=1e-4)


def test_a_follower_force_is_the_dead_force_that_it_has_become(column: CoreRod) -> None:
    for size, angle_deg in ((0.05, 20.0), (0.22, 85.0)):
        follower = np.array([size, 0.0, 0.0])
        solution = column.solve(NONE, follower_force=follower)
        assert np.degrees(solution.bending_angle) > angle_deg
        same = column.solve(NONE, solution.tip_rotation @ follower, start=solution)
        np.testing.assert_allclose(same.tip_position, solution.tip_position, atol=1e-12)
        np.testing.assert_allclose(same.tip_rotation, solution.tip_rotation, atol=1e-10)


def test_a_start_that_dead_loads_would_not_hold_is_left(column: CoreRod) -> None:
    """Past 96° the force that follows the tip holds the rod where the same force, dead, lets it fall over."""
    solution = column.solve(NONE, follower_force=[0.3, 0.0, 0.0])
    assert np.degrees(solution.bending_angle) > 96.0
    assert solution.tip_position[0] > 0.0
    dead = solution.tip_rotation @ [0.3, 0.0, 0.0]
    other = column.solve(NONE, dead, start=solution)
    assert other.stable
    assert other.tip_position[0] < 0.0
    np.testing.assert_allclose(other.tip_position, column.solve(NONE, dead).tip_position, atol=1e-12)


def test_a_distributed_force_is_a_weight() -> None:
    gravity = np.array([3.0, -5.0, -7.0])
    rod = linear(mass=MASS)
    one = rod.solve(NONE, gravity=gravity)
    other = rod.solve(NONE, distributed_force=MASS * gravity)
    np.testing.assert_allclose(other.tip_position, one.tip_position, atol=1e-15)


@pytest.mark.parametrize("scale", [1e6, 1e-6])
def test_stiff_and_soft_sections_under_loads_in_proportion_bend_alike(scale: float) -> None:
    force, pressure = np.array([0.02, -0.03, 0.01]), [40e3, 5e3, 0.0]
    one = linear().solve(pressure, force, steps=8)
    other = linear(scale=scale).solve(pressure, scale * force, steps=8)
    np.testing.assert_allclose(other.tip_position, one.tip_position, rtol=1e-9, atol=1e-14)
