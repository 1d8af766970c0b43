"""Where a fit begins: scales from the data, random inner layers, and the outer layer by linear least squares.

Each state gives the free curvature to first order, û ≈ u − K⁻¹ m, the stiffness K, and with both the constant
a. In the features of the random inner layers their dependence on pressure is linear, which saves the
minimiser hundreds of iterations.
"""

from dataclasses import dataclass

import jax.numpy as jnp
import numpy as np

from calibration.samples import Samples, compliances
from rodmodel import FreeStateExpansion

OUTPUTS = 35
RIDGE = (
    1e-6  # of the features' mean square: nearly equal features shall not cancel each other with huge weights
)

_KNOWN = 10  # a, û and the upper triangle of K come first among the outputs
_VANISH_AT_REST = 4  # a and û
_PARITY = np.array([1, -1, 1, -1, 1, -1, 1, 1, -1, 1])  # of the known ones under the mirror
_SWAP = np.array([0, 2, 1])


@dataclass(frozen=True)
class Scales:
    """Fixed scales of the law, from the data, so that its coefficients are numbers near one."""

    pressure: float
    curvature: float
    energy: float
    rest_volume: float

    @classmethod
    def of(cls, samples: Samples, moment_max: float) -> "Scales":
        """Scales for some states, the largest moment [N m] among them."""
        stiffness = float(np.median(np.linalg.eigvalsh(samples.hessian[:, :3, :3])))
        curvature = 2.0 * moment_max / stiffness
        off_rest = np.linalg.norm(samples.pressure, axis=1) / 1e3 + np.linalg.norm(samples.curvature, axis=1)
        return cls(
            pressure=float(0.4 * samples.pressure.max()),
            curvature=curvature,
            energy=stiffness * curvature**2,
            rest_volume=float(samples.volume[np.argmin(off_rest)].mean()),
        )


def initial_law(samples: Samples, scales: Scales, hidden: int, seed: int, mirror: bool) -> FreeStateExpansion:
    """A law before training, quadratic in the distance from the free state.

    Parameters
    ----------
    samples : training states.
    scales : of the law.
    hidden : units of each of the two inner layers.
    seed : of the inner layers' random weights.
    mirror : whether the section is its own mirror image in the plane of chamber 1.
    """
    rng = np.random.default_rng(seed)
    weights = [
        1.5 * rng.standard_normal((hidden, 3)),
        rng.standard_normal((hidden, hidden)) / np.sqrt(hidden),
    ]
    biases = [rng.standard_normal(hidden), 0.3 * rng.standard_normal(hidden)]

    def features(pressure: np.ndarray) -> np.ndarray:
        x = pressure / scales.pressure
        for weight, bias in zip(weights, biases, strict=True):
            x = np.tanh(x @ weight.T + bias)
        return np.hstack([x, np.ones((len(x), 1))])

    here, rest = features(samples.pressure), features(np.zeros((1, 3)))
    there = features(samples.pressure[:, _SWAP])
    targets = _first_order(samples, scales)
    outer = np.zeros((OUTPUTS, hidden + 1))
    for row in range(_KNOWN):
        parity = _PARITY[row]
        design = 0.5 * (here + parity * there) if mirror else here
        if row < _VANISH_AT_REST:
            design = design - (0.5 * (1 + parity) * rest if mirror else rest)
        square = design.T @ design
        ridge = RIDGE * np.trace(square) / len(square) * np.eye(len(square))
        outer[row] = np.linalg.solve(square + ridge, design.T @ targets[:, row])
    return FreeStateExpansion(
        weights=tuple(map(jnp.asarray, (*weights, outer[:, :-1]))),
        biases=tuple(map(jnp.asarray, (*biases, outer[:, -1]))),
        pressure_scale=scales.pressure,
        curvature_scale=scales.curvature,
        energy_scale=scales.energy,
        rest_volume=scales.rest_volume,
        mirror=mirror,
    )


def _first_order(samples: Samples, scales: Scales) -> np.ndarray:
    """Coefficients a, û/u_s and K that each state by itself would give a quadratic law, shape (n, 10)."""
    stiffness = samples.hessian[:, :3, :3]
    distance = np.einsum("nij,nj->ni", compliances(stiffness), samples.moment)
    work = 0.5 * np.einsum("ni,nij,nj->n", distance, stiffness, distance)
    constant = samples.energy + scales.rest_volume * samples.pressure.sum(axis=1) - work
    upper = stiffness[:, *np.triu_indices(3)] * scales.curvature**2
    return np.column_stack(
        [constant / scales.energy, (samples.curvature - distance) / scales.curvature, upper / scales.energy]
    )
