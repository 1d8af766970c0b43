"""Section laws in one common form, so that laws of different windings are arrays of the same shapes."""

from collections.abc import Sequence
from dataclasses import replace

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from rodmodel.section._law import SectionLaw
from rodmodel.section._ridge_network import RidgeNetwork
from rodmodel.section._turned import INTO_TURNED, MIRROR, SWAPPED, MirroredLaw, TurnedLaw

_ROWS, _COLUMNS = np.tril_indices(3)  # of a factor's entries


def in_common_form(laws: Sequence[SectionLaw]) -> list[RidgeNetwork]:
    """The same laws as networks without symmetry: all with the first's scales, as many ridges and features.

    Parameters
    ----------
    laws : ridge networks, turned or mirrored ones among them.

    Raises
    ------
    ValueError
        Where a law is none of these.
    """
    networks = [_written_out(law) for law in laws]
    first = networks[0]
    ridges = max(network.offsets.shape[0] for network in networks)
    features = max(network.feature_biases.shape[0] for network in networks)
    return [_padded(_scaled_like(first, network), ridges, features) for network in networks]


def _written_out(law: SectionLaw) -> RidgeNetwork:
    """The law with the ridges and features of each image written out."""
    if isinstance(law, TurnedLaw):
        return _seen(_written_out(law.law), INTO_TURNED[law.turns], np.roll(np.arange(3), -law.turns))
    if isinstance(law, MirroredLaw):
        return _seen(_written_out(law.law), MIRROR, SWAPPED)
    if not isinstance(law, RidgeNetwork):
        raise ValueError(
            f"section: got a {type(law).__name__}, expected a ridge network, as calibrations hold"
        )
    biases = jnp.broadcast_to(law.feature_biases, (len(law.images), law.feature_biases.shape[-1]))
    parts = [
        _seen(replace(law, feature_biases=own, symmetry="none"), turn, order)
        for own, (turn, order) in zip(biases, law.images, strict=True)
    ]
    share = 1.0 / len(parts)
    ridges = [part.mixing[:, 3:] for part in parts]
    own = jnp.zeros((len(parts) * ridges[0].shape[0], len(parts) * ridges[0].shape[1]), biases.dtype)
    for image, block in enumerate(ridges):
        height, width = block.shape
        own = own.at[image * height : (image + 1) * height, image * width : (image + 1) * width].set(block)
    stiffness = jnp.sum(jnp.stack([_square(part.factor) for part in parts]), axis=0)
    return replace(
        parts[0],
        feature_weights=jnp.concatenate([part.feature_weights for part in parts]),
        feature_biases=jnp.concatenate([part.feature_biases for part in parts]),
        directions=jnp.concatenate([part.directions for part in parts]),
        mixing=jnp.concatenate([jnp.concatenate([part.mixing[:, :3] for part in parts]), own], axis=1),
        offsets=jnp.concatenate([part.offsets for part in parts]),
        weights=share * jnp.concatenate([part.weights for part in parts]),
        factor=_factor(share * stiffness),
        slopes=share * _of_all([part.slopes for part in parts]),
        guess=share * _of_all([part.guess for part in parts]),
    )


def _of_all(parts: list[Float[Array, "*n h"]]) -> Float[Array, "*n g"]:
    """Factors of (q, hidden of all images), from those of (q, hidden) of each."""
    return jnp.concatenate(
        [sum(part[..., :3] for part in parts), *(part[..., 3:] for part in parts)], axis=-1
    )


def _seen(law: RidgeNetwork, turn: np.ndarray, order: np.ndarray) -> RidgeNetwork:
    """Law Π(U u, p[order]) of a network without symmetry."""
    axes = jnp.asarray(turn, law.offsets.dtype)
    back = np.argsort(order)  # e · p[order] = e[back] · p

    def renumbered(factors: Array) -> Array:
        return jnp.concatenate([factors[..., back], factors[..., 3:]], axis=-1)

    return replace(
        law,
        feature_weights=law.feature_weights[:, back],
        directions=law.directions @ axes,
        mixing=renumbered(law.mixing),
        factor=_factor(axes.T @ _square(law.factor) @ axes),
        slopes=renumbered(law.slopes),
        guess=axes.T @ renumbered(law.guess),
    )


def _scaled_like(first: RidgeNetwork, law: RidgeNetwork) -> RidgeNetwork:
    """The law with the scales of the first, and its volume at rest."""
    curvature = first.curvature_scale / law.curvature_scale
    pressure = first.pressure_scale / law.pressure_scale
    energy = law.energy_scale / first.energy_scale
    more_volume = (law.rest_volume - first.rest_volume) * first.pressure_scale / first.energy_scale

    def of_pressure(factors: Array) -> Array:
        return factors.at[..., :3].multiply(pressure)

    return replace(
        law,
        feature_weights=pressure * law.feature_weights,
        directions=curvature * law.directions,
        mixing=of_pressure(law.mixing),
        weights=energy * law.weights,
        factor=curvature * energy**0.5 * law.factor,
        slopes=energy * of_pressure(law.slopes).at[:3].add(-more_volume / energy),
        guess=of_pressure(law.guess) / curvature,
        pressure_scale=first.pressure_scale,
        curvature_scale=first.curvature_scale,
        energy_scale=first.energy_scale,
        rest_volume=first.rest_volume,
    )


def _padded(law: RidgeNetwork, ridges: int, features: int) -> RidgeNetwork:
    """The law with ridges and features of no weight."""
    more = ridges - law.offsets.shape[0], features - law.feature_biases.shape[0]
    wider = ((0, 0), (0, more[1]))
    return replace(
        law,
        feature_weights=jnp.pad(law.feature_weights, ((0, more[1]), (0, 0))),
        feature_biases=jnp.pad(law.feature_biases, (0, more[1])),
        directions=jnp.pad(law.directions, ((0, more[0]), (0, 0))),
        mixing=jnp.pad(law.mixing, ((0, more[0]), (0, more[1]))),
        offsets=jnp.pad(law.offsets, (0, more[0])),
        weights=jnp.pad(law.weights, (0, more[0])),
        slopes=jnp.pad(law.slopes, (0, more[1])),
        guess=jnp.pad(law.guess, wider),
    )


def _square(factor: Float[Array, "6"]) -> Float[Array, "3 3"]:
    lower = jnp.zeros((3, 3), factor.dtype).at[_ROWS, _COLUMNS].set(factor)
    return lower @ lower.T


def _factor(stiffness: Float[Array, "3 3"]) -> Float[Array, "6"]:
    return jnp.linalg.cholesky(stiffness)[_ROWS, _COLUMNS]
