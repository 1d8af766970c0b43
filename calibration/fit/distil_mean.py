"""Distillation of the mean of several laws into one: training states from the mean.

Laws fitted to the same few states from different starts have different errors between these states, and
their mean errs less than each of them. The mean has the ridges of all laws; but it can be evaluated at any
state, so a law of the size of one of them can be trained to approximate it.

References
----------
Breiman (1996), Bagging predictors, Machine Learning 24, §4: why a mean errs less. Buciluǎ, Caruana,
Niculescu-Mizil (2006), Model compression, KDD '06, 535: one network that follows many.
"""

from collections.abc import Sequence
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from calibration.fit.any_law import AnyLaw, law_at
from calibration.fit.held_out_error import equilibrium, free_curvatures
from calibration.fit.initial_law import random_pressures
from calibration.fit.potential_derivatives import UPPER, gradient_and_hessian
from calibration.fit.samples import Samples
from rodmodel import Domain

STATES = 1500
# Extent of the states relative to the domain: states beyond it support the fit at its edge.
BEYOND = 1.05


def mean_states(laws: Sequence[AnyLaw], domain: Domain, psi: Float[np.ndarray, " n"], seed: int) -> Samples:
    """Return random states under the domain's loads, with the laws' mean gradient and Hessian.

    Parameters
    ----------
    laws : laws to average; the curvatures are equilibria of the first one.
    domain : domain of the loads; the states go slightly beyond.
    psi : orientations [rad] to draw from, for laws of all orientations.
    seed : seed of the random loads.

    Returns
    -------
    states : training states; fewer where the first law has no equilibrium.
    """
    rng = np.random.default_rng(seed)
    pressure = random_pressures(domain, STATES, BEYOND, rng)
    direction = rng.standard_normal((STATES, 3))
    direction /= np.linalg.norm(direction, axis=1, keepdims=True)
    # One fifth of the states has no moment.
    size = np.maximum(0.0, 1.25 * rng.random((STATES, 1)) - 0.25)
    moment = size * direction * np.asarray(domain.moment_axes)
    angle = rng.choice(psi, STATES)
    loads = jnp.asarray(pressure), jnp.asarray(moment)
    start = free_curvatures(laws[0], loads[0], jnp.asarray(angle))
    found, good = map(np.asarray, equilibrium(laws[0], *loads, start, jnp.asarray(angle)))
    return states_of(laws, pressure[good], found[good], angle[good], "mean")


def states_of(
    laws: Sequence[AnyLaw],
    pressure: Float[np.ndarray, "n 3"],
    curvature: Float[np.ndarray, "n 3"],
    psi: Float[np.ndarray, " n"],
    path: str,
) -> Samples:
    """Return training states with the laws' mean gradient and Hessian at given pressures and curvatures."""
    state = jnp.asarray(np.concatenate([curvature, pressure], axis=1))
    mean = np.mean([np.asarray(_derivatives(law, state, jnp.asarray(psi))) for law in laws], axis=0)
    hessian = np.zeros((len(mean), 6, 6))
    hessian[:, *UPPER] = hessian.transpose(0, 2, 1)[:, *UPPER] = mean[:, 6:]
    return Samples(
        pressure=pressure,
        curvature=curvature,
        energy=np.full(len(mean), np.nan),
        gradient=mean[:, :6],
        hessian=hessian,
        psi=psi,
        path=np.array([path] * len(mean)),
        held_out=np.zeros(len(mean), dtype=bool),
    )


@eqx.filter_jit
def _derivatives(law: AnyLaw, state: Float[Array, "n 6"], psi: Float[Array, " n"]) -> Any:
    return jax.vmap(lambda y, angle: gradient_and_hessian(law_at(law, angle), y))(state, psi)
