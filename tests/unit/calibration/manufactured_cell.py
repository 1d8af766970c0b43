"""A section potential in closed form with the interface of the finite-element cell.

It has what makes the real one hard: volumes that are compliant at first and stiff later, a smooth but quick
change of slope (as wall contact makes), twist by unequal chambers, a quartic in curvature, and the mirror
symmetry of the section.
"""

import os
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial

import jax
import jax.numpy as jnp
import numpy as np

from fem_reference import CellError, CellState, Load
from fem_reference.cell.state import Configuration

BENDING = 2.45e-4  # [N m²]
SNAP = np.array([0.0, np.deg2rad(5.0) / 60e-3, 0.0])
AZIMUTH = np.deg2rad([0.0, 120.0, 240.0])


def free_curvature(p: jax.Array) -> jax.Array:
    """Closed form of the curvature without moment [1/m]."""
    q = p / 1e4
    gain = jnp.array([1.0, 0.85, 0.85])
    drive = gain * (2.7 * q + 0.55 * q**2) - 0.5 * 0.5 * jax.nn.softplus((q - 3.2) / 0.25)
    drive = drive * (1.0 - 0.03 * (jnp.sum(q) - q))
    drive = drive + 0.5 * 0.5 * jax.nn.softplus(-3.2 / 0.25)
    twist = 0.15 * (q[1] - q[2]) * q[0]
    return jnp.stack([jnp.sum(drive * np.sin(AZIMUTH)), -jnp.sum(drive * np.cos(AZIMUTH)), twist])


def potential(u: jax.Array, p: jax.Array) -> jax.Array:
    """Section potential [J/m] of curvature (3,) [1/m] and pressure (3,) [Pa]."""
    q = p / 1e4
    volume_work = -p * (15.5e-6 + 0.6e-6 * q) - 4e-6 * (p + 8e3 * jnp.expm1(-p / 8e3))
    w = u - free_curvature(p)
    level = 1.0 + 0.05 * jnp.sum(q) + 0.02 * jnp.sum(q**2)
    stiffness = BENDING * level * jnp.array([1.0, 1.0, 0.9])
    cubic = 2e-7 * (w[1] ** 3 + w[1] * w[0] ** 2) * (1.0 + 0.1 * q[0])
    quartic = 2e-8 * jnp.sum(w**2) ** 2
    coupling = 1e-5 * (q[1] - q[2]) * w[0] * w[1]
    return jnp.sum(volume_work) + 0.5 * jnp.sum(stiffness * w**2) + cubic + quartic + coupling


@jax.jit
def _derivatives(y: jax.Array) -> tuple[jax.Array, jax.Array, jax.Array]:
    def at(y: jax.Array) -> jax.Array:
        return potential(y[:3], y[3:])

    return at(y), jax.grad(at)(y), jax.hessian(at)(y)


def without_nodes(u: np.ndarray) -> Configuration:
    """The configuration of a cell that has no nodes."""
    return Configuration(
        np.zeros((0, 3)), np.append(u / 1e3, 1.0), np.zeros((0, 1)), np.zeros(0), np.zeros(2)
    )


def solve(load: Load, start: CellState | None = None) -> CellState:
    """Newton on ∂Π/∂u = m, from the state before; nothing is to be solved at an imposed curvature."""
    p, m = np.asarray(load.pressure), np.asarray(load.moment)
    u = np.asarray(free_curvature(p)) if start is None else start.curvature
    if load.curvature is not None:
        u = np.asarray(load.curvature)
        m = np.asarray(_derivatives(jnp.concatenate([u, p]))[1])[:3]
    for iteration in range(1, 50):
        value, gradient, hessian = map(np.asarray, _derivatives(jnp.concatenate([u, p])))
        residual = gradient[:3] - m
        if np.linalg.norm(residual) < 1e-14:
            negative = int((np.linalg.eigvalsh(hessian[:3, :3]) <= 0.0).sum())
            return CellState(
                load=load,
                pressure=p,
                curvature=u,
                moment=gradient[:3],
                stretch=1.0,
                energy=float(value),
                volume=-gradient[3:],
                hessian=hessian,
                iterations=iteration,
                residual=0.0,
                stable=negative == 0,
                negative_directions=negative,
                jumped=False,
                configuration=without_nodes(u),
            )
        u = u - np.linalg.solve(hessian[:3, :3], residual)
    raise CellError(f"no equilibrium at {load}", last_good=start)


def follow(loads: Sequence[Load], start: CellState | None) -> Iterator[CellState]:
    """Continuation as the cell does it: one state at each given load."""
    for load in loads:
        start = solve(load, start)
        yield start


@dataclass(frozen=True)
class ManufacturedTracer:
    """Stands where `calibration.sweep.sweep.CellTracer` stands, with failures on demand.

    Parameters
    ----------
    fails_beyond : pressure sum [Pa] past which no step is possible.
    largest_step : pressure step [Pa] past which a step fails, though a smaller one would not.
    snaps_beyond : pressure sum [Pa] at which walls would lose their balance.
    saddle_beyond : pressure sum [Pa] past which states are not stable.
    silent_snap_beyond : pressure sum [Pa] past which states are on another branch, 5 degrees away over 60 mm,
        and do not say so.
    dies_beyond : pressure sum [Pa] past which the process dies, once it has told of what it found.
    """

    fails_beyond: float = np.inf
    largest_step: float = np.inf
    snaps_beyond: float = np.inf
    saddle_beyond: float = np.inf
    silent_snap_beyond: float = np.inf
    dies_beyond: float = np.inf

    def __call__(self):
        """Return the continuation."""
        jax.config.update("jax_enable_x64", True)
        return partial(_trace, self)


def _trace(settings: ManufacturedTracer, loads, start):
    for load in loads:
        before = np.zeros(3) if start is None else np.asarray(start.load.pressure)
        step = np.abs(np.asarray(load.pressure) - before).max()
        if sum(load.pressure) > settings.fails_beyond or step > settings.largest_step:
            raise CellError(f"no step to {load.pressure}", last_good=start)
        if sum(load.pressure) > settings.dies_beyond:
            time.sleep(1.0)
            os._exit(1)
        if sum(load.pressure) > settings.snaps_beyond:
            raise CellError("walls lose their balance", last_good=start, unstable=True)
        start = replace(solve(load, start), stable=sum(load.pressure) <= settings.saddle_beyond)
        snapped = sum(load.pressure) > settings.silent_snap_beyond
        yield replace(start, curvature=start.curvature + SNAP) if snapped else start
