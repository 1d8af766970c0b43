"""Levenberg–Marquardt fit of a law to gradient and Hessian of the section potential.

A state has 27 residuals, six first and twenty-one second derivatives, and a law about a thousand parameters:
few enough for the normal equations. Fifty of these iterations reduce the loss more than thousands of a
quasi-Newton method, in less time. The gradient is exact. The normal matrix, most of the work, is sketched: it
uses random combinations of each state's residuals if there are many more residuals than parameters.

References
----------
Pilanci, Wainwright (2016), Iterative Hessian sketch, J. Mach. Learn. Res. 17, 53. Achlioptas (2003),
Database-friendly random projections, J. Comput. Syst. Sci. 66, 671: signs at random.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any, Generic, TypeVar

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import scipy.linalg
from jax.flatten_util import ravel_pytree
from jaxtyping import Float
from scipy.linalg.blas import dsymv, ssyrk

from calibration.fit.any_law import AnyLaw, law_at
from calibration.fit.potential_derivatives import UPPER, gradient_and_hessian
from calibration.fit.samples import Metric, Samples
from rodmodel import RidgeNetwork

HESSIAN_WEIGHT = 0.3  # weight of errors at neighbouring states against those at the states themselves
_CHUNK = 384  # states whose Jacobian is in memory at a time
_RESIDUALS = 27  # residuals of a state
# Random combinations of residuals per parameter in the normal matrix, drawn anew in each iteration: with 6
# the loss falls as fast as with all residuals.
_COMBINATIONS = 6.0
# The same for a fit that stays near another law, where the prior needs fewer.
_COMBINATIONS_NEAR = 3.5
# First damping, relative to the mean diagonal of the normal matrix.
_FIRST_DAMPING = 1e-2
# Numbers of a law for each state above which the mixing of images that were written out is kept. At four it
# is better trained, at twenty-seven kept.
_NUMBERS_PER_STATE = 8.0
# Increases of the damping without a decrease of the loss after which the fit has converged.
_TRIALS = 12
_PATIENCE = 10  # iterations over which convergence is measured

Law = TypeVar("Law", bound=AnyLaw)
Watch = Callable[[int, float], None]  # iterations so far, mean square of the residuals


@dataclass(frozen=True)
class Fitted(Generic[Law]):
    """Fitted law with its loss, the number of iterations, and whether they converged."""

    law: Law
    loss: float
    """Mean square of the residuals, plus the prior."""
    iterations: int
    converged: bool


def residual_weights(samples: Samples, scales: Metric) -> Float[np.ndarray, "n 27 27"]:
    """Return each state's weight matrix W, with which its loss is |W r|² for its 27 residuals r.

    The loss sums the squared errors of the gradient at the state, and one sampling step away through the
    error of the Hessian, in the units of the metric.
    """
    count = len(samples)
    rows = np.zeros((count, 6, 7, 27))
    rows[:, :, 0, :6] = scales.gradient
    for number, (i, j) in enumerate(zip(*UPPER, strict=True), start=6):
        for a, b in {(i, j), (j, i)}:
            rows[:, :, 1 + b, number] += HESSIAN_WEIGHT * scales.gradient[:, :, a] * scales.step[b]
    return np.asarray(np.linalg.qr(rows.reshape(count, 42, 27), mode="r")) / np.sqrt(count)


def mean_square(law: AnyLaw, samples: Samples, scales: Metric) -> float:
    """Return the mean over the states of the squared residuals, in the units of the metric.

    A mirror-symmetric law has equal residuals at the mirror images of the states, which are therefore left
    out.
    """
    return _loss(law, _chunks(samples, scales))


def residuals(law: AnyLaw, samples: Samples, scales: Metric) -> Float[np.ndarray, "n 27"]:
    """Return the residuals of all states; their squares sum to `mean_square`."""
    rows = [np.asarray(_residuals(law, chunk)) for chunk in _chunks(samples, scales)]
    return np.concatenate(rows)[: len(samples)]


def fit(
    law: Law,
    samples: Samples,
    scales: Metric,
    iterations: int,
    tolerance: float = 1e-2,
    prior: float = 0.0,
    near: Law | None = None,
    watch: Watch = lambda iterations, loss: None,
) -> Fitted[Law]:
    """Fit all array leaves of a law, but for the numbers that `trained_numbers` leaves out.

    Parameters
    ----------
    law : initial law.
    samples, scales : training states and their metric.
    iterations : maximum number of iterations.
    tolerance : convergence tolerance on the relative decrease of the loss in ten iterations.
    prior : weight of the squared parameters against the mean square of the residuals; it keeps the law
        smooth between the states.
    near : law of the same form, from whose parameters those of the fit are to change little: the prior is on
        the change.
    watch : callback for the progress.
    """
    trained, fixed = eqx.partition(law, eqx.is_inexact_array)
    start, unravel = ravel_pytree(trained)
    chosen = jnp.asarray(trained_numbers(law, len(samples)))
    whole = np.asarray(start)
    x = whole[chosen]
    centre = np.zeros_like(x) if near is None else _numbers(near)[chosen]

    chunks = _chunks(samples, scales)
    wanted = (_COMBINATIONS if near is None else _COMBINATIONS_NEAR) * x.size / len(samples)
    combinations = min(math.ceil(wanted), _RESIDUALS)

    def law_of(x: np.ndarray) -> Law:
        numbers = whole.copy()
        numbers[chosen] = x
        return eqx.combine(unravel(jnp.asarray(numbers)), fixed)

    def loss_at(x: np.ndarray) -> float:
        return _loss(law_of(x), chunks) + prior * float((x - centre) @ (x - centre))

    loss, damping, growth = loss_at(x), _FIRST_DAMPING, 2.0
    diagonal = np.diag_indices(x.size)
    # Allocated once: page faults of such matrices cost more than the work on them. Only lower triangles are
    # read.
    products = np.zeros((x.size, x.size), np.float32, order="F")
    normal, damped = (np.zeros((x.size, x.size), order="F") for _ in range(2))
    losses, converged = [loss], False
    while len(losses) <= iterations and not converged:
        products.fill(0.0)
        pull, here = prior * (x - centre), law_of(x)
        for number, chunk in enumerate(chunks):
            draw = jax.random.key(len(losses) * len(chunks) + number)
            rows = np.asarray(_slopes(here, chunk, combinations, draw, chosen)).reshape(-1, x.size)
            ssyrk(1.0, rows.T, beta=1.0, c=products, lower=True, overwrite_c=True)
            pull += np.asarray(_half_gradient(here, chunk))[chosen]
        normal[:] = products
        normal[diagonal] += prior
        unit = np.trace(normal) / x.size
        for _ in range(_TRIALS):
            damped[:] = normal
            damped[diagonal] += damping * unit
            step = _solve_definite(damped, -pull)
            there = math.inf if step is None else loss_at(x + step)
            # Nielsen (1999), Damping parameter in Marquardt's method, IMM-REP-1999-05, eq. 2.5.
            if step is not None and there < loss:
                gain = (loss - there) / -(2.0 * pull @ step + step @ dsymv(1.0, normal, step, lower=True))
                damping *= max(0.2, 1.0 - (2.0 * gain - 1.0) ** 3)
                x, loss, growth = x + step, there, 2.0
                break
            damping, growth = damping * growth, 2.0 * growth
        else:
            converged = True  # not even a short step decreases the loss
        losses.append(loss)
        converged |= len(losses) > _PATIENCE and losses[-1 - _PATIENCE] - loss <= tolerance * loss
        watch(len(losses) - 1, loss)
    return Fitted(law_of(x), loss, len(losses) - 1, converged)


def _numbers(law: AnyLaw) -> np.ndarray:
    """Return all numbers of a law's arrays."""
    return np.asarray(ravel_pytree(eqx.filter(law, eqx.is_inexact_array))[0])


