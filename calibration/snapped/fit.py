"""Fit of a snapped sheet's law to its states.

Below the sheet's end the fit follows the loading branch: no state of the sheet is there, and a law that is
defined everywhere is found from rest as others are.
"""

from dataclasses import dataclass, replace
from typing import Any

import jax.numpy as jnp
import numpy as np
import xarray as xr
from jaxtyping import Float

from calibration.fit import (
    PRIOR,
    SOFTEST,
    STARTS,
    TRIAL_ITERATIONS,
    AnyLaw,
    Samples,
    Scales,
    equilibrium,
    everywhere,
    figures,
    fit,
    free_curvatures,
    initial_law,
    joined,
    loading_samples,
    mean_square,
    metric_in,
    rounded,
    softness,
    states_of,
    unstable_pressures,
    with_guess,
)
from calibration.progress import progress_bar
from calibration.snapped.series import in_series
from calibration.snapped.sheet import SnappedSheet
from calibration.snapped.tracing import LEANING
from rodmodel import Domain, RidgeNetwork

# Largest pressure of the loading states, over the least of the sheet.
BELOW = 0.9
# Loading states for each state of the sheet.
LOADING_SHARE = 0.8
# Size of the law. There are about a hundred states, and more ridges leave it to chance between them.
RIDGES, FEATURES = 12, 12
# Steps in which the pressures beside the chamber are lowered until the law is stable [share of the largest].
_NARROWING = 0.1


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


def fit_snapped(
    dataset: xr.Dataset,
    sheet: SnappedSheet,
    loading: RidgeNetwork,
    domain: Domain,
    length: float,
    share: float,
    iterations: int,
    seed: int = 0,
) -> SnappedFit:
    """Fit the law of a sheet and compute its error at the held-out states.

    Parameters
    ----------
    dataset : sweep of the sheet.
    sheet : sheet.
    loading : law of the loading branch.
    domain : domain of the sheet's law; the pressures beside the chamber are lowered until the law is stable.
    length : body length for the bending angle [m].
    share : share of the length that base and cap hold upright; see `in_series`.
    iterations : of the fit.
    seed : of the loading states.
    """
    on_sheet = snapped_samples(dataset, sheet)
    beside = upright_beside(loading, on_sheet)
    known = np.isfinite(beside.curvature).all(axis=1)
    samples = in_series(on_sheet.where(known), beside.where(known), share)
    train = samples.where(~samples.held_out & (softness(samples) >= SOFTEST))
    below = _below(loading, sheet, domain, int(LOADING_SHARE * len(train)), seed)
    train = joined([train, below])
    scales = metric_in(domain, train, length)
    size = Scales.of(domain, length, float(loading.rest_volume))
    with progress_bar(STARTS * TRIAL_ITERATIONS + iterations, "iterations") as advance:

        def watch(_: int, loss: float) -> None:
            advance(1, f"training, loss {loss:.3g}")

        trials = [
            fit(
                initial_law(size, RIDGES, FEATURES, seed + number, "none"),
                train,
                scales,
                TRIAL_ITERATIONS,
                prior=PRIOR,
                watch=watch,
            )
            for number in range(STARTS)
        ]
        start = min(trials, key=lambda trial: trial.loss).law
        found = fit(start, train, scales, iterations, prior=PRIOR, watch=watch)
    law = rounded(with_guess(found.law, replace(domain, pressure_min=(0.0, 0.0, 0.0))))
    domain = _stable(law, sheet, domain)
    inside = domain.covers_pressure(samples.pressure.T) & domain.covers_moment(samples.moment.T)
    held_out = samples.where(samples.held_out & np.asarray(inside))
    error = figures(law, held_out, length) if len(held_out) else {}
    training = {
        "iterations": found.iterations,
        "converged": found.converged,
        "mean_square_residual": mean_square(law, train, scales),
        "states": len(train),
        "upright_share": share,
    }
    complaint = ""
    if not len(held_out):
        complaint = "no held-out state lies where the fitted law is stable"
    elif not everywhere(error):
        complaint = "the fitted law has no equilibrium at some held-out states"
    elif len(unstable_pressures(law, domain)):
        complaint = "the fitted law has no stable free state at some pressures of its domain"
    return SnappedFit(law, domain, error, training, complaint)


def _stable(law: RidgeNetwork, sheet: SnappedSheet, domain: Domain) -> Domain:
    """Lower the pressures beside the chamber until the law is stable, or they are nearly zero."""
    largest = np.array(domain.pressure_max)
    own = np.eye(3)[sheet.chamber - 1]
    for share in np.arange(1.0, _NARROWING / 2.0, -_NARROWING):
        first, second, third = np.where(own > 0.0, largest, share * largest).tolist()
        domain = replace(domain, pressure_max=(first, second, third))
        if not len(unstable_pressures(law, domain)):
            break
    return domain


def _below(law: AnyLaw, sheet: SnappedSheet, domain: Domain, number: int, seed: int) -> Samples:
    """Return free states of the loading branch below the sheet."""
    rng = np.random.default_rng(seed)
    own = BELOW * domain.pressure_min[sheet.chamber - 1] * rng.random(number)
    others = np.array(domain.pressure_max) * rng.random((number, 3))
    others[:, sheet.chamber - 1] = own
    return upright_beside(law, _free(others))


def _free(pressure: Float[np.ndarray, "n 3"]) -> Samples:
    count = len(pressure)
    return Samples(
        pressure=pressure,
        curvature=np.zeros((count, 3)),
        energy=np.full(count, np.nan),
        gradient=np.zeros((count, 6)),
        hessian=np.zeros((count, 6, 6)),
        psi=np.full(count, np.nan),
        path=np.array(["below"] * count),
        held_out=np.zeros(count, dtype=bool),
    )
