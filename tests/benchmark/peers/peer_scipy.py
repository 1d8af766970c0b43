"""The common problem by SciPy: shooting with `solve_ivp` and `fsolve`, and collocation with `solve_bvp`.

Shooting is given its right side three times: in NumPy, as one writes it first; in plain Python on floats,
which is the fastest form without another package; and compiled by numba. Collocation has its right side
vectorised and its Jacobian in closed form.
"""

import math
from collections.abc import Callable

import numpy as np
from numba import njit
from scipy.integrate import solve_bvp, solve_ivp
from scipy.optimize import fsolve

from tests.benchmark.peers.common_problem import (
    BENDING_STIFFNESS,
    COMPLIANCE,
    FREE_CURVATURE,
    LENGTH,
    TORSION_STIFFNESS,
    WEIGHT,
    Setting,
    Solver,
    Start,
    rate,
)

_FREE = float(FREE_CURVATURE[1])
_SHOTS = [
    *(("RK45", tolerance) for tolerance in (1e-3, 1e-5, 1e-7)),
    *(("DOP853", tolerance) for tolerance in (1e-3, 1e-5, 1e-8, 1e-11)),
    *(("LSODA", tolerance) for tolerance in (1e-4, 1e-6, 1e-9)),
]
_EI, _GJ = BENDING_STIFFNESS, TORSION_STIFFNESS


def _scalar_rate(s, state, fx, fy, fz):
    """`common_problem.rate` for one point, number by number."""
    _, _, _, w, x, y, z, u1, u2, u3 = state
    nz = fz + WEIGHT * (1.0 - s / LENGTH)
    d3x, d3y, d3z = 2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)
    n1 = (1 - 2 * (y * y + z * z)) * fx + 2 * (x * y + w * z) * fy + 2 * (x * z - w * y) * nz
    n2 = 2 * (x * y - w * z) * fx + (1 - 2 * (x * x + z * z)) * fy + 2 * (y * z + w * x) * nz
    m1, m2, m3 = _EI * u1, _EI * (u2 - _FREE), _GJ * u3
    return (
        d3x,
        d3y,
        d3z,
        0.5 * (-x * u1 - y * u2 - z * u3),
        0.5 * (w * u1 + y * u3 - z * u2),
        0.5 * (w * u2 + z * u1 - x * u3),
        0.5 * (w * u3 + x * u2 - y * u1),
        (n2 - (u2 * m3 - u3 * m2)) / _EI,
        (-n1 - (u3 * m1 - u1 * m3)) / _EI,
        -(u1 * m2 - u2 * m1) / _GJ,
    )


_compiled_rate = njit(_scalar_rate)


@njit
def _array_rate(s, state, fx, fy, fz):
    return np.array(_compiled_rate(s, state, fx, fy, fz))


def _plain_rate(s, state, fx, fy, fz):
    return _scalar_rate(s, state.tolist(), fx, fy, fz)


def _numpy_rate(s, state, fx, fy, fz):
    return rate(np.array([s]), state[:, None], np.array([fx, fy, fz]))[:, 0]


class Shooting:
    """`fsolve` for the curvature at the base, `solve_ivp` from there to the tip."""

    def __init__(self, right_side: Callable[..., object], method: str, tolerance: float) -> None:
        self.right_side = right_side
        self.options = {"method": method, "rtol": tolerance, "atol": 0.1 * tolerance}
        self.tolerance = tolerance

    def __call__(self, force: np.ndarray, start: Start | None) -> tuple[np.ndarray, Start]:
        arguments = tuple(force.tolist())

        def end(turn: np.ndarray) -> np.ndarray:
            # Curvatures are shot for as u L, near one, and integrated as they are.
            state = np.concatenate([[0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0], turn / LENGTH])
            run = solve_ivp(self.right_side, (0.0, LENGTH), state, args=arguments, **self.options)
            return run.y[:, -1]

        def miss(turn: np.ndarray) -> np.ndarray:
            return LENGTH * (end(turn)[7:] - FREE_CURVATURE)

        guess = LENGTH * FREE_CURVATURE if start is None else start
        # Differences must see through the integration's own error.
        step = max(math.sqrt(1e-16), 0.1 * self.tolerance) ** 0.5
        turn, _, status, message = fsolve(
            miss, guess, xtol=max(self.tolerance, 1e-12), epsfcn=step**2, full_output=True
        )
        if status not in (1, 4, 5):
            raise RuntimeError(f"fsolve: {message}")
        return end(turn)[:3], turn


