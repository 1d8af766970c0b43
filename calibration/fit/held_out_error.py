"""Error of a law at held-out states of the finite-element cell."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import optimistix as optx
from jax import Array
from jaxtyping import Bool, Float

from calibration.fit.any_law import AnyLaw, law_at
from calibration.fit.samples import Samples

# Relative tolerance of the curvature under a given moment; errors of interest are 1e-3.
EQUILIBRIUM_TOLERANCE = 1e-8
EQUILIBRIUM_STEPS = 50
# Moments up to this count as zero [N m]: it bends 60 mm of the unpressurised section by 0.01°.
NO_MOMENT = 1e-6


@dataclass(frozen=True)
class Deviations:
    """Deviations of a law from states, one state per row.

    Attributes
    ----------
    curvature : the law's curvature under the state's pressures and moment [1/m].
    found : whether the law has an equilibrium there.
    angle : error of the bending angle over the body's length [rad].
    bend : error of the bending vector L (u1, u2), which includes the error of the plane [rad].
    moment : norm of the moment error at the state's curvature [N m].
    volume : error of the chamber volumes per length at the state's curvature [m²].
    """

    curvature: Float[np.ndarray, "n 3"]
    found: Bool[np.ndarray, " n"]
    angle: Float[np.ndarray, " n"]
    bend: Float[np.ndarray, " n"]
    moment: Float[np.ndarray, " n"]
    volume: Float[np.ndarray, "n 3"]


def deviations(law: AnyLaw, samples: Samples, length: float, from_cell: bool = False) -> Deviations:
    """Compare a law with states.

    Parameters
    ----------
    law : law to compare.
    samples : states of the cell.
    length : body length for the bending angle [m].
    from_cell : start the search for the equilibrium at the cell's curvature instead of the law's free
        curvature, for laws whose free curvature needs a search that may fail.
    """
    curvature, pressure = jnp.asarray(samples.curvature), jnp.asarray(samples.pressure)
    psi = jnp.asarray(samples.psi)
    moment, volume = map(np.asarray, _moments_and_volumes(law, curvature, pressure, psi))
    start = curvature if from_cell else free_curvatures(law, pressure, psi)
    own, found = map(np.asarray, equilibrium(law, pressure, jnp.asarray(samples.moment), start, psi))
    bend, own_bend = samples.curvature[:, :2] * length, own[:, :2] * length
    return Deviations(
        curvature=own,
        found=found,
        angle=np.abs(np.linalg.norm(own_bend, axis=1) - np.linalg.norm(bend, axis=1)),
        bend=np.linalg.norm(own_bend - bend, axis=1),
        moment=np.linalg.norm(moment - samples.moment, axis=1),
        volume=volume - samples.volume,
    )


@eqx.filter_jit
def _moments_and_volumes(law: AnyLaw, curvature: Array, pressure: Array, psi: Array) -> tuple[Array, Array]:
    def one(u: Array, p: Array, angle: Array) -> tuple[Array, Array]:
        section = law_at(law, angle)
        return section.moment(u, p), section.volume(u, p)

    return jax.vmap(one)(curvature, pressure, psi)


@eqx.filter_jit
def free_curvatures(law: AnyLaw, pressure: Array, psi: Array) -> Array:
    """Return a law's free curvatures, shape (n, 3) [1/m]."""
    return jax.vmap(lambda p, angle: law_at(law, angle).free_curvature(p))(pressure, psi)


