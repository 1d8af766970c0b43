"""The compiled rod against closed forms, its own order, and an integrator of another kind."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq, fsolve
from scipy.special import ellipe, ellipeinc, ellipk, ellipkinc

import rodmodel
from rodmodel import Actuator, CoreRod, Domain
from rodmodel.core import Handle, Result, ffi

WIDE = Domain((1.0, 1.0, 1.0), 3.0, 1e9)


@pytest.fixture(scope="module")
def column() -> CoreRod:
    """Linear law, EI = GJ = 1, L = 1, no cap."""
    return CoreRod.linear(np.eye(3), np.zeros((3, 3)), Actuator(1.0, 0.0, 0.1, 0.0, 0.0), WIDE)


@pytest.fixture(scope="module")
def shipped() -> CoreRod:
    return rodmodel.load_core("double-helix")


def elastica(force: float) -> tuple[float, float]:
    """Tip (x, z) of a clamped rod along z under a dead tip force along x.

    Bisshopp and Drucker (1945), Q. Appl. Math. 3, 272.
    """
    k = np.sqrt(force)

    def parts(end: float) -> tuple[float, float]:
        modulus = 0.5 * (1.0 + np.sin(end))
        return modulus, np.arcsin(np.sqrt(1.0 / (1.0 + np.sin(end))))

    def length(end: float) -> float:
        modulus, start = parts(end)
        return (ellipk(modulus) - ellipkinc(start, modulus)) / k - 1.0

    end = brentq(length, 1e-9, 0.5 * np.pi - 1e-15)
    modulus, start = parts(end)
    return 1.0 - 2.0 * (ellipe(modulus) - ellipeinc(start, modulus)) / k, np.sqrt(2.0 * np.sin(end)) / k


@pytest.mark.parametrize("force", [1.0, 5.0, 20.0, 40.0, 100.0, 150.0])
def test_the_elastica_bends_as_elliptic_integrals_say(column: CoreRod, force: float) -> None:
    """At 256 steps, to (√F/256)⁴, the steps' error over the boundary layer of 1/√F."""
    solution = column.solve(np.zeros(3), [force, 0.0, 0.0], steps=256)
    x, z = elastica(force)
    tolerance = max(1e-9, (np.sqrt(force) / 256.0) ** 4)
    np.testing.assert_allclose(solution.tip_position, [x, 0.0, z], atol=tolerance)
    assert solution.stable


@pytest.mark.parametrize("force", [20.0, 60.0, 150.0])
def test_steps_that_are_too_few_are_not_called_converged(column: CoreRod, force: float) -> None:
    x, z = elastica(force)
    for steps in (1, 2, 3, 4, 6, 8, 12, 16):
        solution = column.solve(np.zeros(3), [force, 0.0, 0.0], throw=False, steps=steps)
        if solution.converged:
            # Then no step turns by half a radian more or less than it should: the tip is right to 1 %.
            np.testing.assert_allclose(solution.tip_position, [x, 0.0, z], atol=0.01)
        assert not (solution.converged and np.linalg.norm(solution.tip_position) > 1.0)
    coarse = column.solve(np.zeros(3), [force, 0.0, 0.0], throw=False, steps=4)
    assert coarse.result is Result.unresolved


def test_a_column_stands_below_eulers_load_and_is_flagged_above(column: CoreRod) -> None:
    euler = 0.25 * np.pi**2
    below = column.solve(np.zeros(3), [0.0, 0.0, -0.99 * euler])
    np.testing.assert_allclose(below.tip_position, [0.0, 0.0, 1.0], atol=1e-12)
    assert below.stable
    above = column.solve(np.zeros(3), [0.0, 0.0, -1.01 * euler], throw=False)
    assert above.result is Result.unstable
    assert above.load_fraction == pytest.approx(1.0 / 1.01, abs=2e-3)


def test_the_observed_order_is_4(shipped: CoreRod) -> None:
    """Over three doublings, with gravity, a tip force, shear and ends."""
    loads = {"tip_force": [0.02, -0.03, 0.01], "gravity": [3.0, -5.0, 9.81]}
    pressure = [30e3, 12e3, 4e3]
    exact = shipped.solve(pressure, **loads, steps=512).tip_position
    errors = [
        np.linalg.norm(shipped.solve(pressure, **loads, steps=steps).tip_position - exact)
        for steps in (8, 16, 32, 64)
    ]
    orders = np.log2(np.array(errors[:-1]) / np.array(errors[1:]))
    np.testing.assert_allclose(orders, 4.0, atol=0.3)
    assert orders[-1] == pytest.approx(4.0, abs=0.1)