def trained_numbers(law: AnyLaw, states: int) -> np.ndarray:
    """Return the indices of the numbers that a fit to so many states changes, among all of a law's arrays.

    Where the images of a law of more symmetry were written out as more ridges, each image's ridges mix the
    features of that image alone. That mixing has most of the numbers, 19 thousand of 21 for 192 ridges from
    six images. Where states are too few to tell them it stays as it is, and where the ridges bend and how
    much is still each image's own.
    """
    marks = jax.tree.map(jnp.ones_like, eqx.filter(law, eqx.is_inexact_array))
    every = ravel_pytree(marks)[0]
    if every.size > _NUMBERS_PER_STATE * states and _is_written_out(law):
        every = ravel_pytree(replace(marks, mixing=jnp.zeros_like(marks.mixing)))[0]
    return np.flatnonzero(np.asarray(every))


def _is_written_out(law: AnyLaw) -> bool:
    return isinstance(law, RidgeNetwork) and bool(np.any(np.asarray(law.mixing[:, 3:]) == 0.0))


def _solve_definite(matrix: np.ndarray, right: np.ndarray) -> np.ndarray | None:
    """Solve with a matrix' lower triangle, which is overwritten; None if it is not positive definite.

    It is not if the round-off of the slopes exceeds the damping.
    """
    try:
        factor = scipy.linalg.cho_factor(matrix, lower=True, overwrite_a=True)
    except scipy.linalg.LinAlgError:
        return None
    return np.asarray(scipy.linalg.cho_solve(factor, right))


