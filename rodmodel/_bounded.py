"""Least squares over the pressures of a domain: 0 ≤ p_k ≤ p_max,k and Σ p_k ≤ p_sum."""

import itertools
from collections.abc import Callable
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float, Int

from rodmodel._components import PAIRS, Scalar, Symmetric, Triple, apply, combine, dot, solve, triple
from rodmodel.calibration_file import Domain, Number

_MAX_STEPS = 200  # in a long valley, where a third pressure hardly moves the tip
# Of Levenberg and Marquardt's term, against squares of derivatives near one: at first, least and most.
_DAMPING, _LEAST_DAMPING, _MOST_DAMPING = 1e-3, 1e-14, 1e8
_SHRINK, _GROW = 0.1, 5.0
# How many steps may be taken from where the sum of squares has grown, and by how much: along a curved valley
# the next step mends what the one before has missed of it.
_ASTRAY, _HIGHEST = 2, 100.0


Evaluate = Callable[[Float[Array, "3"], Any], tuple[Float[Array, " m"], Float[Array, "m 3"], Any]]


class Box(NamedTuple):
    """A domain, or a face of it, in units of its largest pressure, and all faces of that, down to corners."""

    upper: Float[Array, "3"]
    total: Float[Array, ""]
    points: Float[Array, "n 3"]
    """A point of each face."""
    directions: Float[Array, "n 3 3"]
    """Orthonormal directions that span each face, as columns; zero where there are fewer than three."""


class Fit(NamedTuple):
    """End of a search."""

    point: Float[Array, "3"]
    cost: Float[Array, ""]
    """Sum of squares of the residual; infinite where none was found that is finite."""
    converged: Bool[Array, ""]
    """Whether no step within the box makes the residual smaller."""
    steps: Int[Array, ""]
    memory: Any
    """What the evaluation there left for the next ones."""


class _Place(NamedTuple):
    point: Float[Array, "3"]
    cost: Float[Array, ""]
    residual: Float[Array, " m"]
    slope: Float[Array, "m 3"]
    memory: Any


class _Progress(NamedTuple):
    best: _Place
    at: _Place
    """Where the next step is from."""
    astray: Int[Array, ""]
    """Steps since the best."""
    damping: Float[Array, ""]
    converged: Bool[Array, ""]
    steps: Int[Array, ""]


def boxes_of(domain: Domain) -> Box:
    """Four boxes, stacked: the faces of a domain without pressure in chamber 1, 2 or 3, and the whole domain.

    Each pressure is free, zero or at its largest, and the sum free or at its largest: at most 54 faces of
    the whole. Empty ones only cost time, and are left out where the domain is known. Boxes with fewer repeat
    their last one.
    """
    leaves = jax.tree.leaves(domain)
    xp: Any = jnp if any(isinstance(leaf, jax.Array) for leaf in leaves) else np
    upper = xp.stack(domain.pressure_max)
    upper, total = upper / xp.max(upper), domain.pressure_sum_max / xp.max(upper)
    boxes = []
    for without in (0, 1, 2, None):
        held = xp.where(xp.arange(3) == (-1 if without is None else without), 0.0, upper)
        boxes.append((held, *_faces(xp, held, total, without)))
    most = max(len(points) for _, points, _ in boxes)
    # Which of its faces a box has at each of as many places.
    places = [np.minimum(np.arange(most), len(points) - 1) for _, points, _ in boxes]
    return Box(
        upper=jnp.asarray([upper for upper, _, _ in boxes], float),
        total=jnp.full(len(boxes), total, float),
        points=jnp.asarray(
            [points[place] for (_, points, _), place in zip(boxes, places, strict=True)], float
        ),
        directions=jnp.asarray(
            [spans[place] for (_, _, spans), place in zip(boxes, places, strict=True)], float
        ),
    )


def _faces(xp: Any, upper: Any, total: Any, without: int | None) -> tuple[Any, Any]:
    """Points and directions of a domain's faces, or of the faces of one without one chamber's pressure."""
    points, directions = [], []
    for held in itertools.product(("free", "lower", "upper"), repeat=3):
        if without is not None and held[without] != "lower":
            continue
        free = np.array([state == "free" for state in held])
        point = xp.where(np.array([state == "upper" for state in held]), upper, 0.0)
        left = total - point.sum()
        if xp is jnp or left >= 0.0:
            points.append(point)
            directions.append(np.diag(free.astype(float)))
        if free.any() and (xp is jnp or 0.0 <= left <= upper[free].sum()):
            points.append(xp.where(free, left / free.sum(), point))
            # Orthonormal complement of (1, ..., 1) among the free ones.
            columns = np.linalg.svd(np.ones((1, free.sum())))[2][1:].T
            spanned = np.zeros((3, 3))
            spanned[free, : columns.shape[1]] = columns
            directions.append(spanned)
    return xp.stack(points), np.array(directions)


