"""Fit of a snapped sheet's law to its states."""

from dataclasses import dataclass, replace
from typing import Any

import jax.numpy as jnp
import numpy as np
import xarray as xr

from calibration.fit import (
    SOFTEST,
    AnyLaw,
    Samples,
    equilibrium,
    everywhere,
    figures,
    free_curvatures,
    loading_samples,
    mean_square,
    metric_in,
    rounded,
    softness,
    states_of,
)
from calibration.snapped.affine_law import as_network, fit_affine
from calibration.snapped.series import in_series
from calibration.snapped.sheet import SnappedSheet
from calibration.snapped.tracing import LEANING
from rodmodel import Domain, RidgeNetwork

# Share of the sweep's moments for which the law is: larger ones change the stiffness, which is constant here.
_MOMENTS = 0.25
# Share of the chamber's largest pressure on the loading branch up to which its law is taken for the upright
# sections; beyond, it is continued linearly, as the law gives way there.
_SURE = 0.95


@dataclass(frozen=True)
class SnappedFit:
    """A sheet's law with its held-out errors, or a complaint if it is unusable."""

    law: RidgeNetwork
    domain: Domain
    error: dict[str, Any]
    training: dict[str, Any]
    complaint: str


def snapped_samples(dataset: xr.Dataset, sheet: SnappedSheet) -> Samples:
    """Return the states of a sweep that are on the sheet: free of constraints, and leaning to its side."""
    samples = loading_samples(dataset.isel(state=np.flatnonzero(dataset["held"].values == 0)))
    return samples.where(np.array([sheet.aside(u) >= LEANING for u in samples.curvature]))


def upright_beside(law: AnyLaw, samples: Samples) -> Samples:
    """Return a law's states under the pressures and moments of others; NaN where it has none."""
    pressure, moment = jnp.asarray(samples.pressure), jnp.asarray(samples.moment)
    psi = jnp.asarray(np.zeros(len(samples)))
    start = free_curvatures(law, pressure, psi)
    curvature, found = map(np.asarray, equilibrium(law, pressure, moment, start, psi))
    curvature = np.where(found[:, None], curvature, np.nan)
    return states_of([law], samples.pressure, curvature, np.zeros(len(samples)), "upright")


def continued(law: AnyLaw, sheet: SnappedSheet, most: float, samples: Samples) -> Samples:
    """Return a law's states under the pressures and moments of others, linear beyond a pressure.

    Parameters
    ----------
    law : law of upright sections.
    sheet : sheet of the others.
    most : pressure of the sheet's chamber up to which the law holds [Pa].
    samples : states of the sheet.
    """
    own = sheet.chamber - 1
    pressure = samples.pressure.copy()
    pressure[:, own] = np.minimum(pressure[:, own], most)
    there = upright_beside(law, replace(samples, pressure=pressure))
    beyond = samples.pressure - pressure
    bent, coupling, of_pressure = (
        there.hessian[:, rows, columns]
        for rows, columns in ((slice(3), slice(3)), (slice(3), slice(3, 6)), (slice(3, 6), slice(3, 6)))
    )
    # At the same moment.
    turn = -np.linalg.solve(bent, np.einsum("nij,nj->ni", coupling, beyond)[:, :, None])[:, :, 0]
    gradient = there.gradient.copy()
    gradient[:, 3:] += np.einsum("nji,nj->ni", coupling, turn) + np.einsum("nij,nj->ni", of_pressure, beyond)
    return replace(there, pressure=samples.pressure, curvature=there.curvature + turn, gradient=gradient)


def fit_snapped(
    dataset: xr.Dataset,
    sheet: SnappedSheet,
    loading: RidgeNetwork,
    loading_domain: Domain,
    domain: Domain,
    length: float,
    share: float,
) -> SnappedFit:
    """Fit the law of a sheet and compute its error at the held-out states.

    Parameters
    ----------
    dataset : sweep of the sheet.
    sheet : sheet.
    loading, loading_domain : law of the loading branch, and its domain.
    domain : domain of the sweep; that of the law is narrower in moments.
    length : body length for the bending angle [m].
    share : share of the length that base and cap hold upright; see `in_series`.
    """
    on_sheet = snapped_samples(dataset, sheet)
    own = sheet.chamber - 1
    most = max(float(loading_domain.single_max[own]), float(loading_domain.pressure_max[own]))
    beside = continued(loading, sheet, _SURE * most, on_sheet)
    known = np.isfinite(beside.curvature).all(axis=1)
    samples = in_series(on_sheet.where(known), beside.where(known), share)
    moment, torque = (_MOMENTS * float(axis) for axis in domain.moment_axes[1:])
    domain = replace(domain, moment_max=moment, torque_max=torque)
    samples = samples.where(np.asarray(domain.covers_moment(samples.moment.T)))
    train = samples.where(~samples.held_out & (softness(samples) >= SOFTEST))
    scales = metric_in(domain, train, length)
    try:
        law = rounded(as_network(fit_affine(train, scales), np.array(domain.pressure_min)))
    except ValueError as unfit:
        return SnappedFit(loading, domain, {}, {}, str(unfit))
    inside = np.asarray(domain.covers_pressure(samples.pressure.T))
    held_out = samples.where(samples.held_out & inside)
    error = figures(law, held_out, length) if len(held_out) else {}
    training = {
        "mean_square_residual": mean_square(law, train, scales),
        "states": len(train),
        "upright_share": share,
    }
    complaint = ""
    if not len(held_out):
        complaint = "no held-out state lies on the sheet"
    elif not everywhere(error):
        complaint = "the fitted law has no equilibrium at some held-out states"
    return SnappedFit(law, domain, error, training, complaint)