# Compiled once for all laws of one form and size.
@eqx.filter_jit
def _residuals(law: AnyLaw, chunk: Any) -> jax.Array:
    return jax.vmap(lambda state: _residual(law, state))(chunk)


@eqx.filter_jit
def _half_gradient(law: AnyLaw, chunk: Any) -> jax.Array:
    """Return half the gradient of the sum of squares by all numbers."""
    trained, fixed = eqx.partition(law, eqx.is_inexact_array)
    half = jax.grad(lambda trained: 0.5 * jnp.sum(_residuals(eqx.combine(trained, fixed), chunk) ** 2))
    return ravel_pytree(half(trained))[0]


@eqx.filter_jit
def _slopes(law: AnyLaw, chunk: Any, combinations: int, draw: jax.Array, chosen: jax.Array) -> jax.Array:
    """Return slopes of the residuals, or of random combinations (states, combinations, parameters).

    The expectation of their products is that of all slopes. Single precision is enough for a step direction.
    """

    def single(tree: Any) -> Any:
        return jax.tree.map(lambda leaf: jnp.asarray(leaf, jnp.float32), tree)

    trained, fixed = eqx.partition(law, eqx.is_inexact_array)
    trained, chunk = single(trained), single(chunk)
    shape = len(chunk[0]), combinations, _RESIDUALS
    if combinations < _RESIDUALS:
        weights = jax.random.rademacher(draw, shape, jnp.float32) / math.sqrt(combinations)
    else:
        weights = jnp.broadcast_to(jnp.eye(_RESIDUALS, dtype=jnp.float32), shape)

    def slopes(state: Any, weights: jax.Array) -> jax.Array:
        residual, back = jax.vjp(lambda trained: _residual(eqx.combine(trained, fixed), state), trained)
        (by_leaf,) = jax.vmap(back)(weights.astype(residual.dtype))
        rows = [leaf.reshape(combinations, -1) for leaf in jax.tree.leaves(by_leaf)]
        return jnp.concatenate(rows, axis=1)[:, chosen]

    return jax.vmap(slopes)(chunk, weights)


def _loss(law: AnyLaw, chunks: list[tuple[np.ndarray, ...]]) -> float:
    return sum(float(jnp.sum(_residuals(law, chunk) ** 2)) for chunk in chunks)


def _residual(law: AnyLaw, state: tuple[jax.Array, ...]) -> jax.Array:
    y, psi, target, weight = state
    return weight @ (gradient_and_hessian(law_at(law, psi), y) - target)


def _chunks(samples: Samples, scales: Metric) -> list[tuple[np.ndarray, ...]]:
    """Split states into parts of one size, for one compilation; the last is padded with zero weight."""
    y = np.concatenate([samples.curvature, samples.pressure], axis=1)
    target = np.concatenate([samples.gradient, samples.hessian[:, *UPPER]], axis=1)
    parts = [y, samples.psi, target, residual_weights(samples, scales)]
    missing = -len(samples) % _CHUNK
    parts = [np.concatenate([part, np.repeat(part[-1:], missing, axis=0)]) for part in parts]
    parts[-1][len(samples) :] = 0.0
    return [tuple(part[first : first + _CHUNK] for part in parts) for first in range(0, len(y), _CHUNK)]
