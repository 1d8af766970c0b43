"""The problem that every solver is timed on: a hanging, curved rod of linear law, a force across its tip.

A rod of 60 mm hangs along +z from its clamped base. Free of load it is an arc in the plane y = 0 that ends
towards −x; its weight straightens it and a dead force at the tip, along y, bends and twists it out of its
plane. A solve answers for one force. Timed solves go round a cycle of forces that differ by less than 1 %
from one to the next, so that none is answered from memory and a warm start has a neighbour to start from.

The reference integrates the equations below with the method of Dormand and Prince of order 8 at a tolerance
of 1e-13, and shoots with the tangent of the same integration.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
from scipy.integrate import solve_ivp

LENGTH = 0.06  # L [m]
BENDING_STIFFNESS = 2e-4  # EI [N m²]
TORSION_STIFFNESS = BENDING_STIFFNESS / 1.5  # GJ [N m²]
WEIGHT = 73e-3  # of the whole rod, along +z [N]
INTRINSIC_MOMENT = 5.24e-3  # EI times the intrinsic curvature [N m]
TIP_FORCE = 0.02  # along y [N]
GRAVITY = 9.81  # [m/s²]

FREE_CURVATURE = np.array([0.0, -INTRINSIC_MOMENT / BENDING_STIFFNESS, 0.0])  # [1/m]
COMPLIANCE = 1.0 / np.array([BENDING_STIFFNESS, BENDING_STIFFNESS, TORSION_STIFFNESS])  # [1/(N m²)]

_CYCLE = 16
FORCES = [
    np.array([0.0, TIP_FORCE * (1.0 + 0.02 * np.sin(2.0 * np.pi * k / _CYCLE)), 0.0]) for k in range(_CYCLE)
]
"""The cycle of tip forces; the first is that of the problem [N]."""

Start = Any
"""What a solver can start from: its own answer to a neighbouring problem."""


class Solver(Protocol):
    """One solver at one setting."""

    def __call__(self, force: np.ndarray, start: Start | None) -> tuple[np.ndarray, Start]:
        """Solve for one tip force [N], from the free shape where there is no start.

        Returns
        -------
        tip : position of the tip [m], ready: nothing of it is still being computed.
        start : for a neighbouring solve.
        """


@dataclass(frozen=True)
class Setting:
    """A solver, how it is set, and how to make it ready."""

    family: str
    label: str
    make: Callable[[], Solver]


def distance(tip: np.ndarray, other: np.ndarray) -> float:
    """Distance of two tip positions [m]."""
    return float(np.linalg.norm(tip - other))


def cross_z(vector: np.ndarray) -> np.ndarray:
    """Product e₃ × v of rows (3, ...)."""
    return np.stack([-vector[1], vector[0], np.zeros_like(vector[0])])


def rate(s: np.ndarray, state: np.ndarray, force: np.ndarray) -> np.ndarray:
    """Derivatives by arc length of r, q and u; columns are points.

    r' = d₃,   q' = ½ q ⊗ (0, u),   K u' = −u × K (u − û) − e₃ × Rᵀ n,   n = F + W (1 − s/L) e₃
    """
    w, x, y, z = state[3:7]
    u = state[7:10]
    directors = np.stack(
        [
            np.stack([1 - 2 * (y * y + z * z), 2 * (x * y + w * z), 2 * (x * z - w * y)]),
            np.stack([2 * (x * y - w * z), 1 - 2 * (x * x + z * z), 2 * (y * z + w * x)]),
            np.stack([2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)]),
        ]
    )
    weight = WEIGHT * (1.0 - s / LENGTH)
    shear = np.einsum("aix,i->ax", directors, force) + directors[:, 2] * weight
    moment = (u - FREE_CURVATURE[:, None]) / COMPLIANCE[:, None]
    torque = -np.cross(u, moment, axis=0) - cross_z(shear)
    quaternion_rate = 0.5 * np.stack(
        [
            -x * u[0] - y * u[1] - z * u[2],
            w * u[0] + y * u[2] - z * u[1],
            w * u[1] + z * u[0] - x * u[2],
            w * u[2] + x * u[1] - y * u[0],
        ]
    )
    return np.concatenate([directors[2], quaternion_rate, COMPLIANCE[:, None] * torque])


def reference_tip(force: np.ndarray) -> np.ndarray:
    """Tip position to about 1e-12 of the length, by shooting at the tightest tolerance."""
    base = FREE_CURVATURE.copy()
    step = 1e-6
    for _ in range(30):
        # The state and its three neighbours as one system: one step size, so that differences are smooth.
        starts = np.zeros((10, 4))
        starts[3] = 1.0
        starts[7:] = base[:, None] + np.hstack([np.zeros((3, 1)), step * np.eye(3)])
        end = solve_ivp(
            lambda s, y: rate(np.array([s]), y.reshape(10, 4), force).ravel(),
            (0.0, LENGTH),
            starts.ravel(),
            method="DOP853",
            rtol=1e-13,
            atol=1e-14,
        ).y[:, -1]
        ends = end.reshape(10, 4)
        miss = ends[7:, 0] - FREE_CURVATURE
        slope = (ends[7:, 1:] - ends[7:, :1]) / step
        correction = np.linalg.solve(slope, -miss)
        base = base + correction
        if np.max(np.abs(miss)) < 1e-11 * np.max(np.abs(FREE_CURVATURE)):
            return ends[:3, 0]
    raise RuntimeError(f"the reference did not converge: it misses the curvature at the tip by {miss} 1/m")
