"""Law of a sheet whose free curvature and volumes are linear in loads: what a sheet is between two folds.

    Π(u, p) = ½ (u − û)ᵀ K (u − û) − V·δ − ½ δᵀ W δ,    û = û₀ + C δ,    δ = p − p₀

A section that has folded hardens no further: its stiffness stays within some percent over the kilopascals to
the next fold, so that six gradients and a Hessian say all. The law is linear least squares of these, stable
wherever K is positive, and has no other root.

Calibrations hold networks of ridges. A ridge φ(b + ε s) at b = −1/√5, where φ''' vanishes, is a parabola in
s to ε² s²; ten of them make the products of curvature and pressures. A network has no moment at rest, so û₀
comes with a feature that is 0 there and 1 on the sheet.
"""

import math
from dataclasses import dataclass

import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from calibration.fit import Metric, Samples
from rodmodel import RidgeNetwork

# Width of a parabola in its ridge, and offset of the ridge.
_WIDTH, _OFFSET = 1e-3, -1.0 / math.sqrt(5.0)
# The feature is tanh of this at the sheet's least pressure, and of minus this at rest.
_STEEP = 6.0
_LOWER, _UPPER = np.tril_indices(3), np.triu_indices(6)


@dataclass(frozen=True)
class AffineLaw:
    """Numbers of the law.

    Parameters
    ----------
    centre : p₀ [Pa].
    stiffness : K [N m²].
    free : û₀ [1/m].
    by_pressure : C [1/(m Pa)].
    volume, volume_by_pressure : V [m²] and W [m²/Pa].
    """

    centre: Float[np.ndarray, "3"]
    stiffness: Float[np.ndarray, "3 3"]
    free: Float[np.ndarray, "3"]
    by_pressure: Float[np.ndarray, "3 3"]
    volume: Float[np.ndarray, "3"]
    volume_by_pressure: Float[np.ndarray, "3 3"]


def fit_affine(samples: Samples, metric: Metric) -> AffineLaw:
    """Fit the law to the gradients and Hessians of states, by linear least squares.

    Raises
    ------
    ValueError
        If the stiffness that fits best is not positive.
    """
    place = np.concatenate([samples.curvature, samples.pressure], axis=1)
    centre = place.mean(axis=0)
    # Unknowns in the steps of the metric, so that all are of one size.
    step = metric.step
    parts = [
        np.outer(row == np.arange(6), column == np.arange(6)) for row, column in zip(*_UPPER, strict=True)
    ]
    hessians = np.array([(part | part.T) / np.outer(step, step) for part in parts])
    away = place - centre
    of_gradient = np.concatenate(
        [np.broadcast_to(np.diag(1.0 / step), (len(place), 6, 6)), np.einsum("kij,nj->nik", hessians, away)],
        axis=2,
    )
    rows = [np.einsum("nij,njk->nik", metric.gradient, of_gradient).reshape(-1, 6 + len(parts))]
    wanted = [np.einsum("nij,nj->ni", metric.gradient, samples.gradient).ravel()]
    shifted = np.einsum("nij,kjl->nilk", metric.gradient, hessians * step)
    rows.append(
        np.concatenate([np.zeros((*shifted.shape[:3], 6)), shifted], axis=3).reshape(-1, 6 + len(parts))
    )
    wanted.append(np.einsum("nij,njl->nil", metric.gradient, samples.hessian * step).ravel())
    found, *_ = np.linalg.lstsq(np.concatenate(rows), np.concatenate(wanted), rcond=None)
    gradient, hessian = found[:6] / step, np.einsum("k,kij->ij", found[6:], hessians)
    stiffness = hessian[:3, :3]
    if np.linalg.eigvalsh(stiffness)[0] <= 0.0:
        raise ValueError("stiffness: got one that is not positive from the sheet's states, expected it to be")
    back = np.linalg.solve(stiffness, gradient[:3])
    by_pressure = -np.linalg.solve(stiffness, hessian[:3, 3:])
    return AffineLaw(
        centre=centre[3:],
        stiffness=stiffness,
        free=centre[:3] - back,
        by_pressure=by_pressure,
        volume=hessian[3:, :3] @ back - gradient[3:],
        volume_by_pressure=by_pressure.T @ stiffness @ by_pressure - hessian[3:, 3:],
    )


