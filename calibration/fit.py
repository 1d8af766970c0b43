"""Fit of the free-state expansion to value, gradient and Hessian of the section potential."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Generic, TypeVar

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax.flatten_util import ravel_pytree
from scipy.optimize import minimize

from calibration.expansion import derivatives
from calibration.samples import Metric, Samples
from rodmodel import FreeStateExpansion, SectionLaw

HESSIAN_WEIGHT = 0.3  # of the errors at neighbouring states against those at the states themselves
SIZES = (12, 16, 24, 32)
STARTS = 3
TRIAL_ITERATIONS = 300
NEGLIGIBLE_GAIN = 1.1  # a larger network must do better than this factor to be worth its time
MEMORY = 60  # steps that L-BFGS remembers

Law = TypeVar("Law", bound=SectionLaw)
Derivatives = Callable[..., tuple[jax.Array, jax.Array, jax.Array]]
Watch = Callable[[str, int, float], None]  # stage, iterations so far, loss


def _nobody(stage: str, iterations: int, loss: float) -> None:
    pass


def mean_square(
    law: SectionLaw, samples: Samples, scales: Metric, derive: Derivatives = derivatives
) -> jax.Array:
    """Mean over the states of the squared residuals of gradient and Hessian, in the units of the metric.

    A law that is its own mirror image has the same residuals at the mirror image of every state: adding those
    to the data would change nothing.
    """
    _, gradient, hessian = derive(law, jnp.asarray(samples.curvature), jnp.asarray(samples.pressure))
    here = jnp.einsum("nij,nj->ni", scales.gradient, gradient - samples.gradient)
    nearby = jnp.einsum("nij,njk->nik", scales.gradient, hessian - samples.hessian) * scales.step
    return jnp.mean(jnp.sum(here**2, axis=1) + HESSIAN_WEIGHT**2 * jnp.sum(nearby**2, axis=(1, 2)))


@dataclass(frozen=True)
class Minimised(Generic[Law]):
    """A fitted law, its loss, the iterations it took, and whether the minimiser ended as it should."""

    law: Law
    loss: float
    iterations: int
    regular: bool


def minimise(
    law: Law,
    samples: Samples,
    scales: Metric,
    iterations: int,
    derive: Derivatives = derivatives,
    watch: Callable[[int, float], None] = lambda iterations, loss: None,
) -> Minimised[Law]:
    """L-BFGS on all array leaves of a law, to convergence or the given number of iterations."""
    trained, fixed = eqx.partition(law, eqx.is_inexact_array)
    start, unravel = ravel_pytree(trained)

    @jax.jit
    def loss_and_slope(x: jax.Array) -> tuple[jax.Array, jax.Array]:
        return jax.value_and_grad(
            lambda x: mean_square(eqx.combine(unravel(x), fixed), samples, scales, derive)
        )(x)

    done, last = 0, float("nan")

    def objective(x: np.ndarray) -> tuple[float, np.ndarray]:
        nonlocal last
        loss, slope = loss_and_slope(jnp.asarray(x))
        last = float(loss)
        return last, np.asarray(slope)

    def after_iteration(_: np.ndarray) -> None:
        nonlocal done
        done += 1
        watch(done, last)

    options = {
        "maxiter": iterations,
        "maxfun": 4 * iterations,
        "maxcor": MEMORY,
        "ftol": 1e-12,
        "gtol": 1e-10,
    }
    result = minimize(
        objective, np.asarray(start), jac=True, method="L-BFGS-B", callback=after_iteration, options=options
    )
    fitted = eqx.combine(unravel(jnp.asarray(result.x)), fixed)
    regular = bool(np.isfinite(result.fun)) and result.status in (
        0,
        1,
    )  # 1: the iterations that were asked for
    return Minimised(fitted, float(result.fun), int(result.nit), regular)


@dataclass(frozen=True)
class Trial:
    """One size in the search: its best start's seed and its error on paths that it was not trained on."""

    hidden: int
    parameters: int
    seed: int
    validation: float


def choose_size(
    samples: Samples,
    scales: Callable[[Samples], Metric],
    start: Callable[[int, int], FreeStateExpansion],
    sizes: Sequence[int] = SIZES,
    seed: int = 0,
    watch: Watch = _nobody,
) -> tuple[int, tuple[Trial, ...]]:
    """Smallest network that does about as well as the best, judged on every fifth training path.

    Parameters
    ----------
    samples : training states.
    scales : gives the metric of some states.
    start : initial law of a number of hidden units and a seed.
    sizes : hidden units a layer to try.
    seed : of the start.

    Returns
    -------
    hidden : the size chosen.
    trials : what each size reached in a short training.
    """
    names = np.unique(samples.path)
    judged = np.isin(samples.path, names[2::5])
    inner, outer = samples.where(~judged), samples.where(judged)
    inner_scales, outer_scales = scales(inner), scales(outer)
    trials = []
    for hidden in sizes:
        found = minimise(
            start(hidden, seed), inner, inner_scales, TRIAL_ITERATIONS, watch=partial(watch, f"size {hidden}")
        )
        error = float(jax.jit(partial(mean_square, found.law, outer, outer_scales))())
        parameters = sum(x.size for x in (*found.law.weights, *found.law.biases))
        trials.append(Trial(hidden, parameters, seed, error))
    best = min(trial.validation for trial in trials)
    return next(t.hidden for t in trials if t.validation <= NEGLIGIBLE_GAIN**2 * best), tuple(trials)


def fit_expansion(
    samples: Samples,
    scales: Metric,
    start: Callable[[int], FreeStateExpansion],
    iterations: int,
    seed: int = 0,
    watch: Watch = _nobody,
) -> Minimised[FreeStateExpansion]:
    """Fit from several starts for a while, then the best of them to the end.

    Parameters
    ----------
    samples, scales : training states and their metric.
    start : initial law of a seed.
    iterations : of the final training.
    seed : of the first start.
    """
    trials = [
        minimise(
            start(seed + n),
            samples,
            scales,
            TRIAL_ITERATIONS,
            watch=partial(watch, f"start {n + 1}/{STARTS}"),
        )
        for n in range(STARTS)
    ]
    best = min(trials, key=lambda trial: trial.loss)
    return minimise(best.law, samples, scales, iterations, watch=partial(watch, "training"))