class Collocation:
    """`solve_bvp`, from the free arc or from the mesh and the values of a neighbouring answer."""

    def __init__(self, tolerance: float, points: int) -> None:
        self.tolerance = tolerance
        mesh = np.linspace(0.0, LENGTH, points)
        turn = 0.5 * _FREE * mesh
        zero = np.zeros_like(mesh)
        self.free = (
            mesh,
            np.stack(
                [
                    (1.0 - np.cos(2.0 * turn)) / _FREE,
                    zero,
                    np.sin(2.0 * turn) / _FREE,
                    np.cos(turn),
                    zero,
                    np.sin(turn),
                    zero,
                    zero,
                    zero + _FREE,
                    zero,
                ]
            ),
        )
        clamp = np.array([0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0])
        self.ends = lambda base, tip: np.concatenate([base[:7] - clamp, tip[7:] - FREE_CURVATURE])
        by_base, by_tip = np.eye(10), np.zeros((10, 10))
        by_base[7:] = 0.0
        by_tip[7:, 7:] = np.eye(3)
        self.ends_slope = lambda base, tip: (by_base, by_tip)

    def __call__(self, force: np.ndarray, start: Start | None) -> tuple[np.ndarray, Start]:
        mesh, states = self.free if start is None else start
        answer = solve_bvp(
            lambda s, state: rate(s, state, force),
            self.ends,
            mesh,
            states,
            fun_jac=lambda s, state: rate_slope(s, state, force),
            bc_jac=self.ends_slope,
            tol=self.tolerance,
            max_nodes=20_000,
        )
        if answer.status != 0:
            raise RuntimeError(f"solve_bvp: {answer.message}")
        return answer.y[:3, -1], (answer.x, answer.y)


def rate_slope(s: np.ndarray, state: np.ndarray, force: np.ndarray) -> np.ndarray:
    """Derivative (10, 10, points) of `common_problem.rate` by the state."""
    w, x, y, z = state[3:7]
    u = state[7:10]
    n1, n2 = force[0], force[1]
    n3 = force[2] + WEIGHT * (1.0 - s / LENGTH)
    o = np.zeros_like(w)
    slope = np.zeros((10, 10, w.size))
    slope[:3, 3:7] = 2.0 * np.array([[y, z, w, x], [-x, -w, z, y], [o, -2 * x, -2 * y, o]])
    slope[3:7, 3:7] = 0.5 * np.array(
        [[o, -u[0], -u[1], -u[2]], [u[0], o, u[2], -u[1]], [u[1], -u[2], o, u[0]], [u[2], u[1], -u[0], o]]
    )
    slope[3:7, 7:10] = 0.5 * np.array([[-x, -y, -z], [w, -z, y], [z, w, -x], [-y, x, w]])
    first = [z * n2 - y * n3, y * n2 + z * n3, -2 * y * n1 + x * n2 - w * n3, -2 * z * n1 + w * n2 + x * n3]
    second = [-z * n1 + x * n3, y * n1 - 2 * x * n2 + w * n3, x * n1 + z * n3, -w * n1 - 2 * z * n2 + y * n3]
    slope[7, 3:7] = 2.0 * COMPLIANCE[0] * np.array(second)
    slope[8, 3:7] = -2.0 * COMPLIANCE[1] * np.array(first)
    # −u × K (u − û) with K = diag(EI, EI, GJ) and û along the second axis.
    m2 = _EI * (u[1] - _FREE)
    slope[7, 7:10] = COMPLIANCE[0] * np.array([o, (_EI - _GJ) * u[2], m2 - _GJ * u[1]])
    slope[8, 7:10] = COMPLIANCE[1] * np.array([(_GJ - _EI) * u[2], o, (_GJ - _EI) * u[0]])
    slope[9, 7:10] = COMPLIANCE[2] * np.array([_EI * u[1] - m2, o, o])
    return slope


def settings() -> list[Setting]:
    """Every setting that is timed."""
    forms = [
        ("NumPy", _numpy_rate, [("RK45", 1e-3), ("RK45", 1e-6), ("DOP853", 1e-8)]),
        ("floats", _plain_rate, _SHOTS),
        ("numba", _array_rate, _SHOTS),
    ]

    def shooting(right_side: Callable[..., object], method: str, tolerance: float) -> Callable[[], Solver]:
        return lambda: Shooting(right_side, method, tolerance)

    def collocation(tolerance: float, points: int) -> Callable[[], Solver]:
        return lambda: Collocation(tolerance, points)

    made = [
        Setting(
            f"solve_ivp + fsolve, {form}",
            f"{method}, {tolerance:.0e}",
            shooting(right_side, method, tolerance),
        )
        for form, right_side, shots in forms
        for method, tolerance in shots
    ]
    made += [
        Setting("solve_bvp", f"{points} points, {tolerance:.0e}", collocation(tolerance, points))
        for points, tolerance in [(5, 1e-2), (6, 1e-3), (8, 1e-4), (10, 1e-6), (20, 1e-8)]
    ]
    return made