def section_of(handle: Handle, pressure: np.ndarray, u: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    found = ffi.new("rm_section *")
    numbers = (ffi.new("rm_real[3]", list(values)) for values in (u, pressure))
    handle.call.rm_section_at(handle.rod, *numbers, handle.workspace(1), found)
    return np.array(list(found.moment)), np.array(list(found.stiffness)).reshape(3, 3)


def tip_by_scipy(
    rod: CoreRod,
    pressure: np.ndarray,
    mount: np.ndarray,
    offset: np.ndarray,
    start: np.ndarray,
    loads: dict[str, np.ndarray],
) -> np.ndarray:
    """Tip by DOP853 in rotation matrices and `fsolve`, of the equations in Antman (2005), ch. 8.

    The moment itself is the state, and not the curvature; the ends' mount and the
    way from the body's end to the cap's outer face, ``offset``, are given.
    """
    a = rod.actuator
    length = a.bending_length
    force, gravity = loads["tip_force"], loads["gravity"]
    follower, moment = loads["follower_force"], loads["tip_moment"]

    def below(s: float) -> np.ndarray:
        return force + (a.cap_mass + a.mass_per_length * (a.body_length - s)) * gravity

    def integrate(guess: np.ndarray) -> np.ndarray:
        pull = guess[3:]

        def rate(s: float, y: np.ndarray) -> np.ndarray:
            R, u = y[3:12].reshape(3, 3), y[12:15]
            m, K = section_of(rod.handle, pressure, u)
            n = below(s) + pull
            f = R.T @ n
            v = np.array([a.shear_compliance * f[0], a.shear_compliance * f[1], 1.0])
            skew = np.array([[0, -u[2], u[1]], [u[2], 0, -u[0]], [-u[1], u[0], 0]])
            # m' = -r' x n in the world; in the body frame with m = m(u).
            du = np.linalg.solve(K, -np.cross(u, m) - np.cross(v, f))
            return np.concatenate([R @ v, (R @ skew).ravel(), du])

        y0 = np.concatenate([np.zeros(3), mount.ravel(), guess[:3] / length])
        return solve_ivp(rate, (0.0, length), y0, method="DOP853", rtol=1e-11, atol=1e-12).y[:, -1]

    def missing(guess: np.ndarray) -> np.ndarray:
        end = integrate(guess)
        R = end[3:12].reshape(3, 3)
        m, _ = section_of(rod.handle, pressure, end[12:15])
        arm = R @ offset
        # Weights of stiff tip and cap act at their middles.
        stiff = R @ np.array([0.0, 0.0, 0.5 * a.stiff_tip])
        middle = R @ (offset - np.array([0.0, 0.0, 0.5 * a.cap_length]))
        world = moment + np.cross(arm, force + guess[3:])
        world = world + np.cross(stiff, a.mass_per_length * a.stiff_tip * gravity)
        world = world + np.cross(middle, a.cap_mass * gravity)
        return np.concatenate([1e3 * (m - R.T @ world), 1e2 * (R.T @ guess[3:] - follower)])

    root = fsolve(missing, start, xtol=1e-10)
    end = integrate(root)
    return np.asarray(end[:3] + end[3:12].reshape(3, 3) @ offset)


def test_an_independent_integrator_finds_the_same_tips(shipped: CoreRod) -> None:
    """Twelve random loaded states of the shipped law, to 1e-9 of the length at 128 steps."""
    random = np.random.default_rng(5)
    for _ in range(12):
        pressure = random.uniform(0.0, 30e3, 3)
        loads = {
            "tip_force": 0.02 * random.normal(size=3),
            "gravity": 9.81 * random.normal(size=3),
            "follower_force": 0.01 * random.normal(size=3),
            "tip_moment": 2e-4 * random.normal(size=3),
        }
        found = shipped.solve(pressure, **loads, steps=128, throw=False)
        assert found.converged
        arc = shipped.solve(pressure)
        mount = arc.frames(0.0)
        end = arc.frames(0.06)
        # What the pressures preset: the mount, and the way from the arc's end to the cap.
        offset = end.T @ (arc.tip_position - arc_end(arc, shipped))
        tip = tip_by_scipy(shipped, pressure, mount, offset, 1.001 * found.unknown, loads)
        np.testing.assert_allclose(found.tip_position, tip, atol=1e-9 * 0.066)


def arc_end(arc: rodmodel.CoreSolution, rod: CoreRod) -> np.ndarray:
    """End of the body of a rod without loads, from its mount and curvature [m]."""
    u, length = arc.curvature(0.0), rod.actuator.bending_length
    size = np.linalg.norm(u)
    axis, angle = u / size, size * length
    ahead = np.array([0.0, 0.0, 1.0])
    along = np.dot(axis, ahead) * axis
    across = ahead - along
    way = length * along + (np.sin(angle) * across + (1.0 - np.cos(angle)) * np.cross(axis, across)) / size
    return np.asarray(arc.frames(0.0) @ way)
