"""Common form of section laws, in which laws of different windings have equal array shapes."""

from collections.abc import Sequence
from dataclasses import replace

import jax.numpy as jnp
import numpy as np

from rodmodel.io import MIRROR, SWAPPED, turn_matrix
from rodmodel.section._law import SectionLaw
from rodmodel.section._ridge_network import RidgeNetwork
from rodmodel.section._symmetry import MirroredLaw, TurnedLaw
from rodmodel.section._unfold import transformed, unfolded


def in_common_form(laws: Sequence[SectionLaw]) -> list[RidgeNetwork]:
    """Return the laws as networks without symmetry, with equal numbers of ridges and features.

    Parameters
    ----------
    laws : ridge networks, which may be turned or mirrored.

    Raises
    ------
    ValueError
        For a law of another kind.
    """
    networks = [_written_out(law) for law in laws]
    ridges = max(network.offsets.shape[0] for network in networks)
    features = max(network.feature_biases.shape[0] for network in networks)
    return [_padded(network, ridges, features) for network in networks]


def _written_out(law: SectionLaw) -> RidgeNetwork:
    """Return the law with the ridges and features of each image written out."""
    if isinstance(law, TurnedLaw):
        return transformed(_written_out(law.law), turn_matrix(law.turns), np.roll(np.arange(3), -law.turns))
    if isinstance(law, MirroredLaw):
        return transformed(_written_out(law.law), MIRROR, SWAPPED)
    if not isinstance(law, RidgeNetwork):
        raise ValueError(
            f"section: got a {type(law).__name__}, expected a ridge network, as calibrations hold"
        )
    return unfolded(law)


def _padded(law: RidgeNetwork, ridges: int, features: int) -> RidgeNetwork:
    """Return the law padded with ridges and features of zero weight."""
    more = ridges - law.offsets.shape[0], features - law.feature_biases.shape[0]
    return replace(
        law,
        feature_weights=jnp.pad(law.feature_weights, ((0, more[1]), (0, 0))),
        feature_biases=jnp.pad(law.feature_biases, (0, more[1])),
        directions=jnp.pad(law.directions, ((0, more[0]), (0, 0))),
        mixing=jnp.pad(law.mixing, ((0, more[0]), (0, more[1]))),
        offsets=jnp.pad(law.offsets, (0, more[0])),
        weights=jnp.pad(law.weights, (0, more[0])),
        slopes=jnp.pad(law.slopes, (0, more[1])),
        guess=jnp.pad(law.guess, ((0, 0), (0, more[1]))),
        rest_pressures=jnp.zeros(3) if law.rest_pressures is None else law.rest_pressures,
        quadratic=jnp.zeros(6) if law.quadratic is None else law.quadratic,
    )
