"""Section laws of all orientations ψ of a double helix, in one network."""

import math
from dataclasses import replace
from typing import final

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike, Float

from rodmodel.section._ridge_network import RidgeNetwork

# ψ of the images of a state, in the order of the full symmetry: sign · (ψ − 120° turns).
_SIGNS = np.repeat([1.0, -1.0], 3)
_TURNS = np.tile(np.arange(3), 2) * (2.0 * math.pi / 3.0)


@final
class OrientedNetwork(eqx.Module):
    """Network of ridges whose hidden functions of the pressures are functions of ψ too.

    A turn by 120° or a mirror takes a double helix at ψ to one at another: with U and S what they do to
    curvature and pressures,

        Π(u, p; ψ) = Π(U u, S p; ψ − 120°) = Π(M u, S' p; −ψ),

    and the threads cross at ψ and ψ + 180° alike. All of this holds exactly: the network is the mean over
    these images, and knows ψ as cos 2ψ and sin 2ψ,

        h(q, ψ) = (q, tanh(W q + V (cos 2ψ, sin 2ψ) + w)).

    Attributes
    ----------
    network : the network with W and w, of full symmetry.
    orientation_weights : V.
    """

    network: RidgeNetwork
    orientation_weights: Float[Array, "_ 2"]

    def __check_init__(self) -> None:
        """Refuse weights that do not fit the network."""
        if self.network.symmetry != "full" or self.network.feature_biases.ndim != 1:
            raise ValueError("network: got one of a single orientation, expected full symmetry and one w")
        expected = (len(self.network.feature_biases), 2)
        if self.orientation_weights.shape != expected:
            raise ValueError(
                f"orientation_weights: got shape {self.orientation_weights.shape}, expected {expected}"
            )

    def at_psi(self, psi: Float[ArrayLike, ""]) -> RidgeNetwork:
        """Section law of the winding at an orientation ψ [rad]; differentiable in it."""
        dtype = self.orientation_weights.dtype
        twice = 2.0 * jnp.asarray(_SIGNS, dtype) * (psi - jnp.asarray(_TURNS, dtype))
        harmonics = jnp.stack([jnp.cos(twice), jnp.sin(twice)], axis=1)
        biases = self.network.feature_biases + harmonics @ self.orientation_weights.T
        return replace(self.network, feature_biases=biases)