@eqx.filter_jit
def equilibrium(
    law: AnyLaw,
    pressure: Float[Array, "n 3"],
    moment: Float[Array, "n 3"],
    start: Float[Array, "n 3"],
    psi: Float[Array, " n"],
) -> tuple[Float[Array, "n 3"], Bool[Array, " n"]]:
    """Find the curvature of a law under given pressures and moments.

    Parameters
    ----------
    law : section law.
    pressure : pressures [Pa].
    moment : moments [N m].
    start : initial curvatures [1/m].
    psi : orientation of each section [rad], for a law of all orientations.

    Returns
    -------
    curvature : curvatures at equilibrium [1/m]; NaN where none was found.
    found : whether an equilibrium was found.
    """
    solver: optx.Newton = optx.Newton(rtol=EQUILIBRIUM_TOLERANCE, atol=EQUILIBRIUM_TOLERANCE)

    def one(p: Array, m: Array, u: Array, angle: Array) -> tuple[Array, Array]:
        at = law_at(law, angle).at(p)
        # The tolerance is one of curvature, so the residual is scaled to a curvature.
        unit = jnp.trace(at.stiffness(u)) / 3.0
        found: optx.Solution = optx.root_find(
            lambda u, _: (at.moment(u) - m) / unit,
            solver,
            u,
            max_steps=EQUILIBRIUM_STEPS,
            throw=False,
        )
        good = (found.result == optx.RESULTS.successful) & jnp.all(jnp.isfinite(found.value))
        return jnp.where(good, found.value, jnp.nan), good

    return jax.vmap(one)(pressure, moment, start, psi)


def figures(law: AnyLaw, samples: Samples, length: float, from_cell: bool = False) -> dict[str, Any]:
    """Return the held-out errors for the calibration file.

    Each quantity has its median, 90th and 95th percentiles, worst value and the load of the worst value;
    ``range`` is the range of the quantity over the same states. States at which the law has no equilibrium
    have an infinite error.

    Parameters
    ----------
    law : law to compare.
    samples : held-out states inside the domain.
    length : body length for the bending angle [m].
    from_cell : see `deviations`.
    """
    off = deviations(law, samples, length, from_cell)
    applied = np.linalg.norm(samples.moment, axis=1)
    free = applied <= NO_MOMENT
    reach = length * np.linalg.norm(samples.curvature[:, :2], axis=1)
    volume = np.abs(off.volume).max(axis=1)
    result: dict[str, Any] = {"states": len(samples), "paths": len(np.unique(samples.path))}
    for name, error, chosen, extent in (
        ("free_bending_angle_rad", off.angle, free, np.ptp(reach[free]) if free.any() else 0.0),
        ("free_bending_vector_rad", off.bend, free, np.ptp(reach[free]) if free.any() else 0.0),
        ("loaded_bending_angle_rad", off.angle, ~free, np.ptp(reach[~free]) if (~free).any() else 0.0),
        ("loaded_bending_vector_rad", off.bend, ~free, np.ptp(reach[~free]) if (~free).any() else 0.0),
        ("moment_nm", off.moment, np.ones_like(free), np.ptp(applied)),
        ("volume_m2", volume, np.ones_like(free), np.ptp(samples.volume)),
    ):
        if chosen.any():
            result[name] = summary(error[chosen], samples.where(chosen), float(extent))
    return result


def summary(error: np.ndarray, samples: Samples, extent: float) -> dict[str, Any]:
    """Return median, percentiles and worst value of an error, its load, and the quantity's range."""
    error = np.where(np.isnan(error), np.inf, error)
    worst = int(np.argmax(error))
    return {
        "median": float(np.median(error)),
        "p90": float(np.percentile(error, 90, method="higher")),
        "p95": float(np.percentile(error, 95, method="higher")),
        "worst": float(error[worst]),
        "worst_at": {
            "pressure_pa": samples.pressure[worst].tolist(),
            "moment_nm": samples.moment[worst].tolist(),
            **({} if np.isnan(samples.psi[worst]) else {"psi_rad": float(samples.psi[worst])}),
            "path": str(samples.path[worst]),
        },
        "range": extent,
        "states": len(samples),
    }


def everywhere(error: Mapping[str, Any]) -> bool:
    """Return whether the law has an equilibrium at every held-out state: all `figures` are finite."""
    return all(np.isfinite(row["worst"]) for row in error.values() if isinstance(row, dict))