def least_squares(
    evaluate: Evaluate,
    start: Float[Array, "3"],
    box: Box,
    enough: Number,
    worth: Number = 0.0,
    memory: Any = (),
) -> Fit:
    """Minimise the sum of squares of a residual over a box, by Levenberg and Marquardt's method.

    Each step minimises the damped linear model over the whole box, faces included, exactly. The search ends
    at a residual that is small enough, or where the linear model promises no more of it to go. Steps that
    come out higher are taken for a while, and taken back where they lead to nothing better.

    Parameters
    ----------
    evaluate : residual and its derivative at a point [units of the box], and a new memory, of the point and
        the memory of the place that it is sought from. A residual that is not finite is stepped back from.
    start : inside the box.
    box : where to search.
    enough : a sum of squares that ends the search.
    worth : part of the sum of squares that a step must promise to take off; no less than roundings allow.
    memory : what `evaluate` is given at the start.

    References
    ----------
    Nocedal and Wright (2006), Numerical Optimization, chs 10.3 and 16; Chamberlain, Powell, Lemarechal and
    Pedersen (1982), Math. Program. Study 16, 1, for the steps that come out higher.
    """
    dtype = start.dtype
    epsilon = float(jnp.finfo(dtype).eps)
    small, enough = epsilon**0.6, jnp.maximum(enough, epsilon**1.2)

    def advance(progress: _Progress) -> _Progress:
        best, at, damping = progress.best, progress.at, progress.damping
        # The first step is none: it evaluates the start.
        first = progress.steps == 0
        curvature, gradient = at.slope.T @ at.slope, at.slope.T @ at.residual
        trial = _minimum(curvature + damping * jnp.eye(3, dtype=dtype), gradient, at.point, box)
        trial = jnp.where(first, at.point, trial)
        step = trial - at.point
        promise = -(2.0 * gradient + curvature @ step) @ step

        residual, slope, memory = evaluate(trial, at.memory)
        there = _Place(trial, jnp.sum(residual**2), residual, slope, memory)
        finite = jnp.all(jnp.isfinite(slope))
        better = (there.cost <= best.cost) & finite
        taken = finite & (progress.astray < _ASTRAY) & (there.cost <= _HIGHEST * best.cost)
        # Written so that a NaN, from a start without a residual, ends the search.
        going = (promise > jnp.maximum(worth, small) * at.cost) & (jnp.max(jnp.abs(step)) > small)
        ended = ~first & ~going & (progress.astray == 0)
        met = better & (there.cost <= enough)
        new_best = _choose(better, there, best)
        return _Progress(
            best=new_best,
            at=_choose(better | taken, there, new_best),
            astray=jnp.where(better | ~taken, 0, progress.astray + 1),
            damping=jnp.where(
                first | (taken & ~better),
                damping,
                jnp.clip(damping * jnp.where(better, _SHRINK, _GROW), _LEAST_DAMPING, _MOST_DAMPING),
            ),
            converged=(ended & jnp.isfinite(best.cost)) | met,
            steps=progress.steps + 1,
        )

    def unfinished(progress: _Progress) -> Bool[Array, ""]:
        evaluated = (progress.steps > 0) & ~jnp.isfinite(progress.best.cost)
        return ~progress.converged & ~evaluated & (progress.steps < _MAX_STEPS)

    shape = jax.eval_shape(evaluate, start, memory)[1].shape
    infinite = jnp.asarray(jnp.inf, dtype)
    begin = _Place(start, infinite, jnp.zeros(shape[0], dtype), jnp.zeros(shape, dtype), memory)
    none = jnp.zeros((), int)
    damping = jnp.asarray(_DAMPING, dtype)
    end = jax.lax.while_loop(
        unfinished, advance, _Progress(begin, begin, none, damping, jnp.array(False), none)
    )
    return Fit(end.best.point, end.best.cost, end.converged, end.steps, end.best.memory)


def _choose(condition: Bool[Array, ""], one: _Place, other: _Place) -> _Place:
    chosen: _Place = jax.tree.map(lambda a, b: jnp.where(condition, a, b), one, other)
    return chosen


def _minimum(
    curvature: Float[Array, "3 3"], gradient: Float[Array, "3"], point: Float[Array, "3"], box: Box
) -> Float[Array, "3"]:
    """Minimum over a box of ½ dᵀ H d + gᵀ d, d from `point`, H positive definite.

    It is the least of those minima on the planes of the faces that are in the box. In components, each an
    array over the faces: so XLA makes one loop of it.
    """
    slack = 8.0 * jnp.finfo(point.dtype).eps
    symmetric: Symmetric = tuple(curvature[pair] for pair in PAIRS)  # type: ignore[assignment]
    here, downhill = triple(point), triple(gradient)
    base = triple(box.points.T)
    spans = [triple(box.directions[:, :, k].T) for k in range(3)]

    away = combine((1.0, base), (-1.0, here))
    slope = combine((1.0, downhill), (1.0, apply(symmetric, away)))
    bent = [apply(symmetric, span) for span in spans]
    # Along a direction that is not there nothing changes.
    filling = [1.0 - dot(span, span) for span in spans]
    first, second, third = (
        tuple(dot(span, bent[k]) + (filling[k] if j == k else 0.0) for j, span in enumerate(spans))
        for k in range(3)
    )
    right = tuple(-dot(span, slope) for span in spans)
    along = solve((_three(first), _three(second), _three(third)), _three(right))
    candidate = combine((1.0, base), *zip(along, spans, strict=True))
    step = combine((1.0, candidate), (-1.0, here))
    value = dot(downhill, step) + 0.5 * dot(step, apply(symmetric, step))
    inside = candidate[0] + candidate[1] + candidate[2] <= box.total + slack
    for k in range(3):
        inside = inside & (candidate[k] >= -slack) & (candidate[k] <= box.upper[k] + slack)
    least = jnp.argmin(jnp.where(inside, value, jnp.inf))
    # Within rounding of a bound is on it.
    return jnp.clip(jnp.stack([component[least] for component in candidate]), 0.0, box.upper)


def _three(values: tuple[Scalar, ...]) -> Triple:
    x, y, z = values
    return x, y, z
