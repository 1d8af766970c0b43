"""What every equilibrium of the rod must keep, whatever its law: balances, invariants, symmetries."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from rodmodel import Rod, Solution, TurnedLaw
from tests.unit.rodmodel import synthetic

# JAX compiles each of these rods; `test_core_against_reference.py` holds the C core to be the same.
pytestmark = pytest.mark.slow

LENGTH, CAP = synthetic.ACTUATOR.body_length, synthetic.ACTUATOR.cap_length
PRESSURE = jnp.array([35e3, 20e3, 5e3])
FORCE = jnp.array([0.02, -0.03, -0.01])
MOMENT = jnp.array([3e-4, -2e-4, 5e-4])
GRAVITY = jnp.array([3.0, -5.0, -7.0])
MIRROR = np.diag([1.0, -1.0, 1.0])


@pytest.fixture(scope="module")
def rod() -> Rod:
    return synthetic.rod(synthetic.bending_law())


@pytest.fixture(scope="module")
def loaded(rod: Rod) -> Solution:
    return rod.solve(PRESSURE, tip_force=FORCE, tip_moment=MOMENT, gravity=GRAVITY)


def moments(rod: Rod, solution: Solution, s: np.ndarray) -> np.ndarray:
    """Moment R ∂Π/∂u along the rod, world frame."""
    bodies = jax.vmap(rod.section.moment, (0, None))(solution.curvature(s), PRESSURE)
    return np.einsum("nij,nj->ni", solution.frames(s), bodies)


def test_the_moment_balances_all_that_hangs_on_the_section(rod: Rod, loaded: Solution) -> None:
    """m(s) = M + (r_tip − r) × F + (r_cap − r) × m_c g + ∫ₛᴸ (r(σ) − r(s)) × μ g dσ, by another rule."""
    actuator = synthetic.ACTUATOR
    s = np.array([0.0, 0.013, 0.04, 0.06])
    x, w = np.polynomial.legendre.leggauss(20)
    tip, middle = np.asarray(loaded.tip_position), np.asarray(loaded.centreline(LENGTH + CAP / 2))
    m = moments(rod, loaded, s)
    for k, position in enumerate(np.asarray(loaded.centreline(s))):
        half = 0.5 * (LENGTH - s[k])
        above = np.asarray(loaded.centreline(s[k] + half * (1.0 + x))) - position
        weight = np.cross(half * w @ above, actuator.mass_per_length * np.asarray(GRAVITY))
        cap = np.cross(middle - position, actuator.cap_mass * np.asarray(GRAVITY))
        expected = MOMENT + np.cross(tip - position, FORCE) + cap + weight
        # Moments here are of 2e-3 N m; 1e-8 of the bending stiffness per length is 4e-11.
        np.testing.assert_allclose(m[k], expected, atol=4e-11)


def test_without_weight_the_rod_keeps_its_hamiltonian(rod: Rod) -> None:
    """u·m − Π + n·d₃ is the same all along a uniform rod under end loads, as energy is of a spinning top."""
    solution = rod.solve(PRESSURE, FORCE, MOMENT, jnp.zeros(3))
    s = np.linspace(0.0, LENGTH, 9)
    u = solution.curvature(s)
    law = rod.section.at(PRESSURE)
    kept = (
        jnp.sum(u * jax.vmap(law.moment)(u), axis=1)
        - jax.vmap(law.energy)(u)
        + jnp.asarray(solution.frames(s))[:, :, 2] @ FORCE
    )
    change = jnp.sum(u * jax.vmap(law.moment)(u), axis=1)
    assert np.ptp(change) > 1e-3
    np.testing.assert_allclose(kept, kept[0], atol=1e-8 * np.ptp(change))


@pytest.mark.parametrize("left_out", [0, 1, 2])
def test_each_kind_of_load_matters(rod: Rod, loaded: Solution, left_out: int) -> None:
    loads = [FORCE, MOMENT, GRAVITY]
    loads[left_out] = jnp.zeros(3)
    assert loaded.converged
    less = rod.solve(PRESSURE, *loads)
    assert np.linalg.norm(less.tip_position - loaded.tip_position) > 5e-4


def test_a_turn_by_120_degrees_renumbers_the_chambers(rod: Rod) -> None:
    """The rod of a winding turned by 120°, under pressures and loads turned with it, is the rod turned."""
    turn = np.array([[-0.5, -np.sqrt(0.75), 0.0], [np.sqrt(0.75), -0.5, 0.0], [0.0, 0.0, 1.0]])
    turned_rod = synthetic.rod(TurnedLaw(rod.section, 1))
    for loads, tolerance in (((), 1e-13), ((FORCE, MOMENT, GRAVITY), 1e-9)):
        one = rod.solve(PRESSURE, *loads)
        other = turned_rod.solve(jnp.roll(PRESSURE, 1), *(turn @ load for load in loads))
        np.testing.assert_allclose(other.tip_position, turn @ one.tip_position, atol=tolerance * LENGTH)
        np.testing.assert_allclose(other.tip_rotation, turn @ one.tip_rotation @ turn.T, atol=tolerance)
        np.testing.assert_allclose(other.bending_angle, one.bending_angle, atol=tolerance)
        plane = np.mod(one.bending_plane + 2.0 * np.pi / 3.0, 2.0 * np.pi)
        np.testing.assert_allclose(other.bending_plane, plane, atol=10 * tolerance)
        np.testing.assert_allclose(other.chamber_volume, np.roll(one.chamber_volume, 1), rtol=tolerance)


def test_the_mirror_swaps_chambers_2_and_3(rod: Rod) -> None:
    """Pressures and loads mirrored at y = 0: the rod is its mirror image. A moment is mirrored as an area."""
    swapped = PRESSURE[jnp.array([0, 2, 1])]
    one = rod.solve(PRESSURE, FORCE, MOMENT, GRAVITY)
    other = rod.solve(swapped, MIRROR @ FORCE, -MIRROR @ MOMENT, MIRROR @ GRAVITY)
    np.testing.assert_allclose(other.tip_position, MIRROR @ one.tip_position, atol=1e-12 * LENGTH)
    np.testing.assert_allclose(other.tip_rotation, MIRROR @ one.tip_rotation @ MIRROR, atol=1e-12)
    np.testing.assert_allclose(other.bending_plane, 2.0 * np.pi - one.bending_plane, atol=1e-11)
    np.testing.assert_allclose(other.chamber_volume[jnp.array([0, 2, 1])], one.chamber_volume, rtol=1e-12)

    free, mirrored = rod.solve(PRESSURE), rod.solve(swapped)
    # Without loads to rounding, as the law itself is mirrored.
    np.testing.assert_allclose(mirrored.tip_position, MIRROR @ free.tip_position, atol=1e-14)


def test_chambers_2_and_3_alike_bend_in_the_plane_of_the_mirror(rod: Rod) -> None:
    solution = rod.solve([0.0, 40e3, 40e3])
    assert abs(solution.tip_position[1]) < 1e-14
    np.testing.assert_allclose(solution.bending_plane, np.pi, atol=1e-12)