def as_network(law: AffineLaw, least: Float[np.ndarray, "3"]) -> RidgeNetwork:
    """Return the law as a network of ridges, for pressures of the chamber from its least on.

    Parameters
    ----------
    law : law.
    least : least pressure of the sheet's chamber, and zeros [Pa].
    """
    pressure_scale, curvature_scale = float(law.centre.max()), float(np.linalg.norm(law.free))
    energy_scale = float(np.trace(law.stiffness)) / 3.0 * curvature_scale**2
    stiffness = law.stiffness * curvature_scale**2 / energy_scale
    # The free curvature by the scaled pressures, and by the feature as a share from 0 to 1.
    linear = (
        np.column_stack([law.by_pressure * pressure_scale, law.free - law.by_pressure @ law.centre])
        / curvature_scale
    )
    both = stiffness @ linear
    of_inputs = linear.T @ both
    curved = law.volume_by_pressure * pressure_scale**2 / energy_scale
    of_inputs[:3, :3] -= curved
    squares: list[tuple[float, np.ndarray, np.ndarray]] = []
    for left, size, right in zip(*_singular(both), strict=True):
        # −(a·x)(b·z), by the difference of two squares.
        squares += [(-size / 2.0, left, right), (size / 2.0, left, -right)]
    squares += [(size, np.zeros(3), vector) for size, vector in zip(*_eigen(of_inputs), strict=True)]
    bend = -4.0 * _OFFSET / (1.0 + _OFFSET**2) ** 3
    slope = 1.0 / (1.0 + _OFFSET**2) ** 2
    weights = np.array([size / (_WIDTH**2 * bend) for size, _, _ in squares])
    inputs = _WIDTH * np.array([z for _, _, z in squares])
    # The ridges' own slopes in z go away again, and the volumes come in.
    centre = law.centre / pressure_scale
    volume = law.volume * pressure_scale / energy_scale
    # Any positive number: the slopes have the rest.
    rest_volume = float(np.abs(volume).mean())
    slopes = -slope * weights @ inputs
    slopes[:3] += curved @ centre - volume + rest_volume
    own = least / pressure_scale
    guess = linear.copy()
    return RidgeNetwork(
        feature_weights=jnp.asarray(2.0 * _STEEP * own / (own @ own))[None],
        feature_biases=jnp.asarray([-_STEEP]),
        directions=_WIDTH * jnp.asarray(np.array([x for _, x, _ in squares])),
        mixing=jnp.asarray(_of_feature(inputs)),
        offsets=jnp.asarray(_OFFSET + 0.5 * inputs[:, 3]),
        weights=jnp.asarray(weights),
        factor=jnp.asarray(np.linalg.cholesky(stiffness)[_LOWER]),
        slopes=jnp.asarray(_of_feature(slopes)),
        guess=jnp.asarray(_of_feature(guess)),
        pressure_scale=pressure_scale,
        curvature_scale=curvature_scale,
        energy_scale=energy_scale,
        rest_volume=rest_volume * energy_scale / pressure_scale,
    )


def _of_feature(factors: np.ndarray) -> np.ndarray:
    """Factors of a share from 0 to 1, the last, as those of the feature from −1 to 1."""
    return np.concatenate([factors[..., :3], 0.5 * factors[..., 3:]], axis=-1)


def _singular(matrix: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    left, size, right = np.linalg.svd(matrix, full_matrices=False)
    return left.T, size, right


def _eigen(matrix: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    size, vectors = np.linalg.eigh(matrix)
    return size, vectors.T
