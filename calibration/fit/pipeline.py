"""Fit pipeline of the command line: from a dataset to a law with its held-out error."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import xarray as xr

from calibration.fit.any_law import AnyLaw
from calibration.fit.distil_mean import mean_states
from calibration.fit.held_out_error import everywhere, figures
from calibration.fit.initial_law import Scales, initial_law, initial_oriented, with_guess
from calibration.fit.levenberg_marquardt import Fitted, fit, mean_square
from calibration.fit.robust import ROUNDS, robust_fit
from calibration.fit.same_section import joined
from calibration.fit.samples import Metric, Samples, loading_samples, metric, softness
from calibration.fit.stable_domain import narrowed
from calibration.progress import progress_bar
from calibration.sweep import attributes, inside
from fem_reference import ActuatorGeometry
from fem_reference.geometry import ALIKE_LAYOUTS
from rodmodel import Domain, OrientedNetwork, RidgeNetwork, unfolded

# Number of random starts.
STARTS = 3
# Iterations of each start before the best is chosen.
TRIAL_ITERATIONS = 15
# States whose least stiffness is below this fraction of the median are left out: they are close to a snap,
# which no smooth law can follow.
SOFTEST = 0.1
# States are trained on up to so many times the domain's pressures, and those beside a chamber alone.
BEYOND, BEYOND_BESIDE = 1.2, 3.0
# Steps in which a state's Hessian predicts the gradient: of pressure and moment, relative to the largest.
NEAR_PRESSURE, NEAR_MOMENT = 0.073, 0.25
# Weight of the squared parameters in the loss, see `fit`.
PRIOR = 3e-3
# The same for the distance from the law of another winding.
PRIOR_NEAR = 0.03
# The same for fits near several laws, whose mean errs less than each of them.
PRIOR_NEAR_SEVERAL = 3e-3
# Significant digits of a law's numbers: far below the law's error, and files are half as long.
DIGITS = 9


@dataclass(frozen=True)
class Judged:
    """Fitted law with its held-out errors, or a complaint if it is unusable."""

    law: RidgeNetwork | OrientedNetwork
    domain: Domain
    error: dict[str, Any]
    training: dict[str, Any]
    states: int
    good: bool
    complaint: str


@dataclass(frozen=True)
class Material:
    """Training states, held-out states inside the domain, and the scales of a fit."""

    train: Samples
    held_out: Samples
    metric: Metric
    scales: Scales


def prepare(
    dataset: xr.Dataset, domain: Domain, length: float, others: Sequence[xr.Dataset] = ()
) -> Material:
    """Split a dataset by role, and add the training states of other datasets.

    Training keeps states a little beyond the domain, which support the fit at its edge.
    """
    samples = loading_samples(dataset)
    train = joined([samples, *map(loading_samples, others)]) if others else samples
    near = np.asarray(_widened(domain).covers_pressure(train.pressure.T))
    train = train.where(~train.held_out & near & (softness(train) >= SOFTEST))
    held_out = samples.where(samples.held_out & inside(domain, samples.pressure, samples.moment))
    run = attributes(dataset)
    geometry = ActuatorGeometry(**run["geometry"])
    scales = Scales.of(domain, geometry.body_length, geometry.chamber_area)
    return Material(train, held_out, metric_in(domain, train, length), scales)


def _widened(domain: Domain) -> Domain:
    """Return the domain in which states are trained on.

    Further out a section gives way under loads that the law never meets, and a law that learns of that errs
    more inside.
    """

    def times(factor: float, three: Sequence[float]) -> tuple[float, float, float]:
        first, second, third = (factor * one for one in three)
        return first, second, third

    return replace(
        domain,
        pressure_max=times(BEYOND, domain.pressure_max),
        pressure_sum_max=BEYOND * domain.pressure_sum_max,
        beside_max=BEYOND * domain.beside_max,
        pressure_min=times(1.0 / BEYOND, domain.pressure_min),
        single_max=times(BEYOND, domain.single_max),
        single_beside=BEYOND_BESIDE * domain.single_beside,
    )


def metric_in(domain: Domain, samples: Samples, length: float) -> Metric:
    """Return the metric of the residuals for states of a domain."""
    pressure_step = NEAR_PRESSURE * max(domain.pressure_max)
    return metric(samples, length, pressure_step, NEAR_MOMENT * float(domain.moment_max))


def symmetry_of(run: dict[str, Any]) -> str:
    """Return the symmetry of the section from the attributes of a run."""
    if not run["mirror"]:
        return "none"
    walls = run.get("geometry", {}).get("outer_wall_variation", ())
    return "full" if run["layout"] in ALIKE_LAYOUTS and len(set(walls)) <= 1 else "mirror"


def begin_near(law: AnyLaw, run: dict[str, Any]) -> AnyLaw:
    """Return the law of another winding with the symmetry of a run's section, as an initial law.

    One of all orientations is taken at the ψ of the run.

    Raises
    ------
    ValueError
        If it is less symmetric than the run's section, or of all orientations for a run of a winding without.
    """
    if isinstance(law, OrientedNetwork):
        if "orientations" in run:
            return law
        if "psi" not in run.get("winding", {}):
            raise ValueError("a law of all orientations, expected one of a winding that has none")
        return unfolded(law.at_psi(run["winding"]["psi"]), symmetry_of(run))
    if not isinstance(law, RidgeNetwork):
        raise ValueError(f"a {type(law).__name__}, expected a network of ridges")
    if "orientations" in run:
        # Equal at all orientations.
        return OrientedNetwork(unfolded(law, "full"), jnp.zeros((len(law.feature_biases), 2)))
    return unfolded(law, symmetry_of(run))


def fit_and_judge(
    dataset: xr.Dataset,
    domain: Domain,
    length: float,
    ridges: int,
    features: int,
    iterations: int,
    seed: int,
    near: Sequence[AnyLaw] = (),
    others: Sequence[xr.Dataset] = (),
    stay: float | None = None,
) -> Judged:
    """Fit a network of ridges to the training states and compute its error at the held-out states.

    Parameters
    ----------
    dataset : dataset of a run.
    domain : domain of the error; it is narrowed until the law is stable inside.
    length : body length for the bending angle [m].
    ridges, features : size of the law.
    iterations : iterations of the final training.
    seed : seed of the first start.
    near : initial laws of other windings, from `begin_near`, that the fit stays near. With several, a law is
        fitted near each, and one of the first's size is trained on their mean, see `mean_states`.
    others : datasets of the same section whose training states are fitted too.
    stay : weight of the squared distance from the initial laws; by default `PRIOR_NEAR`, or for several
        `PRIOR_NEAR_SEVERAL`.
    """
    material = prepare(dataset, domain, length, others)
    # The states of one dataset are enough to choose the best start.
    own = prepare(dataset, domain, length) if others and not near else material
    run = attributes(dataset)
    train, scales = material.train, material.metric
    rounds = (len(near) + 1 if len(near) > 1 else 1) * (1 + ROUNDS)
    before = 0 if near else STARTS * TRIAL_ITERATIONS
    with progress_bar(before + rounds * iterations, "iterations") as advance:

        def watch(stage: str) -> Any:
            return lambda _, loss: advance(1, f"{stage}, loss {loss:.3g}")

        def trial(number: int) -> Fitted[Any]:
            size = (material.scales, ridges, features, seed + number)
            oriented = "orientations" in run
            start = initial_oriented(*size) if oriented else initial_law(*size, symmetry_of(run))
            stage = watch(f"start {number + 1}/{STARTS}")
            return fit(start, own.train, own.metric, TRIAL_ITERATIONS, prior=PRIOR, watch=stage)

        if near:
            usual = PRIOR_NEAR if len(near) == 1 else PRIOR_NEAR_SEVERAL
            starts, prior = list(near), usual if stay is None else stay
        else:
            starts, prior = [min(map(trial, range(STARTS)), key=lambda trial: trial.loss).law], PRIOR

        def trained(start: AnyLaw, samples: Samples, scales: Metric, stage: str) -> Fitted[Any]:
            centre = start if near else None
            return robust_fit(start, samples, scales, iterations, prior, centre, watch(stage))

        fits = [trained(start, train, scales, "training") for start in starts]
        found = fits[0]
        if len(fits) > 1:
            first = with_guess(found.law, domain)
            mean = mean_states([first, *(other.law for other in fits[1:])], domain, train.psi, seed)
            mean = mean.where(softness(mean) >= SOFTEST)
            found = trained(first, mean, metric_in(domain, mean, length), "learning the mean")
    law = rounded(with_guess(found.law, domain))
    domain = narrowed(law, domain)
    held_out = material.held_out
    held_out = held_out.where(inside(domain, held_out.pressure, held_out.moment))
    error = figures(law, held_out, length) if len(held_out) else {}
    network = law.network if isinstance(law, OrientedNetwork) else law
    training = {
        "ridges": network.offsets.size,
        "features": network.feature_weights.shape[0],
        "iterations": found.iterations,
        "rounds": 1 + ROUNDS,
        "converged": found.converged,
        "mean_square_residual": mean_square(law, material.train, material.metric),
        "prior": prior,
        "states": len(material.train),
        "paths": len(np.unique(material.train.path)),
        "seed": seed,
    }
    complaint = ""
    if not len(held_out):
        complaint = (
            f"no held-out state lies where the fitted law is stable, {domain.largest_pressures('kPa')}"
        )
    elif not everywhere(error):
        complaint = "the fitted law has no equilibrium at some held-out states"
    states = len(material.train) + len(held_out)
    return Judged(law, domain, error, training, states, not complaint, complaint)


def rounded(law: Any) -> Any:
    """Return the law with its numbers rounded as in its file."""

    def shorter(leaf: Any) -> Any:
        if not eqx.is_inexact_array(leaf):
            return leaf
        numbers = [float(f"{number:.{DIGITS}g}") for number in np.asarray(leaf).ravel()]
        return jnp.asarray(np.reshape(numbers, leaf.shape))

    return jax.tree.map(shorter, law)
